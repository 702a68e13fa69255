"""Every hidden effect leaves its own signature, on received grids before noise and on bytes."""
import functools
import math
import os
import tempfile
import types
import unittest

import numpy as np

from mmradartwin_tests import office
from mmradartwin_tests.blind import draws
from mmradartwin_tests.effects import EFFECTS, UNCATALOGUED, make_effect
from mmradartwin_tests.effects.objects import cylinder_path
from mmradartwin_tests.geometry import Actor, Cylinder, Room, sheet
from mmradartwin_tests.session import Measurement, Settings
from mmradartwin_tests.tracing import Pose, Tracer
from catalogue import PROGRAM, shipped_causes

POSES = 5


def measure(*effects, **options):
    """(measurement, received grids) of a small campaign."""
    measurement = Measurement(Settings(output="", jobs=1, effects=list(effects),
                                       **{"seed": 21, "poses": POSES, "frames": 20, **options}))
    received, measurement.rows = measurement.receive()
    return measurement, received


@functools.lru_cache(maxsize=None)
def baseline():
    """(measurement, received grids, echoes) with nothing hidden."""
    measurement, received = measure()
    return measurement, received, [measurement.echoes(s) for s in measurement.stations]


class WithBaseline(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.base, cls.clean, cls.base_echoes = baseline()

    def pair(self, name, **parameters):
        """(effect, measurement, received) with one effect."""
        made = make_effect(name, parameters)
        measurement, received = measure(made)
        return made, measurement, received

    def spectra(self, x):
        window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(64) / 64))
        return np.fft.fft(x * window, axis=1)

    def echoes_of(self, *effects):
        """Echoes of all stations with and without effects (same speckle)."""
        measurement = Measurement(Settings(output="", seed=21, poses=POSES, frames=2, jobs=1, effects=list(effects)))
        return measurement, [(measurement.echoes(s), b) for s, b in zip(measurement.stations, self.base_echoes)]


class Table(WithBaseline):
    @unittest.skipIf(PROGRAM is None, "mmradartwin_sim simulate is not built in this workspace")
    def test_every_cause_that_the_programs_know_can_be_hidden_and_no_other(self):
        with tempfile.TemporaryDirectory() as folder:
            # Poses that are late are hidden in a bag: write_moving_bag.
            self.assertEqual(set(EFFECTS) | {"pose_time_lag"}, shipped_causes(folder))
        self.assertEqual(set(EFFECTS), set(draws.SINGLE) | set(draws.LATER))
        self.assertFalse(set(EFFECTS) & set(UNCATALOGUED))

    def test_unknown_names_are_errors(self):
        with self.assertRaisesRegex(ValueError, "unknown effect"):
            make_effect("nonsense")
        with self.assertRaisesRegex(ValueError, "no parameter"):
            make_effect("range_bias", {"yaw_deg": 1.0})

    def test_no_effect_changes_the_plan_or_the_description(self):
        plain = Measurement(Settings(output="", seed=4, poses=2, frames=2))
        for name in {**EFFECTS, **UNCATALOGUED}:
            measurement = Measurement(Settings(output="", seed=4, poses=2, frames=2, effects=[make_effect(name)]))
            self.assertEqual([s.stamp_ns for s in measurement.stations], [s.stamp_ns for s in plain.stations], msg=name)
            for a, b in zip(measurement.stations, plain.stations):
                np.testing.assert_array_equal(a.reported.position, b.reported.position, err_msg=name)
                np.testing.assert_array_equal(a.reported.rotation, b.reported.rotation, err_msg=name)
            self.assertEqual([a.name for a in measurement.described_actors], [a.name for a in plain.described_actors])
            self.assertEqual(measurement.described_materials, plain.described_materials)


