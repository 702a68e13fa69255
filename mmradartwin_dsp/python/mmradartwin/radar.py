"""radar.yaml."""
from dataclasses import dataclass, field
from fractions import Fraction
import math

import numpy as np

from mmradartwin.strict_yaml import YamlMap

SPEED_OF_LIGHT_M_PER_S = 299792458.0
LANES = 4
LAYOUTS = {"12": "4lane", "14": "4lane", "22": "4lane", "16": "2lane", "18": "2lane", "64": "2lane", "68": "2lane"}
# What any radar has; whether the numbers fit each other, the programs check (validate).
BOUNDS = {"carrier_hz": (1e9, 1e12), "slope_hz_per_s": (1e9, 1e16), "sample_rate_hz": (1e4, 1e9), "adc_start_s": (0, 1e-2),
          "frame_period_s": (1e-5, 1000), "idle_s": (0, 1), "ramp_end_s": (1e-7, 1)}


@dataclass(frozen=True)
class Radar:
    """A radar.yaml. Of real samples, number and rate are those of the complex signal that they are read as: half."""
    device: str
    carrier_hz: float               # at the start of the ramp
    slope_hz_per_s: float
    samples_per_chirp: int          # N
    sample_rate_hz: float
    adc_start_s: float
    loops_per_frame: int
    frame_period_s: float
    tx_position_m: np.ndarray       # [slot][x, y, z]
    rx_position_m: np.ndarray       # [R][x, y, z]
    layout: str = "4lane"           # or 2lane
    iq_order: str = "iq"            # or qi
    real_samples: bool = False      # captures hold real samples
    idle_s: float = math.nan        # NaN or empty where radar.yaml does not say, and so below
    ramp_end_s: float = math.nan
    rx_gain_db: float = math.nan
    tx_backoff_db: float = math.nan
    max_frame_mb: float = 64.0      # a radar whose frames are larger is refused, MiB
    if_highpass_hz: list = field(default_factory=list)
    tx_enable: list = field(default_factory=list)
    rx_enable: list = field(default_factory=list)
    angle_slots: list = field(default_factory=list)

    @property
    def slots(self):
        """Number of TDM slots."""
        return len(self.tx_position_m)

    @property
    def receivers(self):
        """R."""
        return len(self.rx_position_m)

    @property
    def channels(self):
        """M = slots * R."""
        return self.slots * self.receivers

    @property
    def chirps_per_frame(self):
        """C; chirp c = loop * slots + slot."""
        return self.loops_per_frame * self.slots

    @property
    def bytes_per_frame(self):
        """Of a capture; four lanes always carry four receivers."""
        carried = max(LANES, self.receivers) if self.layout == "4lane" else self.receivers
        return self.chirps_per_frame * self.samples_per_chirp * carried * 4

    @property
    def bandwidth_hz(self):
        """B = slope N / f_s."""
        return self.slope_hz_per_s * self.samples_per_chirp / self.sample_rate_hz

    @property
    def range_bin_m(self):
        """c / (2 B)."""
        return SPEED_OF_LIGHT_M_PER_S / (2 * self.bandwidth_hz)

    @property
    def window_center_s(self):
        """t_c, from the start of the ramp."""
        return self.adc_start_s + self.samples_per_chirp / (2 * self.sample_rate_hz)

    @property
    def wavelength_m(self):
        """lambda_c, at the centre of the ADC window."""
        return SPEED_OF_LIGHT_M_PER_S / (self.carrier_hz + self.slope_hz_per_s * self.window_center_s)

    @property
    def virtual_element_m(self):
        """[M][x, y, z], sums of a transmitter's and a receiver's position."""
        return (self.tx_position_m[:, None] + self.rx_position_m).reshape(-1, 3)

    def frame_offset_ns(self, frame):
        """Start of a frame after that of frame 0."""
        return math.floor(Fraction(self.frame_period_s) * frame * 10**9 + Fraction(1, 2))


def read_radar(file):
    """Reads a radar.yaml strictly; raises InputError."""
    return radar_of(YamlMap.load(file))


def radar_of(yaml):
    """The radar of a mapping."""
    number = lambda key: yaml.number(key, *BOUNDS[key])
    positions = lambda key: np.array(yaml.rows(key, 3, -1e6, 1e6))
    values = {"device": yaml.text("device"), **{key: number(key) for key in ("carrier_hz", "slope_hz_per_s")},
              "samples_per_chirp": yaml.integer("samples_per_chirp", 2, 16384), "sample_rate_hz": number("sample_rate_hz"),
              "adc_start_s": number("adc_start_s"), "loops_per_frame": yaml.integer("loops_per_frame", 1, 32768),
              "frame_period_s": number("frame_period_s"), "tx_position_m": positions("tx_position_m"),
              "rx_position_m": positions("rx_position_m")}
    values["layout"] = layout_of(values["device"])
    if yaml.has("layout"):
        values["layout"] = yaml.text("layout", ("4lane", "2lane"))
    if yaml.has("iq_order"):
        values["iq_order"] = yaml.text("iq_order", ("iq", "qi"))
    if yaml.has("samples"):
        values["real_samples"] = yaml.text("samples", ("complex", "real")) == "real"
    for key in ("idle_s", "ramp_end_s"):
        if yaml.has(key):
            values[key] = number(key)
    for key, most in (("rx_gain_db", 120), ("tx_backoff_db", 60)):
        if yaml.has(key):
            values[key] = yaml.number(key, 0, most)
    if yaml.has("max_frame_mb"):
        values["max_frame_mb"] = yaml.number("max_frame_mb", 0.001, 4096)
    slots, receivers = len(values["tx_position_m"]), len(values["rx_position_m"])
    for key, length, read in (("if_highpass_hz", 2, lambda key: yaml.numbers(key, 1, 1e9)),
                              ("tx_enable", slots, lambda key: yaml.integer_lists(key, 0, 31)),
                              ("rx_enable", receivers, lambda key: yaml.integers(key, 0, 31))):
        if yaml.has(key):
            values[key] = read(key)
            if len(values[key]) != length:
                yaml.fail(key, f"has {len(values[key])} entries; it needs {length}")
    if yaml.has("angle_slots"):
        values["angle_slots"] = yaml.integers("angle_slots", 0, slots - 1)
    yaml.reject_unknown_keys()
    samples, layout = values["samples_per_chirp"], values["layout"]
    if values.get("real_samples"):
        if samples % 2 or samples < 4:
            yaml.fail("samples_per_chirp", f"'{samples}' real samples do not pair up; with samples: real it must be even "
                      "and at least 4")
        values["samples_per_chirp"] //= 2
        values["sample_rate_hz"] /= 2
    elif layout == "2lane" and samples % 2:
        yaml.fail("samples_per_chirp", f"'{samples}' is odd; layout 2lane stores samples in pairs, so it must be even")
    return Radar(**values)


def layout_of(device):
    """Layout of a device by the first two digits of its name, four lanes where they are not known."""
    digits = device.lstrip("".join(c for c in device if not c.isdigit()))[:2]
    return LAYOUTS.get(digits, "4lane")
