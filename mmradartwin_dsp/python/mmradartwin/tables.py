"""CSV files with a fixed header."""
import csv

import numpy as np

from mmradartwin.input_error import InputError
from mmradartwin.strict_yaml import read_text


def read_rows(text, file, header):
    """(line, fields) of every row; raises InputError where the header or a row's length is another."""
    lines = text.splitlines()
    found = ",".join(name.strip() for name in lines[0].split(",")) if lines else ""
    if found != header:
        raise InputError(f"{file}: line 1: header is '{found[:80]}'; it must be {header}")
    columns = header.count(",") + 1
    for line, fields in enumerate(csv.reader(lines[1:]), start=2):
        if not any(field.strip() for field in fields):
            continue
        if len(fields) != columns:
            raise InputError(f"{file}: line {line}: {len(fields)} fields; a row has {columns}, {header}")
        yield line, [field.strip() for field in fields]


def read_table(file, header, numbers, empty_is_nan=False):
    """Columns by name: float64 arrays of those in numbers, lists of texts of the others."""
    names = header.split(",")
    columns = {name: [] for name in names}
    for line, fields in read_rows(read_text(file), file, header):
        for name, text in zip(names, fields):
            columns[name].append(_number(file, line, name, text, empty_is_nan) if name in numbers else text)
    return {name: np.array(column, float) if name in numbers else column for name, column in columns.items()}


def _number(file, line, name, text, empty_is_nan):
    number = decimal_of("nan" if empty_is_nan and not text else text)
    if number is None:
        raise InputError(f"{file}: line {line}: {name} '{text}' is no number")
    return number


def decimal_of(text):
    """A number as programs write it, nan and inf too; None for any other text."""
    try:
        return None if "_" in text else float(text)
    except ValueError:
        return None
