"""The pages of README and docs/, and what stands in their fences."""
import os
import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(os.path.realpath(__file__)).parents[2]
LANGUAGES = {"console", "text", "yaml", "xml", "cmake", "cpp", "python"}
FENCE = re.compile(r"^```(\w*)(?: (no-test|file): (.+))?$")


@dataclass
class Fence:
    """A block between ``` lines: its language, `no-test` or `file` with what follows it, its text and first line."""
    language: str
    mark: str
    about: str
    text: str
    line: int

    @property
    def commands(self):
        """Commands of a console: lines behind `$ `, continued where one ends in a backslash."""
        found, lines = [], iter(self.text.splitlines())
        for line in lines:
            if line.startswith("$ "):
                command = line[2:]
                while command.endswith("\\"):
                    command = command[:-1] + next(lines).removeprefix("> ")
                found.append(command)
        return found


def pages():
    """README first, then docs/ by path."""
    return [ROOT / "README.md"] + sorted((ROOT / "docs").rglob("*.md"))


def name_of(page):
    return str(page.relative_to(ROOT))


def fences(page):
    """Fences of a page in their order; one that is malformed or never ends is a ValueError."""
    found, opened, body = [], None, []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if opened is None and line.startswith("```"):
            match = FENCE.match(line)
            if not match or match.group(1) not in LANGUAGES:
                raise ValueError(f"{name_of(page)}:{number}: '{line}' is no fence; languages: {', '.join(sorted(LANGUAGES))}")
            opened, body = Fence(match.group(1), match.group(2) or "", match.group(3) or "", "", number), []
        elif opened is not None and line == "```":
            opened.text = "\n".join(body) + "\n"
            found.append(opened)
            opened = None
        elif opened is not None:
            body.append(line)
    if opened is not None:
        raise ValueError(f"{name_of(page)}:{opened.line}: the fence never ends")
    return found


def prose(page):
    """Text of a page without its fences."""
    return re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
