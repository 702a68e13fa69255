"""What summarise_results says of a run of ctest: nothing that failed, hung, crashed or left nothing is lost."""
import json
import os
import shutil
import subprocess
import sys
import unittest

from in_folder import InFolder

HERE = os.path.dirname(os.path.realpath(__file__))
SUMMARISE = os.path.join(HERE, "..", "summarise_results.py")
MODULES = {
    "passing": "def test_it(self): pass",
    "failing": "def test_it(self): self.fail('as made')",
    "skipping": "@unittest.skip('as made')\n    def test_it(self): pass",
    "hanging": "def test_it(self): time.sleep(600)",
    "crashing": "def test_it(self): os.abort()",
    "empty": "pass",
}


class Summary(InFolder):
    """Result folders and ctest projects made for the purpose."""

    def write(self, name, text):
        file = self.at(name)
        os.makedirs(os.path.dirname(file), exist_ok=True)
        with open(file, "w", encoding="utf-8") as out:
            out.write(text)
        return file

    def summarise(self, *arguments):
        """(exit status, lines) of the program."""
        run = subprocess.run([sys.executable, SUMMARISE, self.at("results"), *arguments], capture_output=True,
                             text=True, check=False, timeout=60)
        self.assertEqual(run.stderr, "")
        return run.returncode, run.stdout.splitlines()

    def write_suite(self, name, *cases):
        self.write(os.path.join("results", "package", name + ".xml"),
                   "<testsuite>" + "".join(f'<testcase classname="{name}" name="case_{i}">{case}</testcase>'
                                           for i, case in enumerate(cases)) + "</testsuite>")


class MadeFolders(Summary):
    def test_cases_are_counted_and_named(self):
        self.write_suite("good", "", "", '<skipped message="no data"/>')
        self.write_suite("bad", "", '<failure message="1 is not 2"/>', '<error message="no such file"/>')
        status, lines = self.summarise()
        self.assertEqual(status, 1)
        self.assertEqual(lines, ["skipped: package good.case_2: no data", "failed: package bad.case_1: 1 is not 2",
                                 "failed: package bad.case_2: no such file", "3 passed, 2 failed, 1 skipped"])

    def test_a_node_of_rostest_is_counted_once(self):
        self.write_suite("rostest-node", "")
        self.write_suite("node", "", "")
        self.assertEqual(self.summarise(), (0, ["2 passed, 0 failed, 0 skipped"]))

    def test_a_file_that_is_cut_off_has_failed(self):
        self.write_suite("good", "")
        self.write("results/package/cut.xml", "<testsuite><testcase")
        status, lines = self.summarise()
        self.assertEqual(status, 1)
        self.assertRegex(lines[0], "^failed: package cut.xml: unreadable result file")
        self.assertEqual(lines[-1], "1 passed, 1 failed, 0 skipped")

    def test_nothing_at_all_is_no_success(self):
        self.assertEqual(self.summarise(), (1, ["0 passed, 0 failed, 0 skipped"]))

    def test_ctests_own_status_counts(self):
        self.write_suite("good", "")
        self.assertEqual(self.summarise("--status", "8"),
                         (1, ["failed: ctest itself: it ended with status 8", "1 passed, 1 failed, 0 skipped"]))

    def test_a_step_beside_ctest_is_a_case(self):
        self.write_suite("good", "")
        self.assertEqual(self.summarise("--step", "core=0"), (0, ["2 passed, 0 failed, 0 skipped"]))
        self.assertEqual(self.summarise("--step", "core=2", "--step", "other=0"),
                         (1, ["failed: step core: it ended with status 2", "2 passed, 1 failed, 0 skipped"]))


@unittest.skipIf(shutil.which("ctest") is None, "ctest is not here")
class RealRun(Summary):
    """ctest on modules that end in every way; each runs as the project's own Python tests do."""

    def run_ctest(self, *modules):
        """Writes the modules and runs them; arguments for the program."""
        tests = []
        for name in modules:
            self.write(os.path.join("modules", name + ".py"),
                       f"import os, time, unittest\n\n\nclass Case(unittest.TestCase):\n    {MODULES[name]}\n")
            xml = self.at("results", "package", f"unittest-{name}.xml")
            tests.append(f'add_test({name} "{sys.executable}" "{HERE}/run_unittests.py" "--xml" "{xml}" "{name}")\n'
                         f'set_tests_properties({name} PROPERTIES TIMEOUT 2)\n')
        self.write("CTestTestfile.cmake", "".join(tests))
        os.makedirs(self.at("results"), exist_ok=True)
        listed = subprocess.run(["ctest", "--show-only=json-v1"], cwd=self.folder, check=True, capture_output=True,
                                text=True, timeout=60).stdout
        environment = dict(os.environ, PYTHONPATH=self.at("modules") + os.pathsep + os.environ.get("PYTHONPATH", ""))
        run = subprocess.run(["ctest", "-j2", "--output-junit", self.at("ctest.xml")], cwd=self.folder, check=False,
                             capture_output=True, env=environment, timeout=120)
        return ["--list", self.write("list.json", listed), "--ran", self.at("ctest.xml"), "--status",
                str(run.returncode)]

    def test_what_hangs_crashes_or_leaves_nothing_has_failed_by_name(self):
        status, lines = self.summarise(*self.run_ctest(*MODULES))
        self.assertEqual(status, 1)
        self.assertEqual(lines[-1], "1 passed, 4 failed, 1 skipped")
        failed = {line.split(":")[1].split()[-1]: line for line in lines if line.startswith("failed")}
        self.assertEqual(set(failed), {"failing.Case.test_it", "hanging", "crashing", "empty"})
        self.assertIn("after 2 s", failed["hanging"])
        self.assertIn("left no results", failed["hanging"])
        self.assertIn("left no results", failed["crashing"])
        self.assertIn("as made", failed["failing.Case.test_it"])

    def test_a_run_in_which_all_is_well_ends_well(self):
        self.assertEqual(self.summarise(*self.run_ctest("passing")), (0, ["1 passed, 0 failed, 0 skipped"]))

    def test_every_module_has_failed_where_ctest_itself_was_killed(self):
        arguments = self.run_ctest("passing", "skipping")
        os.remove(self.at("ctest.xml"))
        os.remove(self.at("results", "package", "unittest-skipping.xml"))
        status, lines = self.summarise(*arguments[:-1], "137")
        self.assertEqual(status, 1)
        self.assertEqual(lines[-1], "1 passed, 2 failed, 0 skipped")
        self.assertIn("failed: ctest skipping: ctest does not say how it ended; it left no results", lines)

    def test_a_module_that_ends_badly_after_its_cases_have_passed_has_failed(self):
        arguments = self.run_ctest("passing")
        with open(self.at("list.json"), encoding="utf-8") as text:
            self.assertEqual(json.load(text)["tests"][0]["name"], "passing")
        self.write("ctest.xml", '<testsuite><testcase name="passing" status="fail"><failure message="SEGFAULT"/>'
                                "</testcase></testsuite>")
        status, lines = self.summarise(*arguments[:-1], "8")
        self.assertEqual(status, 1)
        self.assertEqual(lines, ["failed: ctest passing: SEGFAULT; 1 cases of it are on record",
                                 "1 passed, 1 failed, 0 skipped"])


if __name__ == "__main__":
    unittest.main()
