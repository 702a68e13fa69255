#!/usr/bin/env python3
"""Counts the test cases of a catkin test_results folder and closes with `N passed, N failed, N skipped`.

catkin_test_results counts a gtest twice and is content with no results at all, so cases are counted from the XML files.
Exit status 0 only where something passed and nothing failed.
"""
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


def main():
    folder = pathlib.Path(sys.argv[1])
    outcomes = {"passed": [], "failed": [], "skipped": []}
    for file in sorted(folder.rglob("*.xml")):
        cases = list(cases_of(file))
        # rostest writes one case per test node beside the node's own file with its real cases.
        if file.name.startswith("rostest-"):
            cases = [case for case in cases if case[1] == "failed"]
        for name, outcome, message in cases:
            outcomes[outcome].append((file.parent.name, name, message))
    for outcome in ("skipped", "failed"):
        for package, name, message in outcomes[outcome]:
            print(f"{outcome}: {package} {name}: {' '.join(message.split())[:600]}")
    print(f"{len(outcomes['passed'])} passed, {len(outcomes['failed'])} failed, {len(outcomes['skipped'])} skipped")
    return 0 if outcomes["passed"] and not outcomes["failed"] else 1


if __name__ == "__main__":
    sys.exit(main())
