#!/usr/bin/env python3
"""Counts the test cases of a catkin test_results folder and closes with `N passed, N failed, N skipped`.

Cases are counted from the XML files: catkin_test_results counts a gtest twice and is content with no results at all.
What ctest ran is compared with them: a module that hung, crashed or left no case is a failed case of its own name.
The exit status is 0 only where something passed, nothing failed and ctest ended well.
"""
import argparse
import json
import os
import pathlib
import sys
import xml.etree.ElementTree as ElementTree


def cases_of(file):
    """Yields (name, outcome, message) for every test case of one JUnit file."""
    try:
        root = ElementTree.parse(file).getroot()
    except ElementTree.ParseError as error:
        yield f"{file.name}", "failed", f"unreadable result file: {error}"
        return
    for case in root.iter("testcase"):
        name = f"{case.get('classname', '')}.{case.get('name', '')}"
        problems = list(case.iter("failure")) + list(case.iter("error"))
        skipped = list(case.iter("skipped"))
        if problems:
            yield name, "failed", (problems[0].get("message") or problems[0].text or "").strip()
        elif skipped or case.get("result") == "skipped":
            reason = (skipped[0].get("message") or skipped[0].text or "") if skipped else ""
            yield name, "skipped", reason.strip() or "no reason given"
        elif case.get("status") == "notrun":
            yield name, "skipped", "disabled"
        else:
            yield name, "passed", ""


def modules_of(list_file, folder):
    """{module: result file or None} of what `ctest --show-only=json-v1` lists; its command names the file."""
    with open(list_file, encoding="utf-8") as text:
        tests = json.load(text)["tests"]
    return {test["name"]: next((pathlib.Path(word).resolve() for word in test.get("command", [])
                                if word.endswith(".xml") and folder in pathlib.Path(word).resolve().parents), None)
            for test in tests}


def endings_of(junit_file):
    """{module: "" or why it did not end well} of ctest's own JUnit file; empty where ctest left none."""
    try:
        root = ElementTree.parse(junit_file).getroot()
    except (OSError, ElementTree.ParseError):
        return {}
    endings = {}
    for case in root.iter("testcase"):
        problem = case.find("failure")
        if problem is None:
            problem = case.find("skipped")
        ended_well = case.get("status") == "run" and problem is None
        reason = None if problem is None else problem.get("message")
        endings[case.get("name")] = "" if ended_well else \
            reason or f"not passed after {float(case.get('time') or 0):.0f} s"
    return endings


def check_modules(modules, endings, cases):
    """Yields (name, message) of every module that ended badly without a failed case, or left no case at all."""
    for module, file in modules.items():
        outcomes = [outcome for _, outcome, _ in cases.get(file, [])]
        ending = endings.get(module)
        if ending is None:
            ending = "ctest does not say how it ended"
        if ending and "failed" not in outcomes:
            yield module, f"{ending}; {len(outcomes)} cases of it are on record" if outcomes else \
                f"{ending}; it left no results"
        elif not ending and not outcomes:
            yield module, "it left no results"


def main():
    """Prints what was skipped, what failed and the closing line; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", help="catkin's folder test_results")
    parser.add_argument("--list", help="what `ctest --show-only=json-v1` says")
    parser.add_argument("--ran", help="file of `ctest --output-junit`")
    parser.add_argument("--status", type=int, default=0, help="exit status of ctest")
    parser.add_argument("--step", action="append", default=[], metavar="NAME=STATUS",
                        help="a step beside ctest with its exit status, counted as one case; may be repeated")
    arguments = parser.parse_args()
    if (arguments.list is None) != (arguments.ran is None):
        parser.error("--list and --ran go together")
    if os.path.exists(arguments.results) and not os.path.isdir(arguments.results):
        parser.error(f"{arguments.results}: is no folder")
    for step in arguments.step:
        if "=" not in step:
            parser.error(f"--step {step}: wants NAME=STATUS")

    folder = pathlib.Path(arguments.results).resolve()
    outcomes = {"passed": [], "failed": [], "skipped": []}
    recorded = {}
    for file in sorted(folder.rglob("*.xml")):
        cases = recorded[file] = list(cases_of(file))
        # rostest writes one case per test node beside the node's own file with its real cases.
        if file.name.startswith("rostest-"):
            cases = [case for case in cases if case[1] == "failed"]
        for name, outcome, message in cases:
            outcomes[outcome].append((file.parent.name, name, message))
    if arguments.list is not None:
        try:
            modules = modules_of(arguments.list, folder)
        except (OSError, ValueError, KeyError, TypeError) as error:
            parser.error(f"{arguments.list}: is no list of ctest ({error!r})")
        for name, message in check_modules(modules, endings_of(arguments.ran), recorded):
            outcomes["failed"].append(("ctest", name, message))
    if arguments.status != 0 and not outcomes["failed"]:
        outcomes["failed"].append(("ctest", "itself", f"it ended with status {arguments.status}"))
    for step in arguments.step:
        name, status = step.rsplit("=", 1)
        outcomes["passed" if status == "0" else "failed"].append(("step", name, f"it ended with status {status}"))
    for outcome in ("skipped", "failed"):
        for package, name, message in outcomes[outcome]:
            print(f"{outcome}: {package} {name}: {' '.join(message.split())[:600]}")
    print(f"{len(outcomes['passed'])} passed, {len(outcomes['failed'])} failed, {len(outcomes['skipped'])} skipped")
    return 0 if outcomes["passed"] and not outcomes["failed"] else 1


if __name__ == "__main__":
    sys.exit(main())