class Receiver(WithBaseline):
    def test_leakage_is_fixed_to_the_body(self):
        made, measurement, received = self.pair("tx_rx_leakage", range_m=0.1, level_db=5.0)
        added = [x - y for x, y in zip(received, self.clean)]
        for a in added[1:]:
            np.testing.assert_allclose(a, added[0], atol=1e-15)
        rms = math.sqrt(np.mean(np.abs(added[0])**2))
        self.assertAlmostEqual(20 * math.log10(rms / measurement.strongest), 5.0, places=9)
        self.assertIn(int(np.abs(self.spectra(added[0])).sum(axis=0).argmax()), (0, 1))

    def test_bias_scale_and_loss_on_paths(self):
        for name, expected in (("range_bias", lambda s: s + 0.06), ("excess_attenuation", lambda s: s)):
            _, pairs = self.echoes_of(make_effect(name))
            for ours, base in pairs:
                np.testing.assert_allclose(ours.lengths_m, expected(base.lengths_m), atol=1e-12)
                gain = 20 * np.log10(np.abs(ours.coefficients / base.coefficients))
                loss = 0.8 * base.lengths_m[:, 0] / 2 if name == "excess_attenuation" else 0.0
                np.testing.assert_allclose(gain, -loss * np.ones(len(gain)), atol=1e-9)

    def test_range_scale_moves_the_beat_frequency(self):
        measurement, _ = self.echoes_of(make_effect("range_scale", {"scale": 0.01}))
        self.assertAlmostEqual(measurement.beat_hz(10.0) / self.base.beat_hz(10.0), 1.01, places=12)
        self.assertEqual(measurement.described_radar.slope_hz_per_s, 75e12)

    def test_carrier_scale_turns_phases_with_the_sine(self):
        measurement, _ = self.echoes_of(make_effect("carrier_scale", {"scale": 0.02}))
        np.testing.assert_allclose(measurement.radar.rx[:, 1], self.base.radar.rx[:, 1] * 1.02)

    def test_highpass_corner_and_catalogue_levels(self):
        made = make_effect("if_highpass", {"corner_hz": 800e3})
        level = lambda f: 20 * math.log10(abs(complex(made.if_response(self.base, f))))
        self.assertAlmostEqual(level(800e3), -3.01, delta=0.01)
        # Codes 175/350 kHz: -28 dB at 0.1 m, -6.4 at 0.5, -2.2 at 1, -0.3 at 3 m.
        made = make_effect("if_highpass", {"corner_hz": 175e3 / math.sqrt((math.sqrt(41) - 5) / 8)})
        for r, expected in ((0.1, -28.0), (0.5, -6.4), (1.0, -2.2), (3.0, -0.3)):
            self.assertAlmostEqual(20 * math.log10(abs(complex(made.if_response(self.base,
                self.base.beat_hz(2 * r))))), expected, delta=0.35)

    def test_lowpass_corner(self):
        made = make_effect("if_lowpass", {"corner_hz": 4e6})
        self.assertAlmostEqual(20 * math.log10(abs(complex(made.if_response(self.base, 4e6)[0]))), -3.01, delta=0.01)
        self.assertAlmostEqual(abs(complex(made.if_response(self.base, 1e5)[0])), 1.0, delta=1e-3)

    def test_drift_follows_time_and_steps_their_order(self):
        made, measurement, received = self.pair("gain_drift", db_per_hour=100.0)
        for s, x, y in zip(measurement.stations, received, self.clean):
            hours = (s.stamp_ns - measurement.stations[0].stamp_ns) / 3.6e12
            np.testing.assert_allclose(x, y * 10**(100 * hours / 20), rtol=1e-12)
        made, measurement, received = self.pair("gain_drift", steps_db=[2.0, -1.0])
        gains = [20 * math.log10(np.abs(x[0, 0] / y[0, 0])) for x, y in zip(received, self.clean)]
        np.testing.assert_allclose(gains, [0, 0, 2, 2, 1], atol=1e-9)

    def test_image_of_iq_imbalance(self):
        made, measurement, received = self.pair("iq_imbalance", image_db=-20.0)
        for x, y in zip(received, self.clean):
            np.testing.assert_allclose(np.abs(x - y), 0.1 * np.abs(y), rtol=1e-9)
            np.testing.assert_allclose((x - y) / np.conj(y), ((x - y) / np.conj(y))[0, 0], rtol=1e-6)

    def test_every_receiver_may_have_an_image_of_its_own(self):
        level_db, phase_deg = [-36.5, -34.7, -28.5, -37.7], [10.0, 100.0, -60.0, 170.0]
        made, measurement, received = self.pair("iq_imbalance", image_db=level_db, phase_deg=phase_deg)
        self.assertEqual(made.truth(measurement), {"image_db": level_db, "phase_deg": phase_deg})
        for k in range(8):
            beta = 10**(level_db[k % 4] / 20) * np.exp(1j * math.radians(phase_deg[k % 4]))
            np.testing.assert_allclose(received[1][k] - self.clean[1][k], beta * np.conj(self.clean[1][k]), rtol=1e-6)

    def test_dc_sits_in_bin_zero(self):
        made, measurement, received = self.pair("dc_offset", level_db=0.0)
        added = np.fft.fft(received[2] - self.clean[2], axis=1)
        self.assertLess(np.abs(added[:, 1:]).max(), 1e-9 * np.abs(added[:, 0]).max())
        self.assertAlmostEqual(math.sqrt(np.mean(np.abs(received[0] - self.clean[0])**2)) / measurement.strongest,
                               1.0, places=9)

    def test_harmonic_at_twice_the_range(self):
        made, measurement, received = self.pair("second_harmonic", level_db=-20.0)
        # At the strongest host: amplitude -20 dB of it, beat doubled; the grids hold all products, so the level is
        # checked on one lone tone.
        class Lone:
            lengths_m = np.full((1, 8), 3.0)
            coefficients = np.array([measurement.strongest + 0j])
        x = made.auxiliary(measurement, measurement.stations[0], Lone) * 10**(-1) / measurement.strongest
        np.testing.assert_allclose(np.abs(x), 0.1 * measurement.strongest, rtol=1e-9)
        step = np.angle(x[0, 1] / x[0, 0]) / (2 * np.pi) * measurement.radar.sample_rate_hz
        self.assertAlmostEqual(step, 2 * measurement.beat_hz(3.0), delta=1.0)

    def test_clipped_share(self):
        made, measurement, received = self.pair("adc_saturation", clipped_fraction=0.01)
        samples = np.concatenate([measurement.measure(i, x).ravel() for i, x in enumerate(received)])
        self.assertAlmostEqual(np.mean((samples == 32767) | (samples == -32768)), 0.01, delta=0.002)

    def test_noise_over_the_stated_level(self):
        made, measurement, received = self.pair("noise_floor", delta_db=6.0)
        stated = measurement.described_mechanisms()["noise_floor"]["level_dbfs"]
        cube = measurement.measure(0, received[0]).astype(float)
        values = cube[..., 0, :] + 1j * cube[..., 1, :]
        spread = values - values.mean(axis=0)
        rms = math.sqrt(np.sum(np.abs(spread)**2) / (19 * 512)) / 32768
        self.assertAlmostEqual(20 * math.log10(rms) - stated, 6.0, delta=0.3)


