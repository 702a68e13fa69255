"""The package mmradartwin against the programs: the same numbers to the last digit."""
import json
import os
import subprocess
import tempfile
import unittest

import numpy as np

import mmradartwin
from mmradartwin_tests.installed_programs import find_program
from in_folder import InFolder
from made_session import make_session
from paper_radar import PAPER_RADAR

try:
    from mmradartwin import sim
except ImportError:
    sim = None
PROCESS = find_program("mmradartwin_dsp", "process")
SESSION_TO_BAG = find_program("mmradartwin_dsp", "session_to_bag")
SIMULATE = find_program("mmradartwin_sim", "simulate")
RADAR = PAPER_RADAR.format(loops=2, frame_period_s=0.05)


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise AssertionError(f"{command[0]} ended with {done.returncode}: {done.stderr}")


def text_of(file):
    with open(file, encoding="utf-8") as stream:
        return stream.read()


def degrees(rad):
    """As C++ writes it."""
    return rad * 180 / np.pi


@unittest.skipIf(PROCESS is None or SIMULATE is None, "programs are not built in this workspace")
class OfOneSession(InFolder):
    """A session of the generator: two places, three frames each."""

    @classmethod
    def setUpClass(cls):
        cls.lab = os.path.join(cls.enterClassContext(tempfile.TemporaryDirectory()), "lab")
        make_session(cls.lab, 2, 3)
        cls.session = mmradartwin.open_session(cls.lab)
        cls.names = [pose.name for pose in cls.session.poses]

    def test_grids_and_maps_are_those_of_process(self):
        run(PROCESS, self.lab, "--output", self.at("out"), "--npz", "--mat", "--cubes")
        for name in self.names:
            arrays, grid = mmradartwin.read_npz(self.at("out", "npz", name + ".npz")), self.session.grid(name)
            np.testing.assert_array_equal(arrays.counts, self.session.frames(name).counts)
            np.testing.assert_array_equal(arrays.grid.x, grid.x)
            np.testing.assert_array_equal(arrays.grid.T_map_radar, grid.T_map_radar)
            self.assertEqual((arrays.grid.frames, arrays.grid.full_scale), (grid.frames, grid.full_scale))
            self.assertAlmostEqual((arrays.grid.stamp_ns - self.session.pose(name).stamp_ns) * 1e-9, 0, delta=1e-6)
            found, cells = arrays.map, []
            for r, range_m in enumerate(found.range_m):
                cells += [f"{range_m:.6f},{degrees(azimuth):.6f},{found.power_db[r, a]:.6f}\n"
                          for a, azimuth in enumerate(found.azimuth_rad)]
            file = self.at("out", "maps", name + ".csv")
            self.assertEqual(text_of(file), "range_m,azimuth_deg,power_db\n" + "".join(cells))
            read = mmradartwin.read_map_csv(file)
            np.testing.assert_allclose(read.power_db, found.power_db, atol=5.1e-7)
            np.testing.assert_allclose(read.azimuth_rad, found.azimuth_rad, atol=1e-8)
            self.check_mat(self.at("out", "mat", name + ".mat"), self.at("out", "npz", name + ".npz"))
            if sim is not None:
                chain = sim.SignalChain(os.path.join(self.lab, "radar.yaml"))
                np.testing.assert_array_equal(chain.map(grid).power_db, found.power_db)

    def check_mat(self, mat, npz):
        from scipy.io import loadmat
        stored = loadmat(mat)
        with np.load(npz) as arrays:
            self.assertEqual(set(arrays.files), {name for name in stored if not name.startswith("__")})
            for name in arrays.files:
                np.testing.assert_array_equal(stored[name].reshape(arrays[name].shape), arrays[name])

    @unittest.skipIf(SESSION_TO_BAG is None, "session_to_bag is not built in this workspace")
    def test_a_bag_holds_the_same(self):
        run(SESSION_TO_BAG, self.lab, self.at("lab.bag"))
        bag = mmradartwin.open_bag(self.at("lab.bag"))
        self.assertEqual([pose.name for pose in bag.poses], self.names)
        self.assertEqual(bag.radar.carrier_hz, self.session.radar.carrier_hz)
        for name in self.names:
            frames, expected = bag.pose_frames(name), self.session.frames(name)
            np.testing.assert_array_equal(frames.counts, expected.counts)
            np.testing.assert_array_equal(frames.stamp_ns, expected.stamp_ns)
            np.testing.assert_array_equal(bag.grid(name).x, self.session.grid(name).x)
            np.testing.assert_array_equal(bag.grid(name).T_map_radar, self.session.grid(name).T_map_radar)
        self.assertEqual(bag.duplicates, self.session.duplicates)
        self.assertEqual(len(bag.frames().counts), 3 * len(self.names + bag.duplicates))
        with self.assertRaisesRegex(mmradartwin.InputError, "has no pose 'x'"):
            bag.pose_frames("x")
        with self.assertRaisesRegex(mmradartwin.InputError, "is no bag"):
            mmradartwin.open_bag(os.path.join(self.lab, "poses.csv"))


