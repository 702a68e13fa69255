"""What the offline programs write, and what they leave alone: inputs, older results, and nothing half done."""
import glob
import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

from card_packets import packets, pcap
from chosen_sessions import RUN
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from in_folder import InFolder

PACKAGES = {"process": "mmradartwin_dsp", "validate": "mmradartwin_dsp", "session_to_bag": "mmradartwin_dsp",
            "bag_to_session": "mmradartwin_dsp", "import_settings": "mmradartwin_dsp", "simulate": "mmradartwin_sim",
            "make_scene": "mmradartwin_sim", "evaluate": "mmradartwin_attribution",
            "diagnose": "mmradartwin_attribution", "calibrate": "mmradartwin_attribution",
            "refine_scene": "mmradartwin_attribution",
            "pcap_to_capture": "mmradartwin_driver", "replay_packets": "mmradartwin_driver", "doctor": "mmradartwin_driver",
            "configure_radar": "mmradartwin_driver", "dca1000_emulator": "mmradartwin_driver",
            "emulated_rig": "mmradartwin_driver", "awr2243_emulator": "mmradartwin_driver"}
PROGRAMS = {name: find_program(package, name) for name, package in PACKAGES.items()}
PATIENCE_S = 300


def digest_of(folder):
    """{path: sha256} of all files below a folder."""
    digests = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(place, name)
            with open(path, "rb") as file:
                digests[os.path.relpath(path, folder)] = hashlib.sha256(file.read()).hexdigest()
    return digests


@unittest.skipIf(None in PROGRAMS.values(), "the offline programs are not built in this workspace")
class Programs(InFolder):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.made = folder.name
        Measurement(Settings(output=os.path.join(cls.made, "session"), seed=7, poses=3, frames=2)).run()
        subprocess.run([PROGRAMS["session_to_bag"], "session", "session.bag"], cwd=cls.made, check=True,
                       capture_output=True, timeout=PATIENCE_S)
        with open(os.path.join(cls.made, "profile.cfg"), "w", encoding="ascii") as out:
            out.write("channelCfg 15 3 0\nadcCfg 2 1\nprofileCfg 0 77 7 6 40 0 0 75 1 64 5000 0 0 30\n"
                      "chirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 0 0 0 0 0 2\nframeCfg 0 1 1 0 50 1 0\n"
                      "lvdsStreamCfg -1 0 1 0\n")
        with open(os.path.join(cls.made, "packets.pcap"), "wb") as out:
            out.write(pcap(packets(400)))

    def setUp(self):
        super().setUp()
        shutil.copytree(self.made, self.folder, dirs_exist_ok=True)
        self.before = digest_of(self.folder)
        # A place for temporary folders of its own: other tests run beside this one.
        self.temporary = self.enterContext(tempfile.TemporaryDirectory())
        self.environment = {**os.environ, "TMPDIR": self.temporary}

    def run_program(self, name, *arguments, **more):
        return subprocess.run([PROGRAMS[name], *arguments], cwd=self.folder, capture_output=True, text=True,
                              check=False, timeout=PATIENCE_S, stdin=subprocess.DEVNULL, env=self.environment, **more)

    def commands(self):
        """{program: (arguments before the output, after it, a file or folder that its result has)}."""
        mesh = glob.glob(self.at("session", "**", "*.obj"), recursive=True)[0]
        return {
            "process": (["session", "--output"], [], "maps"),
            "simulate": (["session", "--output"], [], "session.yaml"),
            "evaluate": (["session", "--no-pictures", "--output"], [], "report.html"),
            "diagnose": (["session", "--findings", "0", "--output"], [], "findings.json"),
            "refine_scene": (["session", "--output"], [], "refinement.yaml"),
            "bag_to_session": (["session.bag"], [], "session.yaml"),
            "make_scene": ([mesh, "--output"], [], "scene.yaml"),
            "session_to_bag": (["session"], [], None),
            "import_settings": (["profile.cfg", "--device", "xwr1843", "--output"], [], None),
            "pcap_to_capture": (["packets.pcap", "--radar", "session/radar.yaml", "--output"], [], None),
        }

    def assert_nothing_changed(self):
        self.assertEqual(digest_of(self.folder), self.before)
        self.assertEqual(os.listdir(self.temporary), [])

    def assert_refused(self, run, *words):
        """One line, status 2, all as it was."""
        self.assertEqual(run.returncode, 2, msg=run.stderr)
        lines = [line for line in run.stderr.splitlines() if not line.startswith("note: ")]
        self.assertEqual(len(lines), 1, msg=run.stderr)
        self.assertTrue(lines[0].startswith("error: "), msg=lines)
        self.assertEqual(run.stdout, "")
        for word in words:
            self.assertIn(word, lines[0])
        self.assert_nothing_changed()