class Mounting(WithBaseline):
    def relative(self, name, **parameters):
        measurement, _ = self.echoes_of(make_effect(name, parameters))
        for s, b in zip(measurement.stations, self.base.stations):
            turn = b.true.rotation.T @ s.true.rotation
            yield b.true.rotation.T @ (s.true.position - b.true.position), turn

    def test_yaw_is_positive_to_the_left(self):
        for shift, turn in self.relative("radar_yaw_offset", yaw_deg=3.0):
            np.testing.assert_allclose(shift, 0, atol=1e-12)
            self.assertAlmostEqual(math.degrees(math.atan2(turn[1, 0], turn[0, 0])), 3.0, places=9)

    def test_pitch_is_nose_down(self):
        for _, turn in self.relative("radar_pitch_offset", pitch_deg=5.0):
            self.assertAlmostEqual(math.degrees(math.asin(turn[2, 0])), -5.0, places=9)

    def test_offset_in_the_radar_frame(self):
        for shift, _ in self.relative("radar_position_offset", forward_m=0.05, left_m=0.02):
            np.testing.assert_allclose(shift, [0.05, 0.02, 0], atol=1e-12)

    def test_registration_moves_the_room(self):
        measurement, _ = self.echoes_of(make_effect("scene_registration", {"x_m": 0.1, "y_m": 0.0, "yaw_deg": 90.0}))
        window = lambda room: room.center(np.flatnonzero(room.actor == room.actor_index("window"))[0])
        x, y, z = window(self.base.room)
        np.testing.assert_allclose(window(measurement.room), [-y + 0.1, x, z], atol=1e-9)


    def test_a_scan_too_large_shows_the_true_room_smaller(self):
        # The wall at x = 8 m stands at 7.92 m, and the radar where it stood: 8 cm nearer. Of a wall at x = 0, none.
        measurement, pairs = self.echoes_of(make_effect("scene_scale", {"scale": -0.01}))
        wall = lambda room, name: room.center(np.flatnonzero(room.actor == room.actor_index(name))[0])
        np.testing.assert_allclose(wall(measurement.room, "wall_east"), 0.99 * wall(self.base.room, "wall_east"))
        for name in ("wall_east", "wall_west"):
            shifts = []
            for (now, before), station in zip(pairs, measurement.stations):
                index = measurement.room.actor_index(name)
                first = lambda echoes, actor=index: [p for p in echoes.paths if list(p.actors) == [actor]]
                if first(now) and first(before):
                    shifts.append(first(now)[0].lengths_m[0] / 2 - first(before)[0].lengths_m[0] / 2)
            np.testing.assert_allclose(shifts, -0.08 if name == "wall_east" else 0, atol=1e-9, err_msg=name)


class Array(WithBaseline):
    def test_channel_errors_are_the_same_everywhere(self):
        made, measurement, received = self.pair("channel_phase_error")
        expected = 10**(np.array(made.p["gain_db"]) / 20) * np.exp(1j * np.radians(made.p["phase_deg"]))
        self.assertEqual((made.p["gain_db"][0], made.p["phase_deg"][0]), (0.0, 0.0))
        for x, y in zip(received, self.clean):
            np.testing.assert_allclose(x / y, np.repeat(expected[:, None], 64, axis=1), rtol=1e-9)

    def test_second_transmitter(self):
        made, measurement, received = self.pair("tx_imbalance", phase_deg=30.0, gain_db=-2.0)
        np.testing.assert_allclose(received[0][:4], self.clean[0][:4])
        np.testing.assert_allclose(received[0][4:] / self.clean[0][4:], 10**(-0.1) * np.exp(1j * math.pi / 6),
                                   rtol=1e-9)

    def test_discrete_conventions(self):
        self.assertTrue(np.array_equal(self.pair("iq_conjugation")[2][0], np.conj(self.clean[0])))
        self.assertTrue(np.array_equal(self.pair("channel_conjugation")[2][0], self.clean[0][::-1]))
        order = [4, 5, 6, 7, 0, 1, 2, 3]
        _, _, received = self.pair("channel_permutation", order=order)
        for place, channel in enumerate(order):
            np.testing.assert_array_equal(received[0][place], self.clean[0][channel])

    def test_pattern_counts_both_legs(self):
        measurement, pairs = self.echoes_of(make_effect("element_pattern", {"cos_exponent": 2.0}))
        for station, (ours, base) in zip(measurement.stations, pairs):
            for path, a, b in zip(ours.paths, ours.coefficients, base.coefficients):
                cosine = []
                for d in (path.departure, path.arrival):
                    d = station.true.to_radar(d)
                    cosine.append(math.cos(math.atan2(d[1], d[0])))
                self.assertAlmostEqual(abs(a / b), cosine[0] * cosine[1], places=9)   # two-way power cos^2 cos^2


