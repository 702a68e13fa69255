"""The package mmradartwin: captures in every byte layout, sessions, tables and findings, against bytes made here."""
import dataclasses
import json
import os
import struct
import unittest

import numpy as np

import mmradartwin

try:
    import genpy
    import rosbag
    from mmradartwin_msgs import msg as messages
except ImportError:
    messages = None
from mmradartwin_tests.session import Measurement, Settings
from in_folder import InFolder
from paper_radar import PAPER_RADAR

RADAR = PAPER_RADAR.format(loops=2, frame_period_s=0.05)
THREE_RECEIVERS = RADAR.replace(", [0, 0.0058401, 0]", "")
FRAMES, CHIRPS, SAMPLES = 3, 4, 64


def words_of(frames=FRAMES, receivers=4, samples=SAMPLES, seed=1):
    """Random int16 [F][C][N][R][I, Q]."""
    return np.random.default_rng(seed).integers(-32768, 32768, (frames, CHIRPS, samples, receivers, 2), np.int16)


def place_in_four_lanes(sample, receiver, part, lanes=4):
    """Word of a chirp: per sample I of all lanes, then Q."""
    return (2 * sample + part) * lanes + receiver


def place_in_two_lanes(sample, receiver, part, samples=SAMPLES):
    """Word of a chirp: receiver by receiver, I of two samples, then Q of both."""
    return 2 * samples * receiver + 4 * (sample // 2) + 2 * part + sample % 2


def payload(counts, place, chirp_words, swapped=False):
    """Bytes of a capture, word by word."""
    data = bytearray(2 * chirp_words * counts.shape[0] * CHIRPS)
    for (frame, chirp, sample, receiver, part), value in np.ndenumerate(counts):
        at = (frame * CHIRPS + chirp) * chirp_words + place(sample, receiver, 1 - part if swapped else part)
        struct.pack_into("<h", data, 2 * at, int(value))
    return bytes(data)


class Reading(InFolder):
    def write(self, name, content):
        os.makedirs(os.path.dirname(self.at(name)) or ".", exist_ok=True)
        with open(self.at(name), "wb") as out:
            out.write(content if isinstance(content, bytes) else content.encode())
        return self.at(name)

    def radar(self, text=RADAR):
        return mmradartwin.read_radar(self.write("radar.yaml", text))

    def refused(self, call, *said):
        with self.assertRaises(mmradartwin.InputError) as caught:
            call()
        text = str(caught.exception)
        self.assertNotIn("\n", text)
        for words in said:
            self.assertIn(words, text)


class Captures(Reading):
    def read(self, data, radar=RADAR):
        return mmradartwin.read_capture(self.write("a.bin", data), self.radar(radar), first_stamp_ns=10**18)

    def test_complex_layouts(self):
        four, three = words_of(), words_of(receivers=3)
        for counts, text, place, words, swapped in (
                (four, RADAR, place_in_four_lanes, 512, False),
                (four, RADAR + "iq_order: qi\n", place_in_four_lanes, 512, True),
                (three, THREE_RECEIVERS, place_in_four_lanes, 512, False),      # the fourth lane carries zeros
                (four, RADAR + "layout: 2lane\n", place_in_two_lanes, 512, False),
                (four, RADAR + "layout: 2lane\niq_order: qi\n", place_in_two_lanes, 512, True),
                (three, THREE_RECEIVERS + "layout: 2lane\n", place_in_two_lanes, 384, False),
                (three, THREE_RECEIVERS.replace("awr2243", "xWR1843"), place_in_two_lanes, 384, False)):
            with self.subTest(text=text[-60:]):
                frames = self.read(payload(counts, place, words, swapped), text)
                np.testing.assert_array_equal(frames.counts, counts)
                self.assertEqual(frames.counts.dtype, np.int16)
                self.assertEqual(frames.stamp_ns.tolist(), [10**18 + 50_000_000 * i for i in range(FRAMES)])
                self.assertTrue(frames.chirp_valid.all())
                self.assertEqual(frames.x[1, 2, 3, 1], complex(*map(int, counts[1, 2, 3, 1])))

    def test_real_samples(self):
        real = np.random.default_rng(5).integers(-9000, 9000, (FRAMES, CHIRPS, 64, 4), np.int16)
        # x[n] = X_0/2N + sum of 2 X_r/2N exp(j 2 pi r n/N) over the positive frequencies r < N, N = 32.
        n, r = np.arange(32), np.arange(32)
        spectrum = np.einsum("fcmR,rm->fcrR", real, np.exp(-2j * np.pi * np.outer(r, np.arange(64)) / 64)) / 64
        spectrum[:, :, 1:] *= 2
        analytic = np.einsum("fcrR,nr->fcnR", spectrum, np.exp(2j * np.pi * np.outer(n, r) / 32))
        expected = np.stack([analytic.real, analytic.imag], axis=-1)
        for text, order in ((RADAR + "samples: real\n", (0, 1, 2, 3)),
                            (RADAR + "samples: real\nlayout: 2lane\n", (0, 1, 3, 2))):
            with self.subTest(text=text[-20:]):
                frames = self.read(real.transpose(order).astype("<i2").tobytes(), text)
                self.assertEqual(frames.counts.shape, (FRAMES, CHIRPS, 32, 4, 2))
                self.assertLessEqual(np.abs(frames.counts - expected).max(), 0.5 + 1e-6)

    def test_parts(self):
        data = payload(words_of(), place_in_four_lanes, 512)
        for head in ("adc_data_Raw_", "adc_data_"):
            for number, (begin, end) in enumerate(((0, 5000), (5000, 9000), (9000, None))):
                self.write(f"{head}{number}.bin", data[begin:end])
            frames = mmradartwin.read_capture(self.at(f"{head}0.bin"), self.radar())
            np.testing.assert_array_equal(frames.counts, words_of())
        self.refused(lambda: mmradartwin.read_capture(self.at("adc_data_0.bin"), self.radar(), 0, [self.at("adc_data_1.bin")]),
                     "truncated")
        os.remove(self.at("adc_data_1.bin"))
        self.refused(lambda: mmradartwin.read_capture(self.at("adc_data_0.bin"), self.radar()), "adc_data_1.bin is missing")

    def test_what_is_no_capture(self):
        data = payload(words_of(), place_in_four_lanes, 512)
        for content, *said in ((data[:-6], "a.bin: capture is truncated", "2 whole frames of 4096 bytes and 4090 bytes over"),
                               (b"", "empty file"), (b"\x93NUMPY" + data[6:], "a NumPy file"),
                               (b"PK\x03\x04" + data[4:], "a zip archive"), (b"I, Q\n1, 2\n" * 900, "a text"),
                               (struct.pack("<4H", 0x0CDA, 0x0ADC, 0x0CDA, 0x0ADC) + data[8:], "LVDS")):
            with self.subTest(said=said):
                self.refused(lambda content=content: self.read(content), *said)
        for with_size in (True, False):
            parts = []
            for number, at in enumerate(range(0, len(data), 1456)):
                part = data[at:at + 1456]
                head = struct.pack("<II", number + 1, len(part)) if with_size else struct.pack("<I", number + 1)
                parts.append(head + struct.pack("<Q", at)[:6] + part)
            headed = b"".join(parts)
            self.refused(lambda headed=headed: self.read(headed), "packet heads of " + ("14" if with_size else "10"),
                         "process --npz --cubes")
        for name in ("none.bin", "none/a_0.bin"):
            self.refused(lambda name=name: mmradartwin.read_capture(self.at(name), self.radar()), name, "cannot be opened")

    def test_average(self):
        counts = words_of()
        frames = self.read(payload(counts, place_in_four_lanes, 512))
        frames.chirp_valid[1, 2] = False      # loop 1, slot 0
        grid = frames.grid(self.radar())
        for slot in range(2):
            taken = [counts[f, 2 * loop + slot] for f in range(3) for loop in range(2) if (f, loop, slot) != (1, 1, 0)]
            mean = np.mean(np.array(taken, float), axis=0)
            np.testing.assert_allclose(grid.x[4 * slot:4 * slot + 4], (mean[..., 0] + 1j * mean[..., 1]).T, atol=1e-9)
        self.assertEqual((grid.frames, grid.full_scale, grid.stamp_ns), (3, 32768.0, 10**18 + 100_000_000))
        frames.chirp_valid[:, 1::2] = False
        self.refused(lambda: frames.grid(self.radar()), "no valid chirp of slot 1")


class Radars(Reading):
    def test_fields(self):
        radar = self.radar(RADAR.replace("77.0e+9", "'77.0e9'") + "idle_s: 7.0e-6\ntx_enable: [[0], [2]]\nangle_slots: [0]\n")
        self.assertEqual(radar.carrier_hz, 77e9)
        self.assertEqual((radar.slots, radar.receivers, radar.channels, radar.chirps_per_frame), (2, 4, 8, 4))
        self.assertAlmostEqual(radar.range_bin_m, 0.1561, places=4)
        self.assertAlmostEqual(radar.wavelength_m, 299792458.0 / 77.93e9, places=9)
        self.assertEqual((radar.idle_s, radar.tx_enable, radar.angle_slots), (7e-6, [[0], [2]], [0]))
        self.assertTrue(np.isnan(radar.rx_gain_db))
        np.testing.assert_allclose(radar.virtual_element_m[5], [0, 0.0077867 + 0.0019467, 0])

    def test_errors_name_file_key_value_and_range(self):
        for text, *said in ((RADAR + "gain: 3\n", "key gain: is unknown"),
                            (RADAR.replace("5.0e+6", "5.0e+6\nsample_rate_hz: 1"), "key sample_rate_hz stands twice"),
                            (RADAR.replace("5.0e+6", "5"), "key sample_rate_hz: '5' is out of range; allowed: 10000 to"),
                            (RADAR.replace("75.0e+12", "fast"), "key slope_hz_per_s: 'fast' is no number"),
                            (RADAR.replace("samples_per_chirp: 64", "samples_per_chirp: 64.5"), "no whole number"),
                            (RADAR.replace("device: awr2243\n", ""), "key device: is missing"),
                            (RADAR.replace("[[0, 0, 0], [0, 0.0077867, 0]]", "[[0, 0]]"), "tx_position_m[0]"),
                            (RADAR + "layout: 3lane\n", "'3lane' is unknown; allowed: 4lane, 2lane"),
                            ("- a\n", "expected a YAML mapping"), ("a: [\n", "is no YAML")):
            with self.subTest(said=said):
                self.refused(lambda text=text: self.radar(text), "radar.yaml", *said)


class Sessions(Reading):
    def small_session(self, rows, session=""):
        self.write("s/radar.yaml", RADAR)
        self.write("s/poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\n" + rows)
        self.write("s/captures/1.bin", payload(words_of(), place_in_four_lanes, 512))
        self.write("s/session.yaml", "format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\n"
                                     "captures: captures/{pose}.bin\n" + session)
        return mmradartwin.open_session(self.at("s"))

    def test_a_session_of_the_generator(self):
        measurement = Measurement(Settings(output=self.at("lab"), seed=3, poses=3, frames=4))
        measurement.run()
        session = mmradartwin.open_session(self.at("lab"))
        self.assertEqual([pose.name for pose in session.poses], [s.name for s in measurement.stations])
        self.assertEqual(os.path.realpath(session.scene_file), os.path.realpath(self.at("lab", "scene.yaml")))
        for pose, station in zip(session.poses, measurement.stations):
            self.assertEqual((pose.location, pose.stamp_ns), (station.location, station.stamp_ns))
            np.testing.assert_allclose(pose.T_map_radar[:3, :3], station.reported.rotation, atol=1e-8)
            np.testing.assert_allclose(pose.T_map_radar[:3, 3], station.reported.position, atol=1e-6)
            frames = session.frames(pose.name)
            with open(self.at("lab", "captures", pose.name + ".bin"), "rb") as file:
                data = file.read()
            for frame, t, n, r in ((0, 0, 0, 0), (1, 1, 63, 3), (3, 0, 17, 2), (2, 1, 40, 1)):
                at = 2048 * frame + 16 * (64 * t + n) + 2 * r
                self.assertEqual(frames.counts[frame, t, n, r].tolist(),
                                 list(struct.unpack_from("<h", data, at) + struct.unpack_from("<h", data, at + 8)))
            grid = session.grid(pose.name)
            self.assertEqual(grid.x.shape, (8, 64))
            np.testing.assert_array_equal(grid.T_map_radar, pose.T_map_radar)

    def test_stamps_are_exact_and_bad_rows_are_problems_of_their_own(self):
        session = self.small_session("1,A,1700000000.250000001,1,2,1,0,0,0,1\n2,A,1700000009,nan,2,1,0,0,0,1\n"
                                     "3,B,1700000019.5,1,2,1,0,0,1,1\n4,B,1700000029.5,1.05,2,1,0,0,0,1\n",
                                     "gain_db: 80.5\naccuracy: {scene_m: 0.02}\n")
        self.assertEqual(session.poses[0].stamp_ns, 1700000000250000001)
        self.assertEqual([p.name for p in session.poses], ["1"])
        self.assertEqual(session.duplicates, ["4"])
        self.assertEqual(sorted(session.problems), ["2", "3"])
        self.assertIn("line 3: pose '2': x is nan", session.problems["2"])
        self.assertEqual((session.gain_db, session.accuracy), (80.5, {"scene_m": 0.02}))
        self.assertEqual(len(session.frames("1").counts), FRAMES)
        self.refused(lambda: session.frames("2"), "has no pose '2'", "x is nan")
        self.refused(lambda: session.frames("9"), "has no pose '9'")

    def test_errors(self):
        row = "1,A,1700000000,1,2,1,0,0,0,1\n"
        for rows, session, *said in (
                (row, "noise: 3\n", "session.yaml", "key noise: is unknown"),
                (row + row, "", "line 3", "stands twice"),
                (row + "2,A,1700000000.1,3,2,1,0,0,0,1\n", "", "poses '1' and '2' overlap in time"),
                ("1,A,1700000000,1\n", "", "line 2: 4 fields; a row has 10"),
                ("a/b,A,1700000000,1,2,1,0,0,0,1\n", "", "a name that no file can have"),
                (row, "accuracy: {scene_m: 3}\n", "key accuracy.scene_m: '3' is out of range; allowed: 0.0005 to 0.5")):
            with self.subTest(said=said):
                self.refused(lambda rows=rows, session=session: self.small_session(rows, session), *said)
        self.refused(lambda: mmradartwin.open_session(self.at("nothing")), "nothing", "cannot be read")


class Results(Reading):
    def test_map(self):
        cells = [(0.0, -60.0), (0.0, 0.0), (0.0, 60.5), (0.15, -60.0), (0.15, 0.0), (0.15, 60.5)]
        rows = [f"{r:.6f},{a:.6f},{-10 * i - 0.25:.6f}\n" for i, (r, a) in enumerate(cells)]
        found = mmradartwin.read_map_csv(self.write("m.csv", "range_m,azimuth_deg,power_db\n" + "".join(rows)))
        np.testing.assert_array_equal(found.range_m, [0, 0.15])
        np.testing.assert_allclose(found.azimuth_deg, [-60, 0, 60.5], atol=1e-12)
        np.testing.assert_array_equal(found.power_db, [[-0.25, -10.25, -20.25], [-30.25, -40.25, -50.25]])
        self.assertEqual(dataclasses.replace(found, range_m=found.range_m + 0.2).strongest()[2], -0.25)
        self.refused(lambda: mmradartwin.read_map_csv(self.write("m.csv", "range_m,azimuth_deg,power_db\n" + "".join(rows[:5]))),
                     "m.csv", "cut off")
        self.refused(lambda: mmradartwin.read_map_csv(self.write("m.csv", "range_m,power_db\n1,2\n")), "line 1: header is")

    def test_paths(self):
        header = ("length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,bounces,"
                  "event,actors,materials\n")
        file = self.write("p.csv", header + "6.5,10,-1,12,2,-90.5,0.25,2,specular,wall;tv,Concrete;Glass\n"
                                            "8,0,0,0,0,-101,-3,1,diffuse,wall,Concrete\n")
        paths = mmradartwin.read_paths_csv(file)
        self.assertEqual(len(paths), 2)
        self.assertEqual(paths.actors, [("wall", "tv"), ("wall",)])
        self.assertEqual(paths.materials[0], ("Concrete", "Glass"))
        self.assertEqual((paths.event, paths.bounces.tolist()), (["specular", "diffuse"], [2, 1]))
        self.assertEqual((paths.length_m[1], paths.amplitude_db[0], paths.azimuth_arr_deg[0]), (8, -90.5, 12))
        self.refused(lambda: mmradartwin.read_paths_csv(self.write("p.csv", header + "6.5,x,-1,12,2,-90,0,2,e,a,b\n")),
                     "p.csv: line 2: azimuth_dep_deg 'x' is no number")

    def test_findings(self):
        entry = {"cause": "moving_target", "class": "C5", "action": "tracking", "parameters": {
            "x_m": {"value": 3.5, "unit": "m", "ci95": [3.4, 3.6]}, "speed_m_per_s": {"value": None, "unit": "m/s"},
            "track_x_m": {"value": [1, 2.5], "unit": "m", "ci95": [[0, 2], [2, 3]]}, "actor": {"value": "tv"}},
            "mechanism": {"moving_target": {"x_m": 3.5}}, "candidates": [{"cause": "moving_target", "probability": 0.9},
                                                                        {"cause": "frame_drift", "probability": 0.1}],
            "experiment": None, "evidence": {"log_likelihood_gain": 40.0}, "gain": None, "where": [],
            "figure": "figures/moving_target.png", "description": "something moves"}
        document = {"format": "mmradartwin_findings/1", "poses": {"count": 4, "locations": 1, "held_out": ""},
                    "verdict": "named", "findings": [entry], "extended_twin": None}
        self.write("out/findings.json", json.dumps(document))
        self.write("out/records/moving_target.csv", "pose,event,actors,amplitude_before_db,range_before_m,azimuth_before_deg,"
                   'amplitude_after_db,range_after_m,azimuth_after_deg\n"001",diffuse,"a, b",,,,-80.5,3.2,-10\n')
        findings = mmradartwin.read_findings(self.at("out"))
        self.assertEqual((findings.verdict, findings.poses, findings.locations), ("named", 4, 1))
        first = findings.findings[0]
        self.assertEqual((first.cause, first.residual_class, first.description), ("moving_target", "C5", "something moves"))
        self.assertEqual(first.parameters["x_m"].value, 3.5)
        self.assertEqual(first.parameters["x_m"].ci95.tolist(), [3.4, 3.6])
        self.assertTrue(np.isnan(first.parameters["speed_m_per_s"].value))
        self.assertEqual(first.parameters["track_x_m"].value.tolist(), [1, 2.5])
        self.assertEqual(first.parameters["track_x_m"].ci95.shape, (2, 2))
        self.assertEqual(first.parameters["actor"].value, "tv")
        self.assertEqual(first.probability, {"moving_target": 0.9, "frame_drift": 0.1})
        self.assertEqual(first.changed_paths["actors"], ["a, b"])
        self.assertTrue(np.isnan(first.changed_paths["range_before_m"][0]))
        self.assertEqual(first.changed_paths["range_after_m"][0], 3.2)
        self.refused(lambda: mmradartwin.read_findings(self.write("f.json", "{")), "f.json", "no JSON")
        self.refused(lambda: mmradartwin.read_findings(self.write("f.json", "{}")), "key format")

    def test_arrays_of_something_else(self):
        np.savez(self.at("other.npz"), grid=np.zeros(3))
        self.refused(lambda: mmradartwin.read_npz(self.at("other.npz")), "other.npz: lacks full_scale")
        np.save(self.at("one.npy"), np.zeros(3))
        self.refused(lambda: mmradartwin.read_npz(self.at("one.npy")), "one.npy: is one array")
        self.refused(lambda: mmradartwin.read_npz(self.write("text.npz", "no zip")), "text.npz")


@unittest.skipIf(messages is None, "rosbag or mmradartwin_msgs is not here")
class Bags(Reading):
    def radar_message(self, tx_y_m=0.0077867):
        config = messages.RadarConfig(device="awr2243", carrier_hz=77e9, slope_hz_per_s=75e12, samples_per_chirp=2,
                                      sample_rate_hz=5e6, adc_start_s=6e-6, loops_per_frame=1, frame_period_s=0.05,
                                      layout="4lane", iq_order="iq", tx_enable=[1, 4])
        for target, y in ((config.tx_position_m, 0.0), (config.tx_position_m, tx_y_m), (config.rx_position_m, 0.0)):
            target.append(messages.ReceiveGrid().T_map_radar.position.__class__(0, y, 0))
        return config

    def bag(self, *of_topics, name="a.bag"):
        with rosbag.Bag(self.at(name), "w") as out:
            for topic, message in of_topics:
                out.write(topic, message, genpy.Time(5))
        return self.at(name)

    def stamped(self, message, stamp_ns):
        message.header.stamp = genpy.Time(*divmod(stamp_ns, 10**9))
        if hasattr(message, "T_map_radar"):
            message.T_map_radar.position.x = 1.5
            message.T_map_radar.orientation.z = message.T_map_radar.orientation.w = 0.5**0.5
        return message

    def test_every_kind_of_message(self):
        counts = np.arange(-4, 4).reshape(2, 2, 1, 2)
        path = messages.PathRecord(event="specular", actors=["wall", "tv"], materials=["Concrete", "Glass"], bounces=2,
                                   amplitude=1e-3, length_m=[6.5, 6.25], c_re=[0.0, 1e-3], c_im=[1e-3, 0.0])
        path.vertices = [self.radar_message().tx_position_m[0].__class__(x, 2, 1) for x in (3, 4)]
        path.departure.x, path.departure.y = 0.6, 0.8
        path.arrival.x, path.arrival.z = 0.8, -0.6
        stamp_ns = 1700000000250000001
        file = self.bag(
            ("/left/radar/config", self.radar_message()),
            ("/left/radar/adc", self.stamped(messages.AdcCube(
                sequence=3, chirps=2, samples_per_chirp=2, receivers=1, samples=counts.ravel().tolist(),
                chirp_valid=bytes([1, 0])), stamp_ns)),
            ("/left/radar/grid", self.stamped(messages.ReceiveGrid(
                channels=2, samples=2, data=list(range(8)), full_scale=32768.0, frames=4, pose_valid=True), stamp_ns)),
            ("/left/radar/range_angle", self.stamped(messages.RangeAngleMap(
                range_m=[0.0, 0.5], azimuth_rad=[-1.0, 0.0, 1.0], power_db=[-1, -2, -3, -4, -5, -6.5], frames=4), stamp_ns)),
            ("/left/twin/paths", self.stamped(messages.PathRecords(records=[path]), stamp_ns)),
            ("/left/attribution/findings", messages.Findings(json=json.dumps(
                {"format": "mmradartwin_findings/1", "poses": {"count": 3, "locations": 2}, "verdict": "none", "findings": []}))))
        bag = mmradartwin.open_bag(file)
        self.assertEqual((bag.namespace, bag.radar.tx_enable, bag.radar.samples_per_chirp), ("left", [[0], [2]], 2))
        frames = bag.frames()
        np.testing.assert_array_equal(frames.counts, counts[None])
        self.assertEqual((frames.stamp_ns.tolist(), frames.chirp_valid.tolist()), ([stamp_ns], [[True, False]]))
        self.assertEqual(len(bag.frames(first_ns=stamp_ns + 1).counts), 0)
        grid, = bag.grids()
        self.assertEqual(grid.x.tolist(), [[1j, 2 + 3j], [4 + 5j, 6 + 7j]])
        np.testing.assert_allclose(grid.T_map_radar, [[0, -1, 0, 1.5], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], atol=1e-15)
        found, = bag.maps()
        self.assertEqual((found.power_db[1].tolist(), found.frames, found.stamp_ns), ([-4, -5, -6.5], 4, stamp_ns))
        self.assertIsNone(found.T_map_radar)
        (when, T_map_radar, paths), = bag.paths()
        self.assertEqual((when, T_map_radar[0, 3], paths.actors), (stamp_ns, 1.5, [("wall", "tv")]))
        self.assertAlmostEqual(paths.azimuth_dep_deg[0], 53.130102, places=6)
        self.assertAlmostEqual(paths.elevation_arr_deg[0], -36.869898, places=6)
        self.assertAlmostEqual(paths.amplitude_db[0], -60, places=12)
        self.assertAlmostEqual(paths.phase_rad[0], np.pi / 2, places=12)
        self.assertEqual((paths.length_m.tolist(), paths.channel_length_m.tolist()), ([6.5], [[6.5, 6.25]]))
        self.assertEqual(paths.vertices_m[0].tolist(), [[3, 2, 1], [4, 2, 1]])
        findings, = bag.findings()
        self.assertEqual((findings.verdict, findings.poses), ("none", 3))

    def test_errors(self):
        cube = messages.AdcCube(chirps=1, samples_per_chirp=2, receivers=1, samples=[1, 2, 3, 4], chirp_valid=bytes([1]))
        bag = mmradartwin.open_bag(self.bag(("radar/config", self.radar_message()), ("radar/adc", cube)))
        self.refused(bag.frames, "a.bag: frame 0 has another shape than radar/config says")
        self.refused(lambda: bag.pose_frames("1"), "has no pose '1'", "bag_to_session")
        self.refused(lambda: mmradartwin.open_bag(self.bag(("radar/adc", cube), name="b.bag")),
                     "b.bag: bag holds no radar configuration on topic radar/config (it has radar/adc)")
        file = self.bag(("/a/radar/adc", cube), ("/b/radar/adc", cube), ("/b/radar/config", self.radar_message()), name="c.bag")
        self.refused(lambda: mmradartwin.open_bag(file), "frames of 2 radars", "a, b")
        self.assertEqual(mmradartwin.open_bag(file, "/b").namespace, "b")


if __name__ == "__main__":
    unittest.main()