class Outputs(Programs):
    """Every program with every output that is an input or exists."""

    def test_an_input_is_never_an_output(self):
        os.symlink("session", self.at("link"))
        os.link(self.at("session.bag"), self.at("hard.bag"))
        os.makedirs(self.at("around"))
        self.before = digest_of(self.folder)
        for name, (head, tail, mark) in self.commands().items():
            taken = ["session", "link", "session/session.yaml", "session/captures", "session/poses.csv",
                     "session/captures/001.bin", ".", "session.bag", "hard.bag", "profile.cfg", "packets.pcap",
                     "session/radar.yaml"]
            for output in taken:
                for force in ([], ["--force"]):
                    if output == "." and mark is None:
                        continue
                    with self.subTest(program=name, output=output, force=force):
                        run = self.run_program(name, *head, output, *tail, *force)
                        if force and run.returncode in (0, 1):      # no input of this program
                            self.assertIn((name, output), FREE)
                            shutil.copytree(self.made, self.folder, dirs_exist_ok=True)
                            self.restore_links()
                            continue
                        self.assertEqual(run.returncode, 2, msg=run.stderr)
                        self.assertEqual(run.stderr.count("error: "), 1, msg=run.stderr)
                        self.assert_nothing_changed()

    def restore_links(self):
        os.remove(self.at("hard.bag"))
        os.link(self.at("session.bag"), self.at("hard.bag"))
        self.assertEqual(digest_of(self.folder), self.before)

    def test_what_exists_stays_without_force_and_is_replaced_as_a_whole_with_it(self):
        for name, (head, tail, mark) in self.commands().items():
            with self.subTest(program=name):
                run = self.run_program(name, *head, "out", *tail)
                self.assertIn(run.returncode, (0, 2), msg=run.stderr)
                self.assertTrue(os.path.exists(self.at("out", mark) if mark else self.at("out")), msg=run.stderr)
                if mark:
                    with open(self.at("out", "of_the_first_run"), "w", encoding="ascii") as out:
                        out.write("stale")
                first, self.before = self.before, digest_of(self.folder)
                self.assert_refused(self.run_program(name, *head, "out", *tail), "out", "--force")
                run = self.run_program(name, *head, "out", *tail, "--force")
                self.assertIn(run.returncode, (0, 2), msg=run.stderr)
                self.assertFalse(os.path.exists(self.at("out", "of_the_first_run")), msg=name)
                shutil.rmtree(self.at("out")) if mark else os.remove(self.at("out"))
                self.before = first
                self.assert_nothing_changed()

    def test_a_folder_of_something_else_is_not_replaced(self):
        os.makedirs(self.at("photos"))
        with open(self.at("photos", "cat.jpg"), "w", encoding="ascii") as out:
            out.write("cat")
        self.before = digest_of(self.folder)
        for name, (head, tail, _) in self.commands().items():
            with self.subTest(program=name):
                self.assert_refused(self.run_program(name, *head, "photos", *tail, "--force"), "photos")

    def test_a_full_disk_leaves_nothing(self):
        if os.geteuid() != 0:
            self.skipTest("a small file system needs root")
        os.makedirs(self.at("small"))
        mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=16k", "tmpfs", self.at("small")], check=False,
                                 capture_output=True)
        if mounted.returncode:
            self.skipTest("no file system can be mounted here")
        self.addCleanup(subprocess.run, ["umount", self.at("small")], check=False)
        for name in ("session_to_bag", "process", "simulate", "bag_to_session", "evaluate"):
            head, tail, _ = self.commands()[name]
            with self.subTest(program=name):
                run = self.run_program(name, *head, "small/out", *tail)
                self.assertIn(run.returncode, (1, 2), msg=run.stderr)
                self.assertEqual(run.stderr.count("error: "), 1, msg=run.stderr)
                self.assertNotIn("unfinished", run.stderr)
                self.assert_nothing_changed()

    def test_a_mount_point_takes_results(self):
        if os.geteuid() != 0:
            self.skipTest("a file system of its own needs root")
        os.makedirs(self.at("disk"))
        mounted = subprocess.run(["mount", "-t", "tmpfs", "tmpfs", self.at("disk")], check=False, capture_output=True)
        if mounted.returncode:
            self.skipTest("no file system can be mounted here")
        self.addCleanup(subprocess.run, ["umount", self.at("disk")], check=False)
        for force in ([], ["--force"]):
            run = self.run_program("process", "session", "--output", "disk", *force)
            self.assertEqual(run.returncode, 0, msg=run.stderr)
            self.assertEqual(sorted(os.listdir(self.at("disk"))), ["maps", "pictures"])

    def test_results_of_a_bag_stand_alone(self):
        run = self.run_program("evaluate", "session.bag", "--no-pictures", "--no-bag", "--output", "report")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        run = self.run_program("evaluate", "session", "--twin", "report/twin.yaml", "--no-pictures", "--output", "again")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        run = self.run_program("simulate", "session.bag", "--output", "simulated")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        shutil.move(self.at("simulated"), self.at("moved"))
        run = self.run_program("simulate", "moved", "--twin", "moved/twin.resolved.yaml", "--output", "twice")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        for place, _, names in os.walk(self.at("report")):
            for name in names:
                with open(os.path.join(place, name), "rb") as file:
                    self.assertNotIn(b"mmradartwin_tmp_", file.read(), msg=name)
        self.assertEqual(os.listdir(self.temporary), [])

    def test_a_damaged_session_is_written_and_said(self):
        os.remove(self.at("session", "captures", "001.bin"))
        run = self.run_program("session_to_bag", "session", "short.bag")
        self.assertEqual(run.returncode, 2, msg=run.stderr)
        self.assertIn("001.bin", run.stderr)
        self.assertTrue(os.path.exists(self.at("short.bag")))