class Surfaces(WithBaseline):
    def test_reflectivity_per_interaction(self):
        measurement, pairs = self.echoes_of(make_effect("material_reflectivity",
                                                        {"material": "Concrete", "delta_db": -6.0}))
        for ours, base in pairs:
            for path, a, b in zip(ours.paths, ours.coefficients, base.coefficients):
                count = sum(measurement.room.actors[i].tag == "Concrete" for i in path.actors)
                self.assertAlmostEqual(20 * math.log10(abs(a / b)), -6.0 * count, places=9)
            concrete = np.array([measurement.room.actors[i].tag == "Concrete" for i in ours.scatter.actor])
            np.testing.assert_allclose(np.abs(ours.scatter_coefficients / base.scatter_coefficients),
                                       np.where(concrete, 10**-0.3, 1.0))

    def test_roughness_at_normal_incidence(self):
        # sigma 0.3 mm at 77.93 GHz: 20 log10 exp(-2 (k sigma)^2)
        measurement, pairs = self.echoes_of(make_effect("surface_roughness",
                                                        {"material": "Concrete", "roughness_rms_m": 3e-4}))
        k = 2 * math.pi / measurement.radar.wavelength_m
        seen = 0
        for ours, base in pairs:
            for path, a, b in zip(ours.paths, ours.coefficients, base.coefficients):
                if len(path.actors) == 1:
                    rough = measurement.room.actors[path.actors[0]].tag == "Concrete"
                    seen += rough
                    self.assertAlmostEqual(abs(a / b), math.exp(-2 * (k * 3e-4)**2) if rough else 1.0, places=9)
        self.assertGreater(seen, 3)

    def test_scattering_takes_from_the_specular(self):
        measurement, pairs = self.echoes_of(make_effect("diffuse_scattering",
                                                        {"material": "Wood", "scattering_coefficient": 0.6}))
        more = sum(len(o.scatter.phase) - len(b.scatter.phase) for o, b in pairs)
        self.assertGreater(more, 100)
        for ours, base in pairs:
            for path, a, b in zip(ours.paths, ours.coefficients, base.coefficients):
                count = sum(measurement.room.actors[i].tag == "Wood" for i in path.actors)
                self.assertAlmostEqual(abs(a / b), 0.8**count, places=9)


class Objects(WithBaseline):
    def test_cylinder_level_and_place(self):
        made = make_effect("actor_unmodelled", {"size_m": 0.2})
        measurement, pairs = self.echoes_of(made)
        seen = 0
        for station, (ours, _) in zip(measurement.stations, pairs):
            for path, c, lengths in zip(ours.paths, ours.coefficients, ours.lengths_m):
                if path.facets == (-1,):
                    seen += 1
                    center = np.array([made.p["x_m"], made.p["y_m"]])
                    r = np.hypot(*(center - station.true.position[:2])) - 0.1
                    self.assertAlmostEqual(path.length_m, 2 * r, delta=1e-6)
                    # Conductor in metres: sigma of a cylinder 2 pi a L^2/lambda in the far field of its curvature; here
                    # the height holds many zones: lambda/(8 pi r) sqrt(a/(a + r)) within the aperture's ripple.
                    level = measurement.radar.wavelength_m / (8 * math.pi * r) * math.sqrt(0.1 / (0.1 + r))
                    self.assertAlmostEqual(20 * math.log10(abs(c) / level), 0.0, delta=1.6)
        self.assertGreater(seen, 0)
        self.assertEqual(measurement.described_actors[-1].name, office.build_actors()[-1].name)

    def test_cylinder_far_field_cross_section(self):
        # A short cylinder far away: 2 pi a L^2 / lambda.
        part = Cylinder(np.array([40.0, 0, 0]), 0.05, 0.1)
        radar = self.base.radar
        room = Room([Actor("behind", "Metal", [sheet((90, -1, -1), (0, 2, 0), (0, 0, 2))]),
                     Actor("object", "Metal", [part])],
                    office.MATERIALS)
        bare = types.SimpleNamespace(radar=radar, room=room, tracer=Tracer(room, radar))
        at = types.SimpleNamespace(true=Pose([0, 0, 0], np.eye(3)))
        path = cylinder_path(bare, at, 1, part, office.MATERIALS["Metal"], "specular")
        r, wavelength = 40.0 - 0.05, radar.wavelength_m
        sigma = abs(path.coefficient)**2 * (4 * math.pi)**3 * r**4 / wavelength**2
        self.assertAlmostEqual(10 * math.log10(sigma), 10 * math.log10(2 * math.pi * 0.05 * 0.1**2 / wavelength),
                               delta=0.15)

    def test_absent_and_moved(self):
        measurement, pairs = self.echoes_of(make_effect("actor_absent", {"actor": "whiteboard"}))
        self.assertNotIn("whiteboard", [a.name for a in measurement.room.actors])
        self.assertIn("whiteboard", [a.name for a in measurement.described_actors])
        made = make_effect("actor_moved", {"actor": "pillar", "dx_m": 0.1, "dy_m": -0.05, "dyaw_deg": 3.0})
        measurement, _ = self.echoes_of(made)
        find = lambda actors: next(a for a in actors if a.name == "pillar")
        np.testing.assert_allclose(find(measurement.room.actors).centroid()
                                   - find(measurement.described_actors).centroid(), [0.1, -0.05, 0], atol=1e-9)

    def test_a_screen_leans_by_roll_then_pitch_then_yaw(self):
        values = {"actor": "tv", "dx_m": 0.1, "dy_m": 0.0, "dz_m": -0.2, "dyaw_deg": 10.0, "dpitch_deg": 5.0,
                  "droll_deg": 3.0}
        measurement, _ = self.echoes_of(make_effect("actor_moved", values))
        self.assertEqual(make_effect("actor_moved", values).truth(measurement), values)
        before, after = (next(a for a in actors if a.name == "tv")
                         for actors in (measurement.described_actors, measurement.room.actors))
        np.testing.assert_allclose(after.centroid() - before.centroid(), [0.1, 0, -0.2], atol=1e-9)
        turn = after.parts[0].rotation @ before.parts[0].rotation.T
        self.assertAlmostEqual(math.degrees(math.atan2(turn[1, 0], turn[0, 0])), 10, places=9)
        self.assertAlmostEqual(math.degrees(math.asin(-turn[2, 0])), 5, places=9)
        self.assertAlmostEqual(math.degrees(math.atan2(turn[2, 1], turn[2, 2])), 3, places=9)