@unittest.skipIf(PROCESS is None, "mmradartwin_dsp process is not built in this workspace")
class Layouts(InFolder):
    """A target in random noise, of which process and the package read the same samples."""

    def test_every_layout(self):
        rng = np.random.default_rng(2)
        n = np.arange(64)
        echo = np.exp(2j * np.pi * (0.11 * n[:, None] - 0.1 * np.arange(4)))
        x = np.tile(8000 * echo, (3 * 4, 1, 1)) + rng.normal(0, 60, (12, 64, 4)) + 1j * rng.normal(0, 60, (12, 64, 4))
        i, q = np.rint(x.real).astype("<i2"), np.rint(x.imag).astype("<i2")      # [chirp, sample, receiver]
        pairs = lambda part: part.transpose(0, 2, 1).reshape(12, 4, 32, 2)
        for more, data in (("", np.stack([i, q], 2)), ("iq_order: qi\n", np.stack([q, i], 2)),
                           ("layout: 2lane\n", np.stack([pairs(i), pairs(q)], 3)),
                           ("layout: 2lane\niq_order: qi\n", np.stack([pairs(q), pairs(i)], 3)),
                           ("samples: real\n", i), ("samples: real\nlayout: 2lane\n", i.transpose(0, 2, 1))):
            with self.subTest(more=more):
                with open(self.at("a.bin"), "wb") as out:
                    out.write(np.ascontiguousarray(data).tobytes())
                with open(self.at("radar.yaml"), "w", encoding="ascii") as out:
                    out.write(RADAR + more)
                run(PROCESS, self.at("a.bin"), "--radar", self.at("radar.yaml"), "--output", self.at("out"), "--npz", "--cubes",
                    "--force")
                radar = mmradartwin.read_radar(self.at("radar.yaml"))
                frames = mmradartwin.read_capture(self.at("a.bin"), radar)
                arrays = mmradartwin.read_npz(self.at("out", "npz", "a.npz"))
                np.testing.assert_array_equal(frames.counts, arrays.counts)
                np.testing.assert_array_equal(frames.grid(radar).x, arrays.grid.x)