# Outputs that a program does not read, so that --force may replace them: (program, output).
FREE = {("session_to_bag", "session.bag"), ("session_to_bag", "hard.bag"), ("session_to_bag", "profile.cfg"),
        ("import_settings", "session.bag"), ("import_settings", "hard.bag"),
        ("import_settings", "session/session.yaml"), ("import_settings", "session/poses.csv"),
        ("import_settings", "session/captures/001.bin"), ("import_settings", "session/radar.yaml"),
        ("import_settings", "packets.pcap"), ("session_to_bag", "packets.pcap"),
        *(("pcap_to_capture", output) for output in ("session/session.yaml", "session/poses.csv",
                                                     "session/captures/001.bin", "session.bag", "hard.bag", "profile.cfg")),
        ("make_scene", "session"), ("bag_to_session", "session"), ("bag_to_session", "link")}


class Interrupted(Programs):
    """Every program with every output, ended by a signal at a time that is drawn: what was there stays, and what is there
    afterwards is whole."""
    INPUTS = ("session", "session.bag", "profile.cfg", "packets.pcap", "session/radar.yaml", "session/captures/001.bin")
    ROUNDS = 20 if RUN else 1

    def remove(self, name):
        shutil.rmtree(self.at(name)) if os.path.isdir(self.at(name)) else os.remove(self.at(name))

    def interrupted(self, call, number, after_s):
        """Exit status of a program that gets the signal after so long; where it ends earlier, its own."""
        with open(self.temporary + ".log", "w", encoding="utf-8") as log:
            run = subprocess.Popen([PROGRAMS[call[0]], *call[1:]], cwd=self.folder, stdout=log, stderr=log,
                                   stdin=subprocess.DEVNULL, env=self.environment)
            try:
                run.wait(timeout=after_s)
            except subprocess.TimeoutExpired:
                run.send_signal(number)
            status = run.wait(timeout=PATIENCE_S)
        os.remove(self.temporary + ".log")
        return status

    def assert_whole_or_as_before(self, before, status, number, mark):
        """The output is the older one, or a new one that is complete; nothing else has changed."""
        now = digest_of(self.folder)
        of_output, older = ({name: digest for name, digest in files.items() if name == "out" or name.startswith("out/")}
                            for files in (now, before))
        beside, were_beside = ({name: digest for name, digest in files.items() if name not in outputs}
                               for files, outputs in ((now, of_output), (before, older)))
        self.assertEqual(beside, were_beside, "a file beside the output came or changed")
        if of_output != older:      # it was faster than the signal, or at it
            self.assertNotIn("out/of_the_first_run", of_output)
            self.assertIn(status, (0, 2, -number))
            self.assertTrue(os.path.exists(self.at("out", mark) if mark else self.at("out")))
        self.assertEqual(os.listdir(self.temporary), [])
        self.assertEqual([name for name in os.listdir(self.folder) if name.startswith(".")], [])

    def test_at_any_time(self):
        chance = random.Random(11)
        for name, (head, tail, mark) in self.commands().items():
            begin = time.monotonic()
            run = self.run_program(name, *head, "out", *tail)
            takes_s = time.monotonic() - begin
            self.assertIn(run.returncode, (0, 2), msg=run.stderr)
            older = self.enterContext(tempfile.TemporaryDirectory())
            if mark:
                with open(self.at("out", "of_the_first_run"), "w", encoding="ascii") as out:
                    out.write("stale")
            shutil.move(self.at("out"), os.path.join(older, "out"))
            for _ in range(self.ROUNDS):
                for number in (signal.SIGINT, signal.SIGTERM):
                    for kind in ("new", "exists", *self.INPUTS):
                        after_s = chance.uniform(0, 1.1 * takes_s)
                        with self.subTest(program=name, output=kind, signal=number, after_s=after_s):
                            if kind == "exists":
                                copy = shutil.copytree if mark else shutil.copy
                                copy(os.path.join(older, "out"), self.at("out"))
                            if (name, kind) in FREE:
                                continue
                            before = digest_of(self.folder)
                            output = "out" if kind in ("new", "exists") else kind
                            force = [] if kind == "new" else ["--force"]
                            status = self.interrupted([name, *head, output, *tail, *force], number, after_s)
                            self.assert_whole_or_as_before(before, status, number, mark)
                            if output != "out":
                                self.assertEqual(digest_of(self.folder), before)
                            if os.path.lexists(self.at("out")):
                                self.remove("out")
            self.assert_nothing_changed()


