"""What a trial hides: effects of one row of the protocol and their strengths, drawn from the trial's own seed.

Strengths are those that physics allows (docs/reference/causes.md) and, where the catalogue tells how small an effect can
be found, at least twice that. Everything follows from (row, tier, seed, trial), so that a trial can be repeated.
"""
import dataclasses
import hashlib
import math

import numpy as np

from mmradartwin_tests.effects import UNCATALOGUED
from mmradartwin_tests.effects.objects import FURNITURE, MOVABLE

MATERIALS = ("Concrete", "Metal", "Glass", "Wood")
CORNERS = ("cabinet_north;wall_north", "bookshelf;wall_east")
PLACES = 22         # of a whole campaign
DISCRETE = ("iq_conjugation", "channel_conjugation", "channel_permutation")


@dataclasses.dataclass(frozen=True)
class Trial:
    """The key of a trial and its campaign."""
    row: str
    tier: str
    seed: int
    trial: int
    poses: int = 44
    frames: int = 20

    def key(self):
        """Name of the trial in ledger and results; says nothing about what is hidden."""
        return f"{self.row}-{self.tier}-{self.poses}x{self.frames}-{self.seed}-{self.trial}"

    def session_seed(self):
        """Of the session's poses, noise and all that effects draw by themselves."""
        return int.from_bytes(hashlib.sha256(self.key().encode()).digest()[:4], "little") >> 1

    def rng(self):
        """Of effects and strengths."""
        return np.random.default_rng([self.session_seed(), 77])

    def hours(self):
        """About how long the campaign takes: frames, and pauses of 8 s between poses and of 24 s between places."""
        return (self.poses * (self.frames * 0.05 + 8.0) + min(PLACES, self.poses) * 24.0) / 3600

    def headings(self):
        """At a place: as many places as there are come first, since what differs from place to place limits all."""
        return -(-self.poses // PLACES)


def sign(rng):
    """-1 or 1."""
    return float(rng.choice([-1.0, 1.0]))


def direction(rng, low, high):
    """A vector of the plane in any direction, its length between two bounds."""
    angle, size = rng.uniform(0, 2 * math.pi), rng.uniform(low, high)
    return size * math.cos(angle), size * math.sin(angle)


def uniform(parameter, low, high, either_sign=False):
    """Draw of one number."""
    def draw(rng, trial):
        value = float(rng.uniform(low, high))
        return {parameter: value * sign(rng) if either_sign else value}
    return draw


def logarithmic(parameter, low, high):
    """Draw of one positive number, even in its logarithm."""
    return lambda rng, trial: {parameter: float(math.exp(rng.uniform(math.log(low), math.log(high))))}


def nothing(rng, trial):
    """The effect draws the rest by itself, or has no strength."""
    return {}


def gain_drift(rng, trial):
    """A rate that changes the gain by 2 to 5 dB over the campaign, or one step of the run-time calibration."""
    if rng.random() < 0.5:
        return {"db_per_hour": sign(rng) * float(rng.uniform(2.0, 5.0)) / trial.hours()}
    return {"steps_db": [sign(rng) * float(rng.uniform(2.0, 4.0))]}


def position_offset(rng, trial):
    """Centimetres in any direction."""
    forward, left = direction(rng, 0.03, 0.08)
    return {"forward_m": forward, "left_m": left}


def registration(rng, trial):
    """Centimetres in any direction and a fraction of a degree."""
    x, y = direction(rng, 0.04, 0.10)
    return {"x_m": x, "y_m": y, "yaw_deg": sign(rng) * float(rng.uniform(0.2, 0.8))}


def channel_errors(rng, trial):
    """Phases and gains of usual scatter."""
    return {"rms_deg": float(rng.uniform(8, 15)), "rms_db": float(rng.uniform(0.3, 0.9))}


def tx_imbalance(rng, trial):
    """Phase and gain of the second transmitter."""
    return {"phase_deg": sign(rng) * float(rng.uniform(12, 40)), "gain_db": sign(rng) * float(rng.uniform(0.4, 2))}


def permutation(rng, trial):
    """Receivers in another order, the same for both transmitters as wrong lanes make it, or both blocks swapped."""
    if rng.random() < 0.2:
        return {"order": [4, 5, 6, 7, 0, 1, 2, 3]}
    while True:
        order = [int(i) for i in rng.permutation(4)]
        if order != [0, 1, 2, 3]:
            return {"order": order + [4 + i for i in order]}


def reflectivity(rng, trial):
    """A material, which several actors have; single actors scatter too much for few poses (docs/reference/causes.md, section 6)."""
    delta_db = float(rng.uniform(-12, -8)) if rng.random() < 0.6 else float(rng.uniform(6, 9))
    return {"material": str(rng.choice(MATERIALS)), "delta_db": delta_db}


def roughness(rng, trial):
    """4 to 11 dB of loss at normal incidence."""
    return {"material": str(rng.choice(["Concrete", "Wood", "Glass"])),
            "roughness_rms_m": float(rng.uniform(3e-4, 5e-4))}


def scattering(rng, trial):
    """Smooth in the twin, rough in the room."""
    return {"material": str(rng.choice(["Wood", "Glass", "TableTop"])),
            "scattering_coefficient": float(rng.uniform(0.4, 0.7))}


def moved(rng, trial):
    """Some handbreadths into the room."""
    return {"distance_m": float(rng.uniform(0.12, 0.35)), "dyaw_deg": float(rng.normal(0, 1.5))}


def unmodelled(rng, trial):
    """A metal cylinder or box on a free spot."""
    return {"size_m": float(rng.uniform(0.2, 0.5)), "shape": str(rng.choice(["cylinder", "box"]))}


def walker(rng, trial):
    """A person."""
    return {"speed_m_per_s": float(rng.uniform(0.3, 1.2)), "rcs_dbsm": float(rng.uniform(-5, 4))}


SINGLE = {
    "tx_rx_leakage": lambda rng, trial: {"range_m": float(rng.uniform(0.03, 0.15)),
                                         "level_db": float(rng.uniform(-6, 12))},
    "range_bias": uniform("range_m", 0.03, 0.10),
    "range_scale": uniform("scale", 0.005, 0.012, either_sign=True),
    "carrier_scale": uniform("scale", 0.012, 0.03, either_sign=True),
    "if_highpass": logarithmic("corner_hz", 600e3, 2000e3),
    "if_lowpass": uniform("corner_hz", 2.2e6, 3.6e6),
    "excess_attenuation": uniform("db_per_m", 0.7, 2.0),
    "gain_drift": gain_drift,
    "iq_imbalance": uniform("image_db", -27, -18),
    "dc_offset": uniform("level_db", -15, 3),
    "second_harmonic": uniform("level_db", -24, -15),
    "adc_saturation": logarithmic("clipped_fraction", 0.002, 0.02),
    "noise_floor": uniform("delta_db", 3, 9),
    "radar_yaw_offset": uniform("yaw_deg", 1.0, 4.0, either_sign=True),
    "radar_position_offset": position_offset,
    "scene_registration": registration,
    "radar_pitch_offset": uniform("pitch_deg", 4, 9, either_sign=True),
    "channel_phase_error": channel_errors,
    "tx_imbalance": tx_imbalance,
    "iq_conjugation": nothing,
    "channel_conjugation": nothing,
    "channel_permutation": permutation,
    "element_pattern": uniform("cos_exponent", 1.2, 3.0),
    "elevation_pattern": uniform("cos_exponent", 10, 30),
    "material_reflectivity": reflectivity,
    "surface_roughness": roughness,
    "diffuse_scattering": scattering,
    "edge_diffraction": uniform("level", 1.0, 2.0),
    "floor_ceiling_multipath": uniform("level", 0.8, 1.2),
    "corner_reflection": lambda rng, trial: {"actors": str(rng.choice(CORNERS))},
    "wall_ghost": uniform("gain_db", 10, 18),
    "transmission": uniform("one_way_db", -4, -1),
    "actor_absent": nothing,
    "actor_unmodelled": unmodelled,
    "actor_moved": moved,
    "moving_target": walker,
    "interference": uniform("frame_fraction", 0.05, 0.3),
    "phase_drift": uniform("rad_per_frame", 0.02, 0.06, either_sign=True),
    "packet_loss": logarithmic("lost_fraction", 0.01, 0.06),
    "packet_misalignment": nothing,
}
# Effects that the catalogue got later. They have a row of their own, so that the other rows' seeds draw what they drew.
LATER = {
    "scene_scale": uniform("scale", 0.006, 0.015, either_sign=True),
    "tx_delay": lambda rng, trial: {"slot": int(rng.integers(2)), "delay_m": float(rng.uniform(0.02, 0.15))},
}

# Things that look like a material and are none.
DECOYS = {
    "tilted_panel": lambda rng, trial: {"actor": str(rng.choice(["tv", "whiteboard", "window"])),
                                        "tilt_deg": float(rng.uniform(2, 5))},
    "channel_phase_error": channel_errors,
    "window_mismatch": uniform("depth", 0.3, 0.8),
}
LATER_OUTSIDE = ("level_by_total_power",)     # as LATER
OUTSIDE = tuple(name for name in UNCATALOGUED if name not in DECOYS and name not in LATER_OUTSIDE)

ROWS = ("clean", "single", "later", "faint", "pair", "twice", "outside", "decoy", "recording")
# Effects of any strength, with what their strength multiplies.
FAINT = {"range_bias": ("range_m",), "range_scale": ("scale",), "carrier_scale": ("scale",),
         "excess_attenuation": ("db_per_m",), "radar_yaw_offset": ("yaw_deg",), "radar_pitch_offset": ("pitch_deg",),
         "radar_position_offset": ("forward_m", "left_m"), "scene_registration": ("x_m", "y_m", "yaw_deg"),
         "channel_phase_error": ("rms_deg", "rms_db"), "tx_imbalance": ("phase_deg", "gain_db"),
         "element_pattern": ("cos_exponent",), "material_reflectivity": ("delta_db",), "iq_imbalance": ("image_db",),
         "edge_diffraction": ("level",), "actor_moved": ("distance_m", "dyaw_deg")}
LEAST_STRENGTH = 0.03   # of the row single's
ABSENT = 8              # effects that the matched test is told on a clean session
ABSENT_STRENGTH = (0.01, 0.3)   # of the row single's: about where the matched test has its limit
# Causes that a room may hold for several things at once, with the parameter that tells them apart.
TWICE = {"actor_absent": ("actor", MOVABLE), "actor_moved": ("actor", FURNITURE), "actor_unmodelled": None,
         "material_reflectivity": ("material", MATERIALS)}


def shuffled(names, trial):
    """One of the names, so that every run of len(names) trials holds each of them once, in an order of the seed."""
    block, place = divmod(trial.trial, len(names))
    text = f"{trial.row}/{trial.tier}/{trial.seed}/{block}".encode()
    order = np.random.default_rng(list(hashlib.sha256(text).digest()[:8])).permutation(len(names))
    return list(names)[order[place]]


def outside_strength(rng):
    """Of an effect outside the catalogue, whose typical size is one that plainly shows."""
    return float(rng.uniform(1.0, 1.6))


def weakened(name, rng, trial, least, most):
    """Parameters of an effect of the table FAINT at a share of its usual strength."""
    values, strength = SINGLE[name](rng, trial), math.exp(rng.uniform(math.log(least), math.log(most)))
    for parameter in FAINT[name]:
        values[parameter] = (values[parameter] + 20 * math.log10(strength) if parameter == "image_db"
                             else values[parameter] * strength)
    return values


def absent(trial):
    """[(effect's name, parameters)] that are not in a clean session and that the matched test is told of."""
    rng = np.random.default_rng([trial.session_seed(), 78])
    return [(str(name), weakened(name, rng, trial, *ABSENT_STRENGTH))
            for name in rng.choice(list(FAINT), ABSENT, replace=False)]


def draw(trial):
    """[(effect's name, parameters, strength or None)] of a trial on a generated session."""
    rng = trial.rng()
    if trial.row == "clean":
        return []
    if trial.row == "single":
        name = shuffled(SINGLE, trial)
        return [(name, SINGLE[name](rng, trial), None)]
    if trial.row == "later":
        name = shuffled(LATER, trial)
        return [(name, LATER[name](rng, trial), None)]
    if trial.row == "decoy":
        name = shuffled(DECOYS, trial)
        return [(name, DECOYS[name](rng, trial), None)]
    if trial.row == "outside":
        return [(shuffled(OUTSIDE, trial), {}, outside_strength(rng))]
    if trial.row == "faint":
        name = shuffled(FAINT, trial)
        return [(name, weakened(name, rng, trial, LEAST_STRENGTH, 1), None)]
    if trial.row == "twice":
        name = shuffled(TWICE, trial)
        hidden = [(name, SINGLE[name](rng, trial), None) for _ in range(2)]
        if TWICE[name]:
            parameter, subjects = TWICE[name]
            for (_, values, _), subject in zip(hidden, rng.choice(subjects, 2, replace=False)):
                values[parameter] = str(subject)
        return hidden
    if trial.row != "pair":
        raise ValueError(f"row '{trial.row}' hides nothing in generated sessions; rows: {', '.join(ROWS)}")
    while True:
        first, second = (str(n) for n in rng.choice(list(SINGLE), 2, replace=False))
        # Two conventions at once are a third one.
        if not (first in DISCRETE and second in DISCRETE):
            return [(n, SINGLE[n](rng, trial), None) for n in (first, second)]