class Propagation(WithBaseline):
    def added(self, name, **parameters):
        """(station, added path, its coefficient) over all poses of a longer campaign."""
        made = make_effect(name, parameters)
        measurement = Measurement(Settings(output="", seed=21, poses=30, frames=1, jobs=1, effects=[made]))
        for station in measurement.stations:
            echoes = measurement.echoes(station)
            for path, c in zip(echoes.paths, echoes.coefficients):
                if path.event == name:
                    yield measurement, station, path, c

    def test_edges_keep_their_place(self):
        found = list(self.added("edge_diffraction"))
        self.assertGreater(len(found), 40)
        for measurement, station, path, c in found:
            r = path.length_m / 2
            # Between 20 and 60 dB below a metal wall at the same range.
            self.assertLess(abs(c), 0.2 * measurement.radar.wavelength_m / (8 * math.pi * r))

    def test_floor_paths_depend_on_height(self):
        found = list(self.added("floor_ceiling_multipath"))
        self.assertGreater(len(found), 5)
        third = [(m, p) for m, _, p, _ in found if len(p.facets) == 3]
        self.assertTrue(third)
        for measurement, path in third:
            self.assertFalse(measurement.room.reflects[list(path.facets)].all())
        for measurement, station, path, _ in found:
            if len(path.facets) > 2:
                continue
            height = station.true.position[2]
            rise = height if path.vertices[0][2] < 1 else office.HEIGHT_M - height
            ground = np.hypot(*(path.vertices[0] - station.true.position)[:2])
            self.assertAlmostEqual(path.length_m, 2 * math.hypot(ground, rise), places=9)
            self.assertLessEqual(abs(station.true.to_radar(path.departure)[2]), math.sin(math.radians(20)))

    def test_corner_of_cabinet_and_wall(self):
        for measurement, station, path, _ in self.added("corner_reflection"):
            self.assertAlmostEqual(path.vertices[0][1], office.WIDTH_M, places=9)
            self.assertEqual([measurement.room.actors[a].name for a in path.actors], ["cabinet_north", "wall_north"])

    def test_ghosts_come_in_reciprocal_pairs(self):
        found = list(self.added("wall_ghost", walls="wall_north;wall_south;wall_west"))
        self.assertGreater(len(found), 10)
        for (_, _, a, ca), (_, _, b, cb) in zip(found[::2], found[1::2]):
            np.testing.assert_array_equal(a.departure, b.arrival)
            self.assertEqual((ca, a.length_m), (cb, b.length_m))
            self.assertAlmostEqual(a.lengths_m[0], b.lengths_m[0], places=9)
            self.assertAlmostEqual(a.lengths_m[0], a.length_m, places=9)

    def test_transmission_counts_crossings(self):
        made = make_effect("transmission", {"actor": "partition", "one_way_db": -3.0})
        measurement, pairs = self.echoes_of(made)
        more = 0
        for station, (ours, base) in zip(measurement.stations, pairs):
            known = {p.facets: c for p, c in zip(base.paths, base.coefficients)}
            for path, c in zip(ours.paths, ours.coefficients):
                if path.facets in known:
                    self.assertAlmostEqual(abs(c), abs(known[path.facets]), delta=1e-15)
                else:
                    more += 1
            more += len(ours.scatter.phase) - len(base.scatter.phase)
        self.assertGreater(more, 100)


