#!/usr/bin/env python3
"""Runs Python unit tests and writes JUnit XML, one testcase per test, skips with their reasons."""
import argparse
import os
import sys
import time
import unittest
from xml.etree import ElementTree

HERE = os.path.dirname(os.path.realpath(__file__))


class Recorder(unittest.TextTestResult):
    """Keeps outcome and duration of every test."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.rows = {}
        self._start = 0.0

    def startTest(self, test):
        super().startTest(test)
        self._start = time.time()
        self.rows[test.id()] = ["passed", "", 0.0]

    def stopTest(self, test):
        super().stopTest(test)
        if test.id() in self.rows:
            self.rows[test.id()][2] = time.time() - self._start

    def _note(self, test, kind, text):
        self.rows.setdefault(test.id(), [kind, "", 0.0])[:2] = [kind, text]

    def addFailure(self, test, err):
        super().addFailure(test, err)
        self._note(test, "failure", self.failures[-1][1])

    def addError(self, test, err):
        super().addError(test, err)
        self._note(test, "error", self.errors[-1][1])

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self._note(test, "skipped", reason)

    def addSubTest(self, test, subtest, err):
        super().addSubTest(test, subtest, err)
        if err is not None:
            self._note(test, "failure", f"{subtest}: {err[1]}")


def write_junit(rows, suite, file):
    """JUnit XML of the recorded rows."""
    kinds = [r[0] for r in rows.values()]
    root = ElementTree.Element("testsuite", name=suite, tests=str(len(rows)), failures=str(kinds.count("failure")),
                               errors=str(kinds.count("error")), skipped=str(kinds.count("skipped")))
    for name, (kind, text, seconds) in rows.items():
        owner, _, short = name.rpartition(".")
        case = ElementTree.SubElement(root, "testcase", classname=owner, name=short, time=f"{seconds:.3f}")
        if kind != "passed":
            ElementTree.SubElement(case, kind, message=text.splitlines()[-1] if text else "").text = text
    os.makedirs(os.path.dirname(os.path.abspath(file)), exist_ok=True)
    ElementTree.ElementTree(root).write(file, encoding="utf-8", xml_declaration=True)


def main():
    """Entry point; status 1 where a test failed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--xml", help="JUnit file to write")
    parser.add_argument("modules", nargs="+")
    arguments = parser.parse_args()
    sys.path[:0] = [HERE, os.path.join(HERE, "..", "src")]
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    suite = unittest.TestSuite(unittest.defaultTestLoader.loadTestsFromName(m) for m in arguments.modules)
    result = unittest.TextTestRunner(resultclass=Recorder, verbosity=1).run(suite)
    if arguments.xml:
        write_junit(result.rows, "mmradartwin_tests." + "_".join(arguments.modules), arguments.xml)
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
