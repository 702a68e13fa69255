"""What the diagnosis says of what a person may hand to it by mistake."""
import os
import shutil
import subprocess
import unittest

import yaml

from mmradartwin_tests import effects
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from diagnose_program import PROGRAM, diagnose
from in_folder import InFolder


@unittest.skipIf(PROGRAM is None, "mmradartwin_attribution diagnose is not built in this workspace")
class BadInput(InFolder):
    """What a person may hand to the program by mistake."""

    def setUp(self):
        super().setUp()
        self.session, self.output = self.at("session"), self.at("out")
        Measurement(Settings(output=self.session, seed=7, poses=3, frames=2)).run()

    def change_poses(self, change):
        """Rewrites poses.csv; change takes and returns the fields of a row."""
        file = os.path.join(self.session, "poses.csv")
        with open(file, encoding="ascii") as text:
            lines = text.read().splitlines()
        with open(file, "w", encoding="ascii") as text:
            text.write("\n".join([lines[0]] + [",".join(change(line.split(","))) for line in lines[1:]]) + "\n")

    def test_poses_in_millimetres(self):
        self.change_poses(lambda f: f[:3] + [str(float(v) * 1000) for v in f[3:6]] + f[6:])
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 2)
        self.assertIsNone(findings)
        self.assertIn("metres", errors)

    def test_radars_that_cannot_be(self):
        file = os.path.join(self.session, "radar.yaml")
        with open(file, encoding="ascii") as text:
            true = yaml.safe_load(text)
        half_m = 0.0019467
        for change, parts in (
                ({"sample_rate_hz": 5000.0}, ("key sample_rate_hz", "ksps")),
                ({"frame_period_s": 50.0}, ("key frame_period_s", "ms")),
                ({"tx_position_m": [[0, 0, 0], [0, 4, 0]]}, ("key tx_position_m", "half wavelengths")),
                ({"tx_position_m": [[0, 0, 0], [0, 4 * half_m, half_m]]}, ("slot 1", "above", "angle_slots: [0]"))):
            with self.subTest(change=change):
                with open(file, "w", encoding="ascii") as text:
                    yaml.safe_dump({**true, **change}, text)
                status, findings, errors = diagnose(self.session, self.output)
                self.assertEqual(status, 2, msg=errors)
                self.assertIsNone(findings)
                for part in (file, *parts):
                    self.assertIn(part, errors)

    def test_constant_zeros(self):
        with open(os.path.join(self.session, "poses.csv"), encoding="ascii") as text:
            names = [line.split(",")[0] for line in text.read().splitlines()[1:]]
        for name in names:
            file = os.path.join(self.session, "captures", name + ".bin")
            size = os.path.getsize(file)
            with open(file, "wb") as out:
                out.write(bytes(size))
        status, _, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 2)
        self.assertIn("zero", errors)

    def captures(self):
        folder = os.path.join(self.session, "captures")
        return [os.path.join(folder, name) for name in sorted(os.listdir(folder))]

    def test_captures_of_other_places_match_nothing(self):
        # Whatever frames and channels show without a scene: that it is the wrong one is the answer.
        for hidden in ([], [effects.make_effect("tx_rx_leakage", {"range_m": 0.05, "level_db": 6.0})]):
            with self.subTest(hidden=[e.name for e in hidden]):
                shutil.rmtree(self.session)
                Measurement(Settings(output=self.session, seed=7, poses=8, frames=2, effects=hidden)).run()
                files = self.captures()
                contents = []
                for file in files:
                    with open(file, "rb") as capture:
                        contents.append(capture.read())
                for file, content in zip(files, contents[3:] + contents[:3]):
                    with open(file, "wb") as capture:
                        capture.write(content)
                status, findings, errors = diagnose(self.session, self.output)
                self.assertEqual(status, 0, msg=errors)
                self.assertEqual([f["cause"] for f in findings["findings"]], ["unknown"])
                self.assertEqual(findings["verdict"], "unknown")
                self.assertIn("nothing matches", findings["findings"][0]["description"])
                for effect in hidden:
                    self.assertIn(effect.name, findings["findings"][0]["description"])

    def test_a_radar_that_stands_still_matches(self):
        Measurement(Settings(output=self.session, seed=8, poses=1, frames=10)).run()
        with open(os.path.join(self.session, "poses.csv"), encoding="ascii") as text:
            head, row = text.read().splitlines()
        fields = row.split(",")
        capture = os.path.join(self.session, "captures", fields[0] + ".bin")
        with open(capture, "rb") as file:
            data = file.read()
        os.remove(capture)
        rows = []
        for k in range(5):    # two frames each
            name = f"{k + 1:03d}"
            rows.append(",".join([name, fields[1], f"{float(fields[2]) + k:.9f}"] + fields[3:]))
            with open(os.path.join(self.session, "captures", name + ".bin"), "wb") as out:
                out.write(data[k * len(data) // 5:(k + 1) * len(data) // 5])
        with open(os.path.join(self.session, "poses.csv"), "w", encoding="ascii") as out:
            out.write("\n".join([head] + rows) + "\n")
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["findings"], [])

    def test_poses_that_cannot_be_used_do_not_count(self):
        for file in self.captures()[1:]:
            size = os.path.getsize(file)
            with open(file, "wb") as out:
                out.write(bytes(size))
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 2, msg=errors)
        self.assertEqual((findings["poses"]["count"], findings["poses"]["locations"]), (1, 1))
        self.assertIn("fewer than 3 poses", findings["poses"]["held_out"])
        with open(os.path.join(self.output, "report.html"), encoding="utf-8") as page:
            self.assertEqual(page.read().count("all its samples are zero"), 2)

    def test_a_twin_of_another_array_is_refused(self):
        with open(os.path.join(self.session, "radar.yaml"), encoding="ascii") as text:
            radar = yaml.safe_load(text)
        radar["tx_position_m"] = radar["tx_position_m"][:1]
        for key in ("tx_enable", "layout"):
            radar.pop(key, None)
        with open(os.path.join(self.session, "one.yaml"), "w", encoding="ascii") as out:
            yaml.safe_dump(radar, out)
        twin = os.path.join(self.session, "one_twin.yaml")
        with open(twin, "w", encoding="ascii") as out:
            out.write("scene: scene.yaml\nradar: one.yaml\n")
        status, findings, errors = diagnose(self.session, self.output, "--twin", twin)
        self.assertEqual(status, 2)
        self.assertIsNone(findings)
        self.assertIn("one.yaml: has 4 virtual channels", errors)

    def test_the_extended_twin_of_a_bag_does_not_refer_to_what_is_gone(self):
        with open(os.path.join(self.session, "session.yaml"), "a", encoding="ascii") as session:
            session.write("twin: twin.yaml\n")
        with open(os.path.join(self.session, "twin.yaml"), "w", encoding="ascii") as twin:
            twin.write("scene: scene.yaml\nradar: radar.yaml\nmechanisms:\n  specular: {max_bounces: 3}\n"
                       "  corner: {}\n  diffuse: {}\n  range_bias: {range_m: 0.001}\n")
        bag = self.at("session.bag")
        subprocess.run([find_program("mmradartwin_dsp", "session_to_bag"), self.session, bag], check=True,
                       capture_output=True)
        status, _, errors = diagnose(bag, self.output, "--findings", "0")
        self.assertEqual(status, 0, msg=errors)
        extended = os.path.join(self.output, "twin.extended.yaml")
        with open(extended, encoding="ascii") as text:
            twin = yaml.safe_load(text)
        self.assertNotIn("scene", twin)
        self.assertNotIn("radar", twin)
        self.assertAlmostEqual(twin["mechanisms"]["range_bias"]["range_m"], 0.001)
        status, _, errors = diagnose(bag, self.at("again"), "--findings", "0", "--twin", extended)
        self.assertEqual(status, 0, msg=errors)

    def test_one_pose_alone_names_nothing_of_a_clean_session(self):
        Measurement(Settings(output=self.session, seed=8, poses=1, frames=2)).run()
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 0, msg=errors)
        self.assertEqual(findings["verdict"], "none")

    def test_a_capture_of_another_radar_is_left_out_by_name(self):
        with open(self.captures()[1], "ab") as capture:
            capture.write(bytes(5))
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 2)
        self.assertIn(self.captures()[1], errors)
        self.assertEqual(findings["poses"]["count"], 2)

    def test_a_capture_that_packets_are_missing_in_is_read_and_named(self):
        slipped = effects.make_effect("packet_misalignment", {"pose": "001"})
        Measurement(Settings(output=self.session, seed=8, poses=6, frames=10, effects=[slipped])).run()
        capture, = (c for c in self.captures() if c.endswith("001.bin"))
        os.truncate(capture, os.path.getsize(capture) - 1456)      # as it is where nothing follows
        status, findings, errors = diagnose(self.session, self.output)
        self.assertEqual(status, 2)
        self.assertIn(f"{capture}: capture is truncated", errors)
        self.assertIn("packets are missing in it", errors)
        self.assertEqual([(f["cause"], f["parameters"]["pose"]["value"]) for f in findings["findings"]],
                         [("packet_misalignment", "001")])
        self.assertEqual(findings["poses"]["count"], 6)
        with open(os.path.join(self.output, "report.html"), encoding="utf-8") as report:
            self.assertNotIn("packet = ", report.read())    # which packet was lost nobody knows

    def test_a_recording_that_is_not_there(self):
        status, _, errors = diagnose(self.at("nowhere"), self.output)
        self.assertEqual(status, 2)
        self.assertIn("nowhere", errors)


if __name__ == "__main__":
    unittest.main()