class Frames(WithBaseline):
    def frames(self, name, index=0, **parameters):
        made = make_effect(name, parameters)
        measurement, received = measure(made, frames=100, poses=POSES)
        x = np.broadcast_to(received[index], (100, *received[index].shape))
        return made, measurement, received, np.asarray(made.frames(measurement, index, measurement.stations[index], x,
                                                                   np.random.default_rng(5)))

    def test_mover_makes_frames_disagree_at_its_range(self):
        made = make_effect("moving_target", {"rcs_dbsm": 5.0})
        measurement, received = measure(made, frames=100)
        seen = 0
        for i, station in enumerate(measurement.stations):
            x = np.broadcast_to(received[i], (100, 8, 64))
            frames = np.asarray(made.frames(measurement, i, station, x, np.random.default_rng(5)))
            spread = (frames - frames.mean(axis=0)).reshape(-1, 64)
            if np.abs(spread).max() > 1e-3 * np.abs(frames).max():
                seen += 1
                power = (np.abs(self.spectra(spread))**2).sum(axis=0)
                r = np.linalg.norm([made.p["x_m"], made.p["y_m"], 1.1] - station.true.position)
                self.assertLess(abs(power.argmax() * measurement.radar.range_bin_m - r), 0.5)
        self.assertGreater(seen, 0)

    def test_interference_in_some_frames_rank_one(self):
        _, measurement, received, frames = self.frames("interference", frame_fraction=0.2)
        hit = np.flatnonzero(np.abs(frames - received[0]).max(axis=(1, 2)) > 0)
        self.assertTrue(8 <= len(hit) <= 34)
        block = (frames[hit[0]] - received[0])[:4]
        values = np.linalg.svd(block, compute_uv=False)
        self.assertLess(values[1], 1e-9 * values[0])

    def test_drift_shrinks_the_mean(self):
        _, _, received, frames = self.frames("phase_drift", rad_per_frame=0.03)
        expected = abs(math.sin(100 * 0.015) / (100 * math.sin(0.015)))
        np.testing.assert_allclose(np.abs(frames.mean(axis=0)), expected * np.abs(received[0]), rtol=1e-9)

    def test_lost_packets_are_zeros_on_packet_borders(self):
        made = make_effect("packet_loss", {"lost_fraction": 0.2})
        payload = bytes([7]) * (2048 * 50)
        lost = made.payload(None, 0, None, payload, np.random.default_rng(2))
        self.assertEqual(len(lost), len(payload))
        zero = [i for i in range(0, len(lost), 1456) if lost[i:i + 1456] == bytes(len(lost[i:i + 1456]))]
        self.assertEqual(sum(b == 0 for b in lost), sum(len(lost[i:i + 1456]) for i in zero))
        self.assertTrue(5 <= len(zero) <= 25)

    def test_slipped_packet_keeps_the_file_whole(self):
        made = make_effect("packet_misalignment", {"pose": "002"})
        measurement, received = measure(made, frames=10)
        payload = measurement.measure(1, received[1]).tobytes()
        slipped = made.payload(measurement, 1, measurement.stations[1], payload, np.random.default_rng(2))
        self.assertEqual(len(slipped), len(payload))
        first = next(i for i in range(len(payload)) if slipped[i] != payload[i])
        start = first // 1456 * 1456
        self.assertEqual(slipped[start:-1456], payload[start + 1456:])
        self.assertEqual(made.payload(measurement, 0, measurement.stations[0], payload, None), payload)


