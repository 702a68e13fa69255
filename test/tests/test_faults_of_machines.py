"""Faults of disks and machines: full and read-only disks, clocks, other people's load, files that change meanwhile."""
import os
import random
import shutil
import subprocess
import sys
import threading
import time
import unittest

from faults import LONGEST_S, OUT, ROUNDS, put
from test_faults import BAG_READERS
from test_program_outputs import PROGRAMS, Programs, digest_of


def small_disk(test, options):
    """A file system of its own in `small`; skips where none can be had."""
    if os.geteuid() != 0:
        test.skipTest("a small file system needs root")
    os.makedirs(test.at("small"))
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", test.at("small")], check=False,
                             capture_output=True)
    if mounted.returncode:
        test.skipTest("no file system can be mounted here")
    test.addCleanup(subprocess.run, ["umount", test.at("small")], check=False)


class Machines(Programs):
    """Disks that are full or cannot be written, clocks that jump, other people's load, files that change meanwhile."""

    def commands(self):
        # Those two take long: test_program_outputs has full disks and signals for them.
        return {name: call for name, call in super().commands().items() if name not in ("evaluate", "diagnose")}

    def failed(self, name, run):
        """One line of an error, nothing left, nothing changed."""
        self.assertIn(run.returncode, (1, 2), msg=f"{name}: {run.stderr}")
        self.assertEqual(run.stderr.count("error: "), 1, msg=run.stderr)
        self.assertNotIn("std::", run.stderr)
        self.assertNotIn("unfinished", run.stderr)
        self.assertIn("small", run.stderr)
        self.assert_nothing_changed()

    def test_disks_that_fill_up_at_every_output(self):
        chance = random.Random(5)
        small_disk(self, "size=64k")
        for _ in range(ROUNDS):
            for name, (head, tail, mark) in self.commands().items():
                # Not a byte left, and as much as the result takes half of the way.
                for room in (0, chance.randrange(1, 9)):
                    filler = self.at("small", "filler")
                    with open(filler, "wb") as file:
                        file.write(bytes(65536 - 4096 * room))
                    self.before = digest_of(self.folder)
                    with self.subTest(program=name, room=4096 * room):
                        run = self.run_program(name, *head, "small/out", *tail)
                        if run.returncode in (0, 2) and os.path.lexists(self.at("small", "out")):
                            self.assertGreater(room, 0)
                            self.assertTrue(mark is None or os.path.exists(self.at("small", "out", mark)))
                            shutil.rmtree(self.at("small", "out")) if mark else os.remove(self.at("small", "out"))
                        else:
                            self.failed(name, run)
                    os.remove(filler)
                    self.assertEqual(os.listdir(self.at("small")), [])

    def test_a_full_place_for_temporary_files(self):
        small_disk(self, "size=8k")
        with open(self.at("small", "filler"), "wb") as file:
            file.write(bytes(8192))
        self.before = digest_of(self.folder)
        self.environment["TMPDIR"] = self.at("small")
        for name, words in BAG_READERS.items():
            with self.subTest(program=name):
                run = self.run_program(name, *words)
                if run.returncode != 0 or not run.stderr == "":     # some need no temporary file
                    self.assertIn(run.returncode, (0, 1, 2), msg=run.stderr)
                    self.assertNotIn("std::", run.stderr)
                if os.path.lexists(self.at("out")):
                    shutil.rmtree(self.at("out"))
                self.assert_nothing_changed()

    def test_disks_that_cannot_be_written(self):
        small_disk(self, "size=64k")
        subprocess.run(["mount", "-o", "remount,ro", self.at("small")], check=True)
        for name, (head, tail, _) in self.commands().items():
            for output in ("small/out", "small", "small/a/b/out"):
                with self.subTest(program=name, output=output):
                    run = self.run_program(name, *head, output, *tail)
                    self.assertEqual(run.returncode, 2, msg=run.stderr)
                    self.failed(name, run)

    def test_clocks_that_jump(self):
        faketime = shutil.which("faketime")
        if faketime is None:
            self.skipTest("faketime is not installed (Debian's package faketime)")
        whole = self.results(["process", "session", "--output", "out"])
        for clock in ("-30 years", "+30 years", "@2106-02-07 06:28:10", "@1970-01-01 00:00:05"):
            with self.subTest(clock=clock):
                run = subprocess.run([faketime, "-f", clock, PROGRAMS["process"], "session", "--output", "out"],
                                     cwd=self.folder, capture_output=True, text=True, check=False, timeout=LONGEST_S,
                                     env=self.environment)
                self.assertEqual(run.returncode, 0, msg=run.stderr)
                self.assertEqual(self.taken_away("out"), whole)

    def taken_away(self, name):
        """Digests of a result, which is removed."""
        digests = digest_of(self.at(name))
        shutil.rmtree(self.at(name))
        return digests

    def results(self, call):
        run = self.run_program(*call)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        return self.taken_away("out")

    def test_eight_programs_that_take_the_processor(self):
        calls = (["process", "session", *OUT], ["simulate", "session", *OUT], ["process", "session.bag", *OUT])
        alone = [self.results(call) for call in calls]
        hogs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(8)]
        try:
            for _ in range(ROUNDS):
                for call, whole in zip(calls, alone):
                    with self.subTest(program=call[0]):
                        self.assertEqual(self.results(call), whole)
        finally:
            for hog in hogs:
                hog.kill()
                hog.wait()

    def meshes(self):
        return [os.path.join(place, name) for place, _, names in os.walk(self.at("session")) for name in names
                if name.endswith(".obj")]

    def test_a_mesh_that_is_swapped_meanwhile(self):
        mesh = self.meshes()[0]
        call = ["simulate", "session", *OUT]
        with open(mesh, encoding="utf-8") as text:
            first = text.read()
        other = "".join("v " + " ".join(str(1.01 * float(value)) for value in line.split()[1:4]) + "\n"
                        if line.startswith("v ") else line for line in first.splitlines(keepends=True))
        samples = lambda digests: {name: digest for name, digest in digests.items() if name.startswith("captures")}
        begin = time.monotonic()
        of_first = samples(self.results(call))
        takes_s = time.monotonic() - begin
        put(os.path.relpath(mesh, self.folder), other)(self, None)
        of_other = samples(self.results(call))
        chance = random.Random(3)
        for round_ in range(5 * ROUNDS):
            old, new = ((first, of_first), (other, of_other))[::1 if round_ % 2 else -1]
            with open(mesh, "w", encoding="utf-8") as out:
                out.write(old[0])
            with open(mesh + ".new", "w", encoding="utf-8") as out:
                out.write(new[0])
            timer = threading.Timer(chance.uniform(0, takes_s), os.replace, (mesh + ".new", mesh))
            timer.start()
            with self.subTest(round=round_):
                self.assertIn(samples(self.results(call)), (of_first, of_other))
            timer.join()

    def test_a_capture_that_shrinks_meanwhile(self):
        chance = random.Random(4)
        whole = self.results(["process", "session", *OUT])
        for round_ in range(5 * ROUNDS):
            timer = threading.Timer(chance.uniform(0, 0.2), os.truncate, (self.at("session", "captures", "001.bin"), 100))
            timer.start()
            run = self.run_program("process", "session", *OUT)
            timer.join()
            with self.subTest(round=round_):
                self.assertIn(run.returncode, (0, 2), msg=run.stderr)
                made = self.taken_away("out") if os.path.exists(self.at("out")) else {}
                for name, digest in made.items():
                    self.assertEqual(whole[name], digest, "a map of half a capture")
                if run.returncode == 2:
                    self.assertIn("001", run.stderr)
            shutil.copy(os.path.join(self.made, "session", "captures", "001.bin"), self.at("session", "captures"))

    def test_what_a_killed_program_left_is_swept_by_the_next(self):
        chance = random.Random(6)
        for _ in range(ROUNDS):
            for name, words in BAG_READERS.items():
                if name == "validate":
                    continue
                for _try in range(4):
                    run = subprocess.Popen([PROGRAMS[name], *words], cwd=self.folder, stdout=subprocess.DEVNULL,
                                           stderr=subprocess.DEVNULL, env=self.environment)
                    time.sleep(chance.uniform(0, 0.4))
                    run.kill()
                    run.wait()
                # They are swept when they are a minute old, or from a clock that was set back.
                left = [os.path.join(self.temporary, entry) for entry in os.listdir(self.temporary)]
                left += [self.at(entry) for entry in os.listdir(self.folder) if entry.startswith(".")]
                for number, path in enumerate(left):
                    at = time.time() + (3600 if number % 2 else -3600)
                    os.utime(path, (at, at))
                shutil.rmtree(self.at("out"), ignore_errors=True)
                with self.subTest(program=name, left=len(left)):
                    run = self.run_program(name, *words)
                    self.assertIn(run.returncode, (0, 2), msg=run.stderr)
                    self.assertEqual([entry for entry in os.listdir(self.folder) if entry.startswith(".")], [])
                    self.assertEqual(os.listdir(self.temporary), [])
                shutil.rmtree(self.at("out"), ignore_errors=True)
        self.assert_nothing_changed()


if __name__ == "__main__":
    unittest.main()