class Manner(Programs):
    """What all programs have in common."""

    def test_help_version_and_usage(self):
        for name in PROGRAMS:
            with self.subTest(program=name):
                run = self.run_program(name, "--help")
                self.assertEqual((run.returncode, run.stderr), (0, ""))
                self.assertIn(f"Usage: {name} ", run.stdout)
                self.assertIn("Example", run.stdout)
                for option in ("--version", "--quiet"):
                    self.assertIn(option, run.stdout)
                run = self.run_program(name, "--version")
                self.assertEqual((run.returncode, run.stderr), (0, ""))
                self.assertRegex(run.stdout, rf"^{name} \d+\.\d+\.\d+")

    def test_an_unknown_option_is_told_first(self):
        for name in PROGRAMS:
            with self.subTest(program=name):
                self.assert_refused(self.run_program(name, "--quite"), "--quite", "did you mean '--quiet'")
                self.assert_refused(self.run_program(name, "--nothing-of-the-kind=3"), "--nothing-of-the-kind")

    def test_what_follows_a_command_is_the_commands_own(self):
        run = self.run_program("awr2243_emulator", PROGRAMS["validate"], "session", "--no-such-option")
        self.assert_refused(run, "--no-such-option")
        self.assertIn("Usage: validate ", self.run_program("awr2243_emulator", PROGRAMS["validate"], "--help").stdout)
        run = self.run_program("awr2243_emulator", "--quiet", PROGRAMS["validate"], "--version")
        self.assertRegex(run.stdout, r"^validate \d+\.\d+\.\d+")
        self.assert_refused(self.run_program("awr2243_emulator"), "no command")
        self.assert_refused(self.run_program("awr2243_emulator", "--", "no_such_program"), "no_such_program")

    def test_pipes_and_devices_are_refused_at_once(self):
        os.mkfifo(self.at("pipe"))
        self.addCleanup(os.remove, self.at("pipe"))
        os.mkdir(self.at("piped"))
        out = ["--output", "out"]
        calls = {"process": ["{}", *out], "evaluate": ["{}", *out], "diagnose": ["{}", *out], "simulate": ["{}", *out],
                 "refine_scene": ["{}", *out], "calibrate": ["{}", "--wall", "w", *out], "validate": ["{}"],
                 "bag_to_session": ["{}", "out"],
                 "session_to_bag": ["{}", "out"], "import_settings": ["{}", *out], "make_scene": ["{}", *out],
                 "pcap_to_capture": ["{}", "--radar", "session/radar.yaml", *out], "replay_packets": ["{}"],
                 "configure_radar": ["{}", "--check"], "dca1000_emulator": ["{}", "--radar", "session/radar.yaml"],
                 "doctor": ["--radar", "{}", "--no-usb"], "emulated_rig": ["{}", "--loopback"]}
        self.before = {name: digest for name, digest in digest_of_files(self.folder).items()}
        for name, call in calls.items():
            for input_ in ("pipe", "/dev/zero"):
                with self.subTest(program=name, input=input_):
                    begin = time.monotonic()
                    run = self.run_program(name, *(word.format(input_) for word in call))
                    self.assertEqual(run.returncode, 2, msg=run.stderr)
                    self.assertEqual(run.stderr.count("\n"), 1, msg=run.stderr)
                    self.assertIn(input_, run.stderr)
                    self.assertLess(time.monotonic() - begin, 60)
                    self.assertFalse(os.path.exists(self.at("out")))
        self.assertEqual(digest_of_files(self.folder), self.before)

    def test_pipes_that_a_mesh_names_are_refused_at_once(self):
        os.mkfifo(self.at("pipe"))
        self.addCleanup(os.remove, self.at("pipe"))
        triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
        gltf = {"asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "scene": 0,
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                               "min": [0, 0, 0], "max": [1, 1, 0]}],
                "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"uri": "pipe", "byteLength": 36}]}
        for name, text in (("room.obj", "mtllib pipe\no a\nusemtl Metal\n" + triangle), ("room.gltf", json.dumps(gltf))):
            with open(self.at(name), "w", encoding="ascii") as mesh:
                mesh.write(text)
            with self.subTest(mesh=name):
                run = self.run_program("make_scene", name, "--output", "out")
                self.assertEqual((run.returncode, run.stderr.count("\n")), (2, 1), msg=run.stderr)
                self.assertIn(f"error: {name}: names ", run.stderr)
                self.assertIn("pipe: is a pipe and no file", run.stderr)
                self.assertFalse(os.path.exists(self.at("out")))

    def test_results_go_to_stdout_and_a_log_holds_no_progress(self):
        run = self.run_program("process", "session", "--output", "out")
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        self.assertIn("3 map(s) in out/maps", run.stdout)
        run = self.run_program("simulate", "session", "--output", "simulated")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        self.assertIn("note: thermal noise", run.stderr)
        self.assertNotIn("\r", run.stderr)
        run = self.run_program("simulate", "session", "--output", "simulated", "--force", "--quiet")
        self.assertEqual((run.returncode, run.stderr), (0, ""))

    def test_a_recording_is_known_by_its_bytes(self):
        shutil.copy(self.at("session.bag"), self.at("lab.bag.active"))
        shutil.copy(self.at("session.bag"), self.at("no_extension"))
        shutil.copy(self.at("session", "captures", "001.bin"), self.at("capture.dat"))
        for number, recording in enumerate(("session", "session/session.yaml", "lab.bag.active", "no_extension")):
            for name in ("process", "simulate"):
                with self.subTest(program=name, recording=recording):
                    run = self.run_program(name, recording, "--output", f"{name}{number}")
                    self.assertEqual(run.returncode, 0, msg=run.stderr)
        run = self.run_program("process", "capture.dat", "--radar", "session/radar.yaml", "--output", "bare")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        for file, word in (("profile.cfg", "text"), (PROGRAMS["process"], "ELF")):
            run = self.run_program("process", file, "--output", "none")
            self.assertEqual(run.returncode, 2)
            self.assertIn(word, run.stderr)

    def test_bad_calls(self):
        """Ten of each program: one line, status 2, nothing left behind."""
        for name, (head, tail, _) in self.commands().items():
            good = [*head, "out", *tail]
            for call in ([], ["nowhere", *good[1:]], [*good, "--radar"], [*good, "--no-such"], [*good, "--jobs", "-3"],
                         [*good[:-1], ""] if good[-1] == "out" else ["--output", ""], ["session.bag/x", *good[1:]],
                         ["profile.cfg/", *good[1:]], [*good, "--quiet=perhaps"], ["/dev/null", *good[1:]]):
                with self.subTest(program=name, call=call):
                    self.assert_refused(self.run_program(name, *call))