class OutsideTheCatalogue(WithBaseline):
    def test_there_are_enough_and_none_has_a_catalogue_name(self):
        self.assertGreaterEqual(len(UNCATALOGUED), 8)
        self.assertFalse(set(UNCATALOGUED) & set(EFFECTS))

    def gains(self, name, **parameters):
        """(station, path, gain in dB) over all paths of the baseline."""
        measurement, pairs = self.echoes_of(make_effect(name, parameters))
        for station, (ours, base) in zip(measurement.stations, pairs):
            for path, a, b in zip(base.paths, ours.coefficients, base.coefficients):
                yield station, path, 20 * math.log10(abs(a / b))

    def test_laws_follow_their_variable(self):
        for _, path, gain in self.gains("range_ripple", ripple_db=3.0, period_m=2.0):
            self.assertAlmostEqual(gain, 3.0 * math.sin(math.pi * path.lengths_m[0] / 2.0), places=6)
        for station, _, gain in self.gains("height_gain", db_per_m=10.0):
            self.assertAlmostEqual(gain, 10.0 * (station.true.position[2] - 1.1), places=6)
        for _, path, gain in self.gains("compass_gain", swing_db=2.0, toward_deg=0.0):
            self.assertAlmostEqual(gain, 2.0 * math.cos(math.atan2(path.arrival[1], path.arrival[0])), places=6)
        for station, path, gain in self.gains("bracket_shadow", loss_db=5.0, from_deg=0.0, to_deg=90.0):
            left = sum(station.true.to_radar(d)[1] > 0 for d in (path.departure, path.arrival))
            self.assertAlmostEqual(gain, -5.0 * left, places=6)
        for _, path, gain in self.gains("compression", strength=1.0, reference=abs(1e-5)):
            self.assertAlmostEqual(gain, -20 * math.log10(1 + abs(path.coefficient) / 1e-5), places=6)

    def test_laws_of_time_and_channels(self):
        measurement, pairs = self.echoes_of(make_effect("transmitter_skew", {"deg_per_m": 20.0}))
        for ours, base in pairs:
            phase_deg = 360 * (ours.lengths_m - base.lengths_m) / measurement.radar.wavelength_m
            np.testing.assert_allclose(phase_deg[:, :4], 0, atol=1e-9)
            np.testing.assert_allclose(phase_deg[:, 4:], np.tile(10 * base.lengths_m[:, :1], 4), rtol=1e-9)
        measurement, pairs = self.echoes_of(make_effect("warm_up_squint", {"squint_deg": 3.0, "share_of_session": 1.0}))
        for station, share in ((0, 1.0), (-1, math.exp(-1))):
            ours, base = pairs[station]
            true = measurement.stations[station].true
            for i, path in enumerate(base.paths):
                if not np.allclose(path.departure, path.arrival):
                    continue
                # From channel 0 to 7 an echo at azimuth a stands y cos(e) (sin(a) - sin(a + squint)) farther.
                x, y, _ = true.to_radar(path.departure)
                angle, squint = math.atan2(y, x), math.radians(3 * share)
                extra = (ours.lengths_m - base.lengths_m)[i]
                aperture_m = measurement.radar.tx[1, 1] + measurement.radar.rx[3, 1]
                self.assertAlmostEqual(extra[7] - extra[0], aperture_m * math.hypot(x, y) *
                                       (math.sin(angle) - math.sin(angle + squint)), places=9)
        gains = list(self.gains("drying_wall", actor="wall_east", rise_db=8.0))
        first, last = gains[0][0].stamp_ns, gains[-1][0].stamp_ns
        for station, path, gain in gains:
            along = (station.stamp_ns - first) / (last - first)
            met = measurement.described_room.actor_index("wall_east") in path.actors
            self.assertAlmostEqual(gain, 8 * (along - 0.5) if met else 0, places=6)

    def test_range_bump_is_a_parabola(self):
        inside = 0
        for _, path, gain in self.gains("range_bump", bump_db=5.0, center_m=3.0, half_width_m=1.5):
            away = (path.lengths_m[0] / 2 - 3.0) / 1.5
            inside += abs(away) < 1
            self.assertAlmostEqual(gain, 5.0 * (1 - away**2) if abs(away) < 1 else 0.0, places=6)
        self.assertGreater(inside, 3)

    def test_oblique_echoes_rise(self):
        oblique = 0
        for _, path, gain in self.gains("incidence_gain", rise_db=8.0):
            if len(path.actors) == 1 and path.event == "specular":
                self.assertAlmostEqual(gain, 0.0, delta=0.3)    # they meet their face upright, or at its rim
            sine = math.sqrt(max(0.0, 1 - path.cosines[0]**2))
            oblique += sine > 0.3
            self.assertAlmostEqual(gain, 8.0 * sine**2, places=6)
        self.assertGreater(oblique, 3)
        _, pairs = self.echoes_of(make_effect("incidence_gain", {"rise_db": 8.0}))
        for station, (ours, base) in zip(self.base.stations, pairs):
            ray = base.scatter.points - station.true.position
            cosine = np.sum(ray * self.base.room.normal[base.scatter.facet], axis=1) / np.linalg.norm(ray, axis=1)
            np.testing.assert_allclose(20 * np.log10(np.abs(ours.scatter_coefficients / base.scatter_coefficients)),
                                       8.0 * (1 - cosine**2), atol=1e-9)

    def test_delay_over_azimuth(self):
        measurement, pairs = self.echoes_of(make_effect("lens_delay", {"side_m": 0.1}))
        for station, (ours, base) in zip(measurement.stations, pairs):
            for path, before, after in zip(base.paths, base.lengths_m, ours.lengths_m):
                middle = np.mean([math.atan2(d[1], d[0]) for d in map(station.true.to_radar,
                                                                      (path.departure, path.arrival))])
                np.testing.assert_allclose(after - before, 0.2 * math.sin(middle)**2, atol=1e-12)
            ray = station.true.to_radar(base.scatter.points - station.true.position)
            sine = np.sin(np.arctan2(ray[:, 1], ray[:, 0]))
            np.testing.assert_allclose((ours.scatter.lengths_m - base.scatter.lengths_m)[:, 3], 0.2 * sine**2,
                                       atol=1e-12)

    def test_delay_over_time(self):
        measurement, pairs = self.echoes_of(make_effect("delay_creep", {"total_m": 0.08}))
        stamps = [s.stamp_ns for s in measurement.stations]
        for stamp, (ours, base) in zip(stamps, pairs):
            expected = 0.16 * (stamp - stamps[0]) / (stamps[-1] - stamps[0])
            np.testing.assert_allclose(ours.lengths_m - base.lengths_m, expected, atol=1e-12)
            np.testing.assert_allclose(ours.scatter.lengths_m - base.scatter.lengths_m, expected, atol=1e-12)

    def test_hollow_actor_has_a_second_face(self):
        made = make_effect("layered_panel", {"actor": "wall_west", "depth_m": 0.1, "level": 0.5})
        measurement, pairs = self.echoes_of(made)
        wall, seen = measurement.room.actor_index("wall_west"), 0
        for ours, base in pairs:
            hit = [i for i, p in enumerate(base.paths) if wall in p.actors]
            n, seen = len(base.paths), seen + len(hit)
            self.assertEqual(len(ours.coefficients), n + len(hit))
            np.testing.assert_array_equal(ours.coefficients[:n], base.coefficients)
            np.testing.assert_allclose(ours.lengths_m[n:], base.lengths_m[hit] + 0.2)
            np.testing.assert_allclose(np.abs(ours.coefficients[n:]), 0.5 * np.abs(base.coefficients[hit]))
        self.assertGreater(seen, 0)
        truth = made.truth(measurement)
        self.assertEqual((truth["x_m"], truth["y_m"]), (0.0, office.WIDTH_M / 2))

    def test_damp_spot_takes_from_what_passes_it(self):
        for station, path, gain in self.gains("damp_spot", x_m=4.0, y_m=3.0, radius_m=1.0, loss_db=8.0):
            chain = np.concatenate([[station.true.position], path.vertices, [station.true.position]])[:, :2]
            along = np.linspace(0, 1, 2001)[:, None]
            miss = [np.min(np.linalg.norm(a + along * (b - a) - [4.0, 3.0], axis=1))
                    for a, b in zip(chain[:-1], chain[1:])]
            self.assertAlmostEqual(gain, -4.0 * sum(math.exp(-2 * m**2) for m in miss), delta=0.01)

    def test_tilted_panel_hangs_into_the_room(self):
        for name in ("tv", "whiteboard", "window"):
            made = make_effect("tilted_panel", {"actor": name, "tilt_deg": 4.0})
            measurement, _ = self.echoes_of(made)
            find = lambda actors, name=name: next(a for a in actors if a.name == name).parts[0]
            plain, tilted = find(measurement.described_actors), find(measurement.room.actors)
            corners = lambda part: np.array([r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2
                                             for r in part.rectangles() for a in (0, 1) for b in (0, 1)])
            inward = lambda p: min(np.abs(p[:, 0]).min(), np.abs(p[:, 1]).min(),
                                   np.abs(office.LENGTH_M - p[:, 0]).min(), np.abs(office.WIDTH_M - p[:, 1]).min())
            self.assertAlmostEqual(inward(corners(tilted)), inward(corners(plain)), delta=0.002, msg=name)
            shift = np.linalg.norm(tilted.center - plain.center)
            reach = math.hypot(plain.size[2], plain.size[:2].min()) / 2     # of the centre about its hinge
            self.assertAlmostEqual(shift, 2 * reach * math.sin(math.radians(2.0)), places=6, msg=name)
            others = lambda actors, name=name: [a.centroid() for a in actors if a.name != name]
            np.testing.assert_allclose(others(measurement.room.actors), others(measurement.described_actors))

    def test_no_strength_is_no_effect(self):
        plain, clean = measure(poses=1)
        for name in UNCATALOGUED:
            made = make_effect(name)
            made.scale(0.0)
            measurement, received = measure(made, poses=1)
            np.testing.assert_allclose(received[0], clean[0], atol=1e-9 * np.abs(clean[0]).max(), err_msg=name)
            changed = measurement.measure(0, received[0]).astype(int) - plain.measure(0, clean[0])
            self.assertLessEqual(np.abs(changed).max(), 1, msg=name)    # roundings may fall to the other side

    def test_strength_of_a_level_is_of_its_amplitude(self):
        made = make_effect("trailing_echo", {"level_db": -12.0}, 2.0)
        self.assertAlmostEqual(made.p["level_db"], -12.0 + 6.0206, places=3)
        made = make_effect("radome_ripple", {"ripple_db": 2.0}, 2.0)
        self.assertEqual(made.p["ripple_db"], 4.0)

    def test_trailing_copies(self):
        measurement, pairs = self.echoes_of(make_effect("trailing_echo", {"level_db": -10.0, "delay_m": 0.5}))
        for ours, base in pairs:
            n = len(base.paths)
            self.assertEqual(len(ours.coefficients), 2 * n)
            np.testing.assert_allclose(ours.lengths_m[n:], base.lengths_m + 1.0)
            np.testing.assert_allclose(np.abs(ours.coefficients[n:] / base.coefficients), 10**-0.5)

    def test_grids_and_frames_change(self):
        plain, clean = measure(poses=2)
        for name in UNCATALOGUED:
            # Of the panels these two poses see the window.
            made = make_effect(name, {"actor": "window"} if name == "tilted_panel" else {})
            measurement, received = measure(made, poses=2)
            changed = [not np.array_equal(measurement.measure(i, received[i]), plain.measure(i, clean[i]))
                       for i in range(2)]
            self.assertTrue(any(changed), msg=name)


class Pairs(unittest.TestCase):
    def test_two_effects_at_once(self):
        a, b = make_effect("range_bias", {"range_m": 0.02}), make_effect("tx_imbalance")
        measurement, received = measure(a, b)
        self.assertEqual([e.name for e in measurement.settings.effects], ["range_bias", "tx_imbalance"])

    def test_session_with_effect_is_written(self):
        with tempfile.TemporaryDirectory() as directory:
            settings = Settings(output=os.path.join(directory, "s"), seed=2, poses=2, frames=2,
                                effects=[make_effect("noise_floor")],
                                truth=os.path.join(directory, "t.json"))
            Measurement(settings).run()
            with open(os.path.join(directory, "s", "twin.yaml"), encoding="ascii") as file:
                self.assertIn("noise_floor: {level_dbfs:", file.read())


if __name__ == "__main__":
    unittest.main()
