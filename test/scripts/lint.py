#!/usr/bin/env python3
"""All that ./run.sh lint checks: format and errors of C++, includes, Python, shell scripts and packages.

Every part prints what it has found and a line with its time; the exit status is 1 where one has found something."""
import argparse
import json
import os
import shutil
import subprocess
import sys
import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from xml.etree import ElementTree

import check_includes
import check_tidy

ROOT = Path(__file__).resolve().parents[2]
RUFF = "@astral-sh/ruff-wasm-nodejs@0.17.4"


class NotHere(Exception):
    """A tool is missing; the message says which and what to do."""


def tracked(*patterns):
    names = subprocess.run(["git", "-C", str(ROOT), "ls-files", *patterns], capture_output=True, text=True, check=True)
    return [name for name in names.stdout.splitlines() if (ROOT / name).exists()]


def output_of(*command, **options):
    """Status and lines of a program, of its errors too."""
    if not shutil.which(command[0]):
        raise NotHere(f"{command[0]} is not here; ./run.sh setup installs it")
    result = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
                            **options)
    return result.returncode, result.stdout.splitlines()


def check_format(_):
    def check_some(some):
        status, lines = output_of("clang-format", "--dry-run", "-Werror", "--ferror-limit=1", *some)
        return [line for line in lines if "error:" in line] or ["clang-format failed"] if status else []
    files = tracked("*.cpp", "*.h")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        problems = sum(pool.map(check_some, [files[i:i + 30] for i in range(0, len(files), 30)]), [])
    return problems, f"{len(files)} files; clang-format -i mends them"


def check_include_rule(_):
    sources = check_includes.Sources(ROOT)
    return check_includes.check(sources), f"{len(sources.includes)} files"


def ruff_from_registry(files):
    """Ruff's WebAssembly build, fetched once: Debian has no ruff."""
    folder = ROOT / ".ws/lint/ruff"
    for program in ("node", "npm"):
        if not shutil.which(program):
            raise NotHere("neither ruff nor node and npm are here; pip install ruff, or apt-get install npm")
    if not (folder / "node_modules").exists():
        folder.mkdir(parents=True, exist_ok=True)
        status, lines = output_of("npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), RUFF)
        if status:
            raise NotHere(f"ruff is not here, and npm could not fetch {RUFF}: {' '.join(lines)[:200]}")
    settings = tomllib.loads((ROOT / "ruff.toml").read_text(encoding="utf-8"))
    return output_of("node", "test/scripts/ruff_wasm.js", json.dumps(settings), *files,
                     env={**os.environ, "RUFF_FOLDER": str(folder)})


def check_python(_):
    files = tracked("*.py")
    if shutil.which("ruff"):
        status, lines = output_of("ruff", "check", "--output-format=concise", *files)
    else:
        status, lines = ruff_from_registry(files)
    return lines if status else [], f"{len(files)} files by ruff"


def check_shell(_):
    files = [name for name in tracked() if name.endswith(".sh") or is_shell_script(ROOT / name)]
    status, lines = output_of("shellcheck", "--format=gcc", *files)
    return lines if status else [], f"{len(files)} files by shellcheck"


def is_shell_script(file):
    with open(file, "rb") as stream:
        first = stream.readline(80)
    return first.startswith(b"#!") and (b"bash" in first or first.strip().endswith(b"/sh"))


def check_packages(_):
    # Include folders stand at each target, not at the directory; launch, config and test have names of their own.
    folders = [name.rsplit("/", 1)[0] for name in tracked("*/package.xml")]
    status, lines = output_of("catkin_lint", "--offline", "-W2", "--ignore", "package_path_name",
                              "--ignore", "unused_catkin_include_dirs", *folders)
    problems = [line for line in lines if not line.startswith("catkin_lint: ")]
    return problems if status else [], f"{len(folders)} packages"


def check_sources(arguments):
    build = ROOT / ".ws/build"
    if not (build / "compile_commands.json").exists():
        raise NotHere("the workspace is not built yet, and clang-tidy reads how sources are compiled; ./run.sh build")
    if not shutil.which("clang-tidy"):
        raise NotHere("clang-tidy is not here; ./run.sh setup installs it")
    return check_tidy.check(ROOT, build, ROOT / ".ws/lint", None if arguments.all else arguments.seconds)


PARTS = {
    "format": check_format,
    "includes": check_include_rule,
    "python": check_python,
    "shell": check_shell,
    "packages": check_packages,
    "clang_tidy": check_sources,
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of {', '.join(PARTS)}; all if none is named")
    parser.add_argument("--all", action="store_true", help="clang-tidy looks at every source, however long that takes")
    parser.add_argument("--seconds", type=float, default=180, help="time of clang-tidy otherwise, newest sources first")
    parser.add_argument("--xml", type=Path, help="JUnit file of the outcomes")
    arguments = parser.parse_args()
    unknown = set(arguments.parts) - set(PARTS)
    if unknown:
        parser.error(f"no such part: {', '.join(sorted(unknown))}")
    suite = ElementTree.Element("testsuite", name="lint")
    failed = False
    for name in arguments.parts or PARTS:
        start = time.monotonic()
        case = ElementTree.SubElement(suite, "testcase", classname="lint", name=name)
        try:
            problems, line = PARTS[name](arguments)
        except NotHere as reason:
            problems, line = [], f"skipped: {reason}"
            ElementTree.SubElement(case, "skipped", message=str(reason))
        if problems:
            ElementTree.SubElement(case, "failure", message="\n".join(problems))
            failed = True
        print("\n".join([*problems, f"lint {name}: {len(problems)} found; {line} ({time.monotonic() - start:.0f} s)"]),
              flush=True)
    if arguments.xml:
        arguments.xml.parent.mkdir(parents=True, exist_ok=True)
        ElementTree.ElementTree(suite).write(arguments.xml, encoding="utf-8", xml_declaration=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