class OnePlace(Programs):
    def call(self, *at, **options):
        more = [word for key, value in options.items() for word in ("--" + key, value)]
        return self.run_program("simulate", "--at", *map(str, at), "--scene", "session/scene.yaml", "--radar",
                                "session/radar.yaml", "--output", "place", *more)

    def place(self):
        """A radar's place in the session."""
        with open(self.at("session", "poses.csv"), encoding="ascii") as text:
            row = text.read().splitlines()[1].split(",")
        return [float(value) for value in row[3:6]]

    def test_pictures_and_tables(self):
        run = self.call(*self.place(), 30)
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        self.assertEqual(sorted(os.listdir(self.at("place"))), ["map.csv", "map.png", "paths.csv", "place.yaml", "room.png"])
        with open(self.at("place", "map.csv"), encoding="ascii") as text:
            self.assertEqual(text.readline(), "range_m,azimuth_deg,power_db\n")
        with open(self.at("place", "paths.csv"), encoding="ascii") as text:
            self.assertGreater(len(text.read().splitlines()), 10)
        for name in ("map.png", "room.png"):
            with open(self.at("place", name), "rb") as picture:
                self.assertEqual(picture.read(4), b"\x89PNG")

    def test_a_place_is_needed_whole(self):
        self.assert_refused(self.call(1, 2, 3), "--at")
        self.assert_refused(self.run_program("simulate", "--at", "1", "2", "1", "0", "--output", "o"), "--scene")
        self.assert_refused(self.call("nan", 2, 1, 0), "--at")
        self.assert_refused(self.call(1e5, 2, 1, 0), "outside the scene")

    def test_every_mechanism_can_be_copied(self):
        run = self.run_program("simulate", "--mechanisms")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        names = [line.split()[0] for line in run.stdout.splitlines()[:-1]]
        self.assertGreater(len(names), 40)
        self.assertEqual(names, sorted(names))
        run = self.run_program("simulate", "--mechanisms", "excess_attenuation")
        self.assertIn("db_per_m", run.stdout)
        self.assertIn("dB/m, -20 to 20", run.stdout)
        with open(self.at("twin.yaml"), "w", encoding="ascii") as twin:
            twin.write("scene: session/scene.yaml\nmechanisms:\n  specular: {max_bounces: 3}\n" +
                       run.stdout.splitlines()[-1] + "\n")
        run = self.run_program("simulate", "session", "--twin", "twin.yaml", "--output", "simulated")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        self.before = digest_of(self.folder)
        self.assert_refused(self.run_program("simulate", "--mechanisms", "exces_attenuation"),
                            "did you mean 'excess_attenuation'")