@unittest.skipIf(sim is None, "mmradartwin.sim is not built in this workspace")
@unittest.skipIf(SIMULATE is None, "mmradartwin_sim simulate is not built in this workspace")
class Simulator(InFolder):
    """mmradartwin.sim of the office, at two places."""

    @classmethod
    def setUpClass(cls):
        cls.lab = os.path.join(cls.enterClassContext(tempfile.TemporaryDirectory()), "lab")
        make_session(cls.lab, 2, 1)
        cls.session = mmradartwin.open_session(cls.lab)
        cls.twin = sim.Twin.of_session(cls.lab)
        cls.pose = cls.session.poses[0].T_map_radar

    def base(self):
        return sim.Twin(scene=os.path.join(self.lab, "scene.yaml"), radar=os.path.join(self.lab, "radar.yaml"))

    def test_simulate_writes_what_the_twin_says(self):
        for extension in ({}, {"element_pattern": {"cos_exponent": 2.1}, "range_bias": {"range_m": 0.031}}):
            twin_file = self.at("twin.yaml")
            base = {"specular": {"max_bounces": 2}, "corner": {}, "diffuse": {}}
            with open(twin_file, "w", encoding="ascii") as out:
                out.write(f"scene: {self.lab}/scene.yaml\nmechanisms: {json.dumps({**base, **extension})}\n")
            run(SIMULATE, self.lab, "--twin", twin_file, "--output", self.at("out"), "--noise", "none", "--seed", "7", "--force")
            written = mmradartwin.open_session(self.at("out"))
            twin = sim.Twin.of_session(self.lab, twin_file, seed=7)
            scale = 32768 * 10**(written.gain_db / 20)
            for pose in self.session.poses:
                done = twin.simulate(pose.T_map_radar, pose.stamp_ns)
                self.assertEqual(text_of(self.at("out", "paths", pose.name + ".csv")), self.csv(done.paths()))
                x = done.grid.x * scale
                parts = np.stack([x.real, x.imag], -1)
                counts = np.trunc(parts + np.copysign(0.5, parts)).astype(int)                  # [slot * R + rx][N][2]
                expected = written.frames(pose.name).counts[0].transpose(0, 2, 1, 3).reshape(counts.shape)
                np.testing.assert_array_equal(counts, expected)
                self.assertGreater(np.abs(counts).max(), 1000)

    def csv(self, paths):
        rows = ["length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,bounces,"
                "event,actors,materials"]
        for i in range(len(paths)):
            angles = (paths.azimuth_dep_deg, paths.elevation_dep_deg, paths.azimuth_arr_deg, paths.elevation_arr_deg,
                      paths.amplitude_db)
            rows.append(",".join([f"{paths.length_m[i]:.6f}", *(f"{a[i]:.4f}" for a in angles), f"{paths.phase_rad[i]:.6f}",
                                  str(paths.bounces[i]), paths.event[i], ";".join(paths.actors[i]),
                                  ";".join(paths.materials[i])]))
        return "\n".join(rows) + "\n"

    def test_the_grid_is_the_sum_of_its_paths(self):
        done, radar = self.twin.simulate(self.pose), self.session.radar
        self.assertTrue(done.propagation_only)
        t = radar.adc_start_s + np.arange(radar.samples_per_chirp) / radar.sample_rate_hz - radar.window_center_s
        for kind, most in (("points", 1e-11), ("cells", 1e-6)):
            paths = done.paths(kind)
            tone = 2j * np.pi * radar.slope_hz_per_s / 299792458.0 * paths.channel_length_m
            x = np.einsum("pk,pkn->kn", paths.contribution, np.exp(tone[:, :, None] * t))
            self.assertLess(np.linalg.norm(x - done.grid.x) / np.linalg.norm(x), most)
        first = next(i for i, event in enumerate(paths.event) if event == "specular" and paths.bounces[i] == 1)
        way = np.linalg.norm(paths.vertices_m[first][0] - self.pose[:3, 3])
        self.assertAlmostEqual(2 * way, paths.length_m[first], delta=0.02)

    def test_a_changed_parameter_needs_no_new_trace(self):
        traced = self.twin.trace(self.pose)
        np.testing.assert_array_equal(self.twin.weigh(traced).grid.x, self.twin.simulate(self.pose).grid.x)
        other = self.twin.changed({"element_pattern": {"cos_exponent": 3.0}, "noise_floor": {"level_dbfs": -90.0}})
        self.assertEqual(other.mechanisms["element_pattern"]["cos_exponent"], 3.0)
        np.testing.assert_array_equal(other.weigh(traced).grid.x, other.simulate(self.pose).grid.x)
        self.assertGreater(np.abs(other.weigh(traced).grid.x - self.twin.weigh(traced).grid.x).max(), 0)
        again = other.changed({"element_pattern": None, "noise_floor": None})
        self.assertEqual(again.mechanisms, self.twin.mechanisms)
        np.testing.assert_array_equal(again.weigh(traced).grid.x, self.twin.weigh(traced).grid.x)
        for change in ({"specular": {"max_bounces": 1}}, {"radar_yaw_offset": {"yaw_deg": 3.0}}, {"diffuse": None}):
            with self.subTest(change=change), self.assertRaisesRegex(mmradartwin.InputError, "trace\\(\\) again"):
                self.twin.changed(change).weigh(traced)
        with self.assertRaisesRegex(mmradartwin.InputError, "not changed\\(\\) into this one"):
            self.base().weigh(traced)

    def test_a_twin_of_files(self):
        np.testing.assert_array_equal(self.base().simulate(self.pose).grid.x, self.twin.simulate(self.pose).grid.x)
        self.assertEqual(self.base().channels, 8)
        found = self.base().signal_chain().map(self.base().simulate(self.pose).grid)
        self.assertEqual(found.power_db.shape, (64, 64))
        np.testing.assert_array_equal(found.T_map_radar, self.pose)

    def test_errors(self):
        for call, said in ((lambda: self.twin.changed({"mirror": {}}), "Twin.changed\\(\\): key mirror"),
                           (lambda: self.twin.changed({"specular": {"bounces": 1}}), "no such parameter"),
                           (lambda: self.twin.changed({"element_pattern": {"cos_exponent": -99.0}}), "out of range"),
                           (lambda: self.twin.changed({"element_pattern": None}), "no such mechanism to leave out"),
                           (lambda: self.twin.simulate(2 * np.eye(4)), "T_map_radar: is no rotation"),
                           (lambda: self.twin.simulate(np.full((4, 4), np.nan)), "T_map_radar: is no rotation"),
                           (lambda: sim.Twin(scene=os.path.join(self.lab, "scene.yaml")), "no radar is named"),
                           (lambda: sim.Twin(radar=os.path.join(self.lab, "radar.yaml")), "no scene"),
                           (lambda: sim.Twin(self.at("none.yaml")), "none.yaml"),
                           (lambda: self.twin.simulate(self.pose).paths("all"), "diffuse_records")):
            with self.subTest(said=said), self.assertRaisesRegex(mmradartwin.InputError, said):
                call()


if __name__ == "__main__":
    unittest.main()
