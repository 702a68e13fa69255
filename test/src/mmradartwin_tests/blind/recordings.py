"""Effects put into a real recording: raw frames of openradar_indoor, whose scene nobody knows, as one-pose sessions.

The recording is one frame of 128 loops, 2 transmitters, 4 receivers and 128 samples in the byte order of four lanes.
"""
import functools
import json
import math
import os
import shutil

import numpy as np
import yaml

from mmradartwin_tests.effects import make_effect
from mmradartwin_tests.radar import SPEED_OF_LIGHT, Radar

REPOSITORY = os.path.realpath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[".."] * 4))
DESCRIPTION = os.path.join(REPOSITORY, "mmradartwin_dsp", "test", "data", "openradar_indoor.yaml")


@functools.lru_cache(maxsize=None)
def description():
    """(radar of the recording, time from one chirp to the next in s)."""
    with open(DESCRIPTION, encoding="ascii") as text:
        told = yaml.safe_load(text)
    radar = Radar(told["carrier_hz"], told["slope_hz_per_s"], told["samples_per_chirp"], told["sample_rate_hz"],
                  told["adc_start_s"], told["loops_per_frame"], told["frame_period_s"],
                  np.array(told["tx_position_m"], float), np.array(told["rx_position_m"], float))
    return radar, told["idle_s"] + told["ramp_end_s"]


def shape():
    """Loops, slots, samples, receivers."""
    radar, _ = description()
    return radar.loops, len(radar.tx), radar.samples, len(radar.rx)


def capture_file():
    """The recording, or None where MMRADARTWIN_DATA (default ../shared/data beside the project) lacks it."""
    folder = os.environ.get("MMRADARTWIN_DATA") or os.path.join(REPOSITORY, "..", "shared", "data")
    file = os.path.join(folder, "openradar_indoor", "xwr22xx_4lane_adc_data.bin")
    return file if os.path.exists(file) else None


def read_capture():
    """Complex samples [loop, slot, sample, receiver]."""
    *outer, receivers = shape()
    raw = np.fromfile(capture_file(), "<i2").reshape(*outer, 2, receivers)
    return raw[:, :, :, 0] + 1j * raw[:, :, :, 1]


def payload(x):
    """Bytes of complex samples [loop, slot, sample, receiver]; what does not fit into 16 bits is clipped."""
    raw = np.stack([x.real, x.imag], axis=3)
    return np.clip(np.rint(raw), -32768, 32767).astype("<i2").tobytes()


def write_payload(directory, data):
    """A session of one pose, without a scene."""
    os.makedirs(os.path.join(directory, "captures"))
    shutil.copy(DESCRIPTION, os.path.join(directory, "radar.yaml"))
    with open(os.path.join(directory, "session.yaml"), "w", encoding="ascii") as out:
        out.write("format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\n"
                  "captures: captures/{pose}.bin\n")
    with open(os.path.join(directory, "poses.csv"), "w", encoding="ascii") as out:
        out.write("pose,location,stamp,x,y,z,qx,qy,qz,qw\n001,01,1760000000.0,0,0,1,0,0,0,1\n")
    with open(os.path.join(directory, "captures", "001.bin"), "wb") as out:
        out.write(data)


def write_untouched(directory):
    """The recording as it is."""
    with open(capture_file(), "rb") as file:
        write_payload(directory, file.read())


def strongest(x):
    """Amplitude of the strongest echo beyond 0.3 m, rms over channels, of the mean over loops."""
    samples = x.shape[2]
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(samples) / samples))
    spectrum = np.fft.fft(x.mean(axis=0) * window[:, None], axis=1) / window.sum()
    return float(np.sqrt((np.abs(spectrum)**2).mean(axis=(0, 2)))[6:].max())


def channel_phase_error(x, rng):
    """A phase and gain per virtual channel, channel 0 as it was."""
    phase_deg, gain_db = rng.uniform(12, 30) * rng.standard_normal(8), rng.uniform(0.5, 1.5) * rng.standard_normal(8)
    phase_deg, gain_db = phase_deg - phase_deg[0], gain_db - gain_db[0]
    factor = 10**(gain_db / 20) * np.exp(1j * np.radians(phase_deg))
    return x * factor.reshape(x.shape[1], 1, x.shape[3]), {"phase_deg": list(phase_deg), "gain_db": list(gain_db)}


def iq_conjugation(x, rng):
    """Q inverted."""
    return np.conj(x), {}


def channel_conjugation(x, rng):
    """The order 7..0 of the virtual channels."""
    return x[:, ::-1, :, ::-1], {}


def tx_rx_leakage(x, rng):
    """A tone at some centimetres, the same in every chirp, with its own complex vector over the channels."""
    range_m, level_db = float(rng.uniform(0.05, 0.15)), float(rng.uniform(3, 12))
    radar, _ = description()
    _, slots, samples, receivers = shape()
    vector = rng.standard_normal((slots, 1, receivers)) + 1j * rng.standard_normal((slots, 1, receivers))
    vector /= math.sqrt(np.mean(np.abs(vector)**2))
    t = np.arange(samples) / radar.sample_rate_hz
    tone = np.exp(2j * math.pi * radar.slope_hz_per_s * 2 * range_m / SPEED_OF_LIGHT * t)[None, :, None]
    return x + strongest(x) * 10**(level_db / 20) * vector * tone, {"range_m": range_m, "level_db": level_db}