class Duplicates(Programs):
    def test_poses_a_centimetre_apart(self):
        file = self.at("session", "poses.csv")
        with open(file, encoding="ascii") as text:
            head, first, second, *rest = text.read().splitlines()
        fields = first.split(",")
        fields[0], fields[2] = second.split(",")[0], second.split(",")[2]
        fields[3] = str(float(fields[3]) + 0.01)
        with open(file, "w", encoding="ascii") as out:
            out.write("\n".join([head, first, ",".join(fields), *rest]) + "\n")
        run = self.run_program("process", "session", "--output", "without")
        self.assertEqual(run.returncode, 0, msg=run.stderr)
        self.assertIn("1 pose(s) left out as duplicates: " + fields[0], run.stderr)
        self.assertIn("10 cm", run.stderr)
        self.assertEqual(len(os.listdir(self.at("without", "maps"))), 2)
        run = self.run_program("process", "session", "--keep-duplicates", "--output", "with")
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        self.assertEqual(len(os.listdir(self.at("with", "maps"))), 3)


def digest_of_files(folder):
    """As digest_of(), of regular files alone."""
    digests = {}
    for place, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(place, name)
            if os.path.isfile(path) and not os.path.islink(path):
                with open(path, "rb") as file:
                    digests[os.path.relpath(path, folder)] = hashlib.sha256(file.read()).hexdigest()
    return digests


if __name__ == "__main__":
    unittest.main()
