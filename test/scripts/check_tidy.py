#!/usr/bin/env python3
"""Runs clang-tidy over the packages' sources and remembers those that it had nothing to say of.

A source is looked at again when it, a header of ours that it includes, its compile command or the checks have changed.
The newest come first: with --seconds, what is left at the end of the time is not looked at."""
import argparse
import concurrent.futures
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import check_includes

PARTS = ("src", "apps", "nodes", "emulator")
UNKNOWN_TO_CLANG = {"-fcx-limited-range"}


def entries_of_sources(build):
    """Entries of compile_commands.json, with those that include others' sources (together/) as one for each of these."""
    for entry in json.loads((build / "compile_commands.json").read_text(encoding="utf-8")):
        file = Path(entry["file"])
        if file.parent.name != "together":
            yield entry
            continue
        for path in re.findall(r'^#include "(.*)"$', file.read_text(encoding="utf-8"), re.MULTILINE):
            source = str((file.parent / path).resolve())
            yield {**entry, "file": source, "command": entry["command"].replace(str(file), source)}


def compile_commands(build, root):
    """Source's path from the root: its compile command without what clang does not know."""
    commands = {}
    for entry in entries_of_sources(build):
        try:
            file = Path(os.path.realpath(entry["file"])).relative_to(root).as_posix()
        except ValueError:
            continue
        if file.split("/")[0] in check_includes.PACKAGES and file.split("/")[1] in PARTS and file not in commands:
            words = [word for word in shlex.split(entry["command"]) if word not in UNKNOWN_TO_CLANG]
            words[0] = "c++"
            commands[file] = {**entry, "command": shlex.join(words)}
    return commands


def fingerprints(root, sources, commands):
    checks = (root / ".clang-tidy").read_bytes()
    version = subprocess.run(["clang-tidy", "--version"], capture_output=True, check=True).stdout
    arrows = {}
    for source, target in sources.arrows():
        arrows.setdefault(source, set()).add(target)
    contents = {file: hashlib.sha256((root / file).read_bytes()).digest() for file in sources.includes}
    for file, entry in commands.items():
        seen, left = {file}, [file]
        while left:
            new = arrows.get(left.pop(), set()) - seen
            seen |= new
            left += new
        key = hashlib.sha256(version + checks + entry["command"].replace(str(root), "").encode())
        for name in sorted(seen):
            key.update(name.encode() + contents.get(name, b""))
        yield file, key.hexdigest()


def ages(root):
    """File: place in the order of changes, the newest 0; files that differ from the last commit are newest of all."""
    def git(*words):
        result = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, check=False)
        return result.stdout.splitlines()
    order = git("diff", "--name-only", "HEAD") + git("log", "--format=", "--name-only")
    return {file: age for age, file in reversed(list(enumerate(order)))}


def look_at(file, database):
    result = subprocess.run(["clang-tidy", "--quiet", "-p", str(database), file], capture_output=True, text=True,
                            check=False)
    said = [line for line in result.stdout.splitlines() if re.search(r": (error|warning): |^error: ", line)]
    if result.returncode and not said:
        said = [f"{file}: clang-tidy failed: {result.stderr.strip()[-300:]}"]
    return said


def check(root, build, cache, seconds=None, jobs=None):
    """Returns (problems, a line about what was looked at)."""
    cache.mkdir(parents=True, exist_ok=True)
    sources = check_includes.Sources(root)
    commands = compile_commands(build, root)
    (cache / "compile_commands.json").write_text(json.dumps(list(commands.values())), encoding="utf-8")
    age = ages(root)
    left = []
    for file, key in fingerprints(root, sources, commands):
        if not (cache / key).exists():
            header = re.sub(r"\.cpp$", ".h", file)
            left.append((min(age.get(file, len(age)), age.get(header, len(age))), file, key))
    start, problems, looked = time.monotonic(), set(), 0

    def run(item):
        _, file, key = item
        if seconds is not None and time.monotonic() - start > seconds:
            return False
        said = look_at(commands[file]["file"], cache)
        problems.update(re.sub(r"^/\S*?/(?=mmradartwin_\w+/(src|include|apps|nodes|emulator)/)", "", line)
                        for line in said)
        if not said:
            (cache / key).touch()
        return True

    with concurrent.futures.ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        looked = sum(pool.map(run, sorted(left)))
    known, late = len(commands) - len(left), len(left) - looked
    line = f"{looked} sources looked at, {known} known from before"
    if late:
        line += f", {late} left for want of time"
    return sorted(problems), line


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    root = Path(__file__).resolve().parents[2]
    parser.add_argument("--build", type=Path, default=root / ".ws/build", help="folder with compile_commands.json")
    parser.add_argument("--cache", type=Path, default=root / ".ws/lint", help="what is remembered")
    parser.add_argument("--seconds", type=float, help="no source is begun after this time")
    arguments = parser.parse_args()
    problems, line = check(root, arguments.build, arguments.cache, arguments.seconds)
    print("\n".join([*problems, f"clang-tidy: {line}"]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