def adc_saturation(x, rng):
    """So much gain that a share of the samples lies beyond full scale."""
    share = float(np.exp(rng.uniform(math.log(0.002), math.log(0.02))))
    size = np.abs(np.concatenate([x.real.ravel(), x.imag.ravel()]))
    return x * (32768 / np.quantile(size, 1 - share)), {"clipped_fraction": share}


def moving_target(x, rng):
    """Another walker, away from the two who are there: a point that moves along its line of sight."""
    range_m, azimuth = float(rng.uniform(1.2, 2.2)), float(rng.uniform(-0.6, 0.6))
    speed = float(rng.uniform(0.4, 1.2) * rng.choice([-1, 1]))
    level = strongest(x) * 10**(rng.uniform(-16, -6) / 20)
    radar, chirp_s = description()
    loops, slots, samples, receivers = shape()
    r = range_m + speed * chirp_s * np.arange(loops * slots).reshape(loops, slots, 1)
    place = np.stack([r * math.cos(azimuth), r * math.sin(azimuth), 0 * r], axis=-1)
    out = np.linalg.norm(place - radar.tx[:, None], axis=-1)
    lengths = (out + np.linalg.norm(place - radar.rx, axis=-1)).reshape(loops, -1)
    turn = level * np.exp(2j * math.pi * rng.random())
    echo = np.array([radar.grid(lengths[i:i + 1], [turn]) for i in range(loops)])
    echo = echo.reshape(loops, slots, receivers, samples).transpose(0, 1, 3, 2)
    # The radar stands at the session's map origin and looks along x.
    return x + echo, {"x_m": range_m * math.cos(azimuth), "y_m": range_m * math.sin(azimuth),
                      "speed_m_per_s": abs(speed)}


ON_SAMPLES = {f.__name__: f for f in (channel_phase_error, iq_conjugation, channel_conjugation, tx_rx_leakage,
                                      adc_saturation, moving_target)}
INJECTIONS = (*ON_SAMPLES, "packet_loss")


def inject(name, rng):
    """(bytes of the recording with one effect in it, its parameters)."""
    if name == "packet_loss":
        lossy = make_effect(name, {"lost_fraction": float(rng.uniform(0.01, 0.06))})
        return lossy.payload(None, 0, None, payload(read_capture()), rng), lossy.truth(None)
    x, parameters = ON_SAMPLES[name](read_capture(), rng)
    return payload(x), parameters


def write_session(trial, directory):
    """The session of a trial of the row `recording`; returns its truths."""
    name = INJECTIONS[trial.trial % len(INJECTIONS)]
    data, parameters = inject(name, trial.rng())
    write_payload(directory, data)
    return json.loads(json.dumps([{"cause": name, "parameters": parameters}]))


def middle(finding):
    """(range in m, azimuth in deg) of a finding's first place, None where it has none."""
    where = (finding.get("where") or [{}])[0]
    if not where.get("range_m") or not where.get("azimuth_deg"):
        return None
    return sum(where["range_m"]) / 2, sum(where["azimuth_deg"]) / 2


def apart(a, b):
    """How far two findings of one cause lie from each other, 0 where they have no place; 1 m counts as 20 degrees."""
    a, b = middle(a), middle(b)
    return 0.0 if a is None or b is None else abs(a[0] - b[0]) + abs(a[1] - b[1]) / 20


def intervals(finding):
    """[(value, low, high)] of all numbers of a finding that have an interval."""
    told = []
    for parameter in finding["parameters"].values():
        value, bounds = parameter["value"], parameter.get("ci95")
        if bounds is not None and not isinstance(value, str):
            told += [(v, *b) for v, b in (zip(value, bounds) if isinstance(value, list) else [(value, bounds)])]
    return told


def differ(a, b):
    """Whether a number of one finding lies outside the other's interval, and the other way round."""
    return any(not (other_low <= value <= other_high or low <= other <= high)
               for (value, low, high), (other, other_low, other_high) in zip(intervals(a), intervals(b)))


def beyond(findings, untouched):
    """Findings that the untouched recording does not give too; each of those explains one of the same cause.

    What has a size and no place (leakage, errors of channels) adds up with what the recording has of it: where it is
    another size, it is a finding, and its intervals, which are those of the sum, are left out.
    """
    left = list(findings)
    for known in untouched:
        same = [f for f in left if f["cause"] == known["cause"]]
        if not same:
            continue
        nearest = min(same, key=lambda f: apart(f, known))
        left.remove(nearest)
        if middle(nearest) is None and differ(nearest, known):
            parameters = {name: {k: v for k, v in p.items() if k != "ci95"} for name, p in nearest["parameters"].items()}
            left.append({**nearest, "parameters": parameters})
    return left
