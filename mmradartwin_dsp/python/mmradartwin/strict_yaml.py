"""YAML mappings read strictly: unknown, missing and doubled keys are errors, and so are values out of range."""
import math

import yaml

from mmradartwin.input_error import InputError


class _Texts(yaml.BaseLoader):
    """Leaves scalars as texts: PyYAML reads 77.0e9 as one and 77.0e+9 as a number, and both are numbers here."""

    def construct_mapping(self, node, deep=False):
        seen = set()
        for key, _ in node.value:
            if not isinstance(key, yaml.ScalarNode):
                raise InputError("has a key that is no word")
            if key.value in seen:
                raise InputError(f"key {key.value} stands twice (second time in line {key.start_mark.line + 1}); "
                                 "remove one")
            seen.add(key.value)
        return super().construct_mapping(node, deep)


class YamlMap:
    """A mapping; each key that is asked for is known, and reject_unknown_keys() refuses the others."""

    def __init__(self, file, values, prefix=""):
        self.file, self._values, self._prefix, self._known = file, values, prefix, []

    @classmethod
    def load(cls, file):
        """Raises InputError where the file cannot be read or is no mapping."""
        return cls.parse(read_text(file), file)

    @classmethod
    def parse(cls, text, file):
        """The mapping of a text; file names it in errors."""
        try:
            values = yaml.load(text, Loader=_Texts)
        except yaml.YAMLError as error:
            raise InputError(f"{file}: is no YAML: {' '.join(str(error).split())}") from None
        except InputError as error:
            raise InputError(f"{file}: {error}") from None
        if not isinstance(values, dict):
            raise InputError(f"{file}: expected a YAML mapping")
        return cls(file, values)

    def fail(self, key, why):
        """Raises the error of a key."""
        raise InputError(f"{self.file}: key {self._prefix}{key}: {why}")

    def has(self, key):
        """True where the key is there; it is known from now on."""
        self._known.append(key)
        return key in self._values

    def _value(self, key):
        if not self.has(key):
            self.fail(key, "is missing; add it")
        return self._values[key]

    def text(self, key, allowed=None):
        """A text that is not empty."""
        value = self._value(key)
        if not isinstance(value, str) or not value:
            self.fail(key, f"{_quoted(value)} is no text")
        if allowed and value not in allowed:
            self.fail(key, f"{_quoted(value)} is unknown; allowed: {', '.join(allowed)}")
        return value

    def number(self, key, least, most):
        """A number from least to most."""
        return self._number(key, self._value(key), least, most)

    def integer(self, key, least, most):
        """A whole number from least to most."""
        return self._integer(key, self._value(key), least, most)

    def numbers(self, key, least, most):
        """A list of numbers."""
        return [self._number(f"{key}[{i}]", v, least, most) for i, v in enumerate(self._list(key, self._value(key)))]

    def integers(self, key, least, most):
        """A list of whole numbers."""
        return [self._integer(f"{key}[{i}]", v, least, most) for i, v in enumerate(self._list(key, self._value(key)))]

    def rows(self, key, columns, least, most):
        """A list, which is not empty, of lists of so many numbers."""
        rows = []
        for i, row in enumerate(self._list(key, self._value(key))):
            name = f"{key}[{i}]"
            rows.append([self._number(f"{name}[{j}]", v, least, most) for j, v in enumerate(self._list(name, row))])
            if len(rows[-1]) != columns:
                self.fail(name, f"has {len(rows[-1])} numbers; it needs {columns}")
        if not rows:
            self.fail(key, "is empty; give at least one row")
        return rows

    def integer_lists(self, key, least, most):
        """A list of lists of whole numbers."""
        return [[self._integer(f"{key}[{i}][{j}]", v, least, most) for j, v in enumerate(self._list(f"{key}[{i}]", row))]
                for i, row in enumerate(self._list(key, self._value(key)))]

    def map(self, key):
        """A mapping below this one."""
        value = self._value(key)
        if not isinstance(value, dict):
            self.fail(key, f"{_quoted(value)} is no mapping")
        return YamlMap(self.file, value, f"{self._prefix}{key}.")

    def reject_unknown_keys(self):
        """Raises InputError where the mapping has a key that nobody asked for."""
        for key in self._values:
            if key not in self._known:
                self.fail(key, f"is unknown; known: {', '.join(sorted(set(self._known)))}")

    def _list(self, key, value):
        if not isinstance(value, list):
            self.fail(key, f"{_quoted(value)} is no list; write it in [ ]")
        return value

    def _number(self, key, value, least, most):
        number = number_of(value)
        if number is None:
            self.fail(key, f"{_quoted(value)} is no number; allowed: {least:.12g} to {most:.12g}")
        if not least <= number <= most:
            self.fail(key, f"{_quoted(value)} is out of range; allowed: {least:.12g} to {most:.12g}")
        return number

    def _integer(self, key, value, least, most):
        number = self._number(key, value, least, most)
        if number != math.floor(number):
            self.fail(key, f"{_quoted(value)} is no whole number; allowed: {least} to {most}")
        return int(number)


def number_of(text):
    """The whole text as a decimal number, else None."""
    if not isinstance(text, str) or not text or text.strip("+-.0123456789eE"):
        return None
    try:
        return float(text)
    except ValueError:
        return None


def read_text(file):
    """Text of a file; raises InputError."""
    try:
        with open(file, encoding="utf-8-sig") as stream:
            return stream.read()
    except OSError as error:
        raise InputError(f"{file}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise InputError(f"{file}: is no text") from None


def _quoted(value):
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list):
        return "a list"
    text = value.replace("\n", " ")
    return f"'{text if len(text) <= 60 else text[:57] + '...'}'" if text else "nothing"
