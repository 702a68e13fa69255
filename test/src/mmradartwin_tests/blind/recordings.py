"""Effects put into a real recording: raw frames of openradar_indoor, whose scene nobody knows, as one-pose sessions.

The recording is one frame of 128 loops, 2 transmitters, 4 receivers and 128 samples in the byte order of four lanes.
"""
import json
import math
import os
import shutil

import numpy as np

REPOSITORY = os.path.realpath(os.path.join(os.path.dirname(os.path.realpath(__file__)), *[".."] * 4))
RADAR = os.path.join(REPOSITORY, "mmradartwin_dsp", "test", "data", "openradar_indoor.yaml")
LOOPS, SLOTS, SAMPLES, RECEIVERS = 128, 2, 128, 4
CARRIER_HZ, SLOPE_HZ_PER_S, SAMPLE_RATE_HZ, ADC_START_S, CHIRP_S = 77.4201e9, 60e12, 2.5e6, 7e-6, 92e-6
TX_Y_M, RX_Y_M = (0.0, 0.0077446), (0.0, 0.0019361, 0.0038723, 0.0058084)
SPEED_OF_LIGHT = 299792458.0
PACKET_BYTES = 1456


def capture_file():
    """The recording, or None where MMRADARTWIN_DATA (default ../shared/data beside the project) lacks it."""
    folder = os.environ.get("MMRADARTWIN_DATA") or os.path.join(REPOSITORY, "..", "shared", "data")
    file = os.path.join(folder, "openradar_indoor", "xwr22xx_4lane_adc_data.bin")
    return file if os.path.exists(file) else None


def read_capture():
    """Complex samples [loop, slot, sample, receiver]."""
    raw = np.fromfile(capture_file(), "<i2").reshape(LOOPS, SLOTS, SAMPLES, 2, RECEIVERS)
    return raw[:, :, :, 0] + 1j * raw[:, :, :, 1]


def payload(x):
    """Bytes of complex samples [loop, slot, sample, receiver]; what does not fit into 16 bits is clipped."""
    raw = np.stack([x.real, x.imag], axis=3)
    return np.clip(np.rint(raw), -32768, 32767).astype("<i2").tobytes()


def write_payload(directory, data):
    """A session of one pose, without a scene."""
    os.makedirs(os.path.join(directory, "captures"))
    shutil.copy(RADAR, os.path.join(directory, "radar.yaml"))
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
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(SAMPLES) / SAMPLES))
    spectrum = np.fft.fft(x.mean(axis=0) * window[:, None], axis=1) / window.sum()
    return float(np.sqrt((np.abs(spectrum)**2).mean(axis=(0, 2)))[6:].max())


def channel_phase_error(x, rng):
    """A phase and gain per virtual channel, channel 0 as it was."""
    phase_deg, gain_db = rng.uniform(12, 30) * rng.standard_normal(8), rng.uniform(0.5, 1.5) * rng.standard_normal(8)
    phase_deg, gain_db = phase_deg - phase_deg[0], gain_db - gain_db[0]
    factor = (10**(gain_db / 20) * np.exp(1j * np.radians(phase_deg))).reshape(SLOTS, 1, RECEIVERS)
    return x * factor, {"phase_deg": list(phase_deg), "gain_db": list(gain_db)}


def iq_conjugation(x, rng):
    """Q inverted."""
    return np.conj(x), {}


def channel_conjugation(x, rng):
    """The order 7..0 of the virtual channels."""
    order = x.transpose(0, 2, 1, 3).reshape(LOOPS, SAMPLES, -1)[:, :, ::-1]
    return order.reshape(LOOPS, SAMPLES, SLOTS, RECEIVERS).transpose(0, 2, 1, 3), {}


def tx_rx_leakage(x, rng):
    """A tone at some centimetres, the same in every chirp, with its own complex vector over the channels."""
    range_m, level_db = float(rng.uniform(0.05, 0.15)), float(rng.uniform(3, 12))
    vector = rng.standard_normal((SLOTS, 1, RECEIVERS)) + 1j * rng.standard_normal((SLOTS, 1, RECEIVERS))
    vector /= math.sqrt(np.mean(np.abs(vector)**2))
    t = np.arange(SAMPLES) / SAMPLE_RATE_HZ
    tone = np.exp(2j * math.pi * SLOPE_HZ_PER_S * 2 * range_m / SPEED_OF_LIGHT * t)[None, :, None]
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
    chirp = np.arange(LOOPS * SLOTS).reshape(LOOPS, SLOTS, 1, 1)
    r = range_m + speed * chirp * CHIRP_S
    place = np.stack([r * math.cos(azimuth), r * math.sin(azimuth)])
    tx = np.array(TX_Y_M).reshape(1, SLOTS, 1, 1)
    rx = np.array(RX_Y_M).reshape(1, 1, 1, RECEIVERS)
    tau = (np.hypot(place[0], place[1] - tx) + np.hypot(place[0], place[1] - rx)) / SPEED_OF_LIGHT
    t = (ADC_START_S + np.arange(SAMPLES) / SAMPLE_RATE_HZ).reshape(1, 1, SAMPLES, 1)
    cycles = CARRIER_HZ * tau + SLOPE_HZ_PER_S * tau * t - 0.5 * SLOPE_HZ_PER_S * tau**2
    echo = level * np.exp(2j * math.pi * (cycles + rng.random()))
    # The radar stands at the session's map origin and looks along x.
    return x + echo, {"x_m": range_m * math.cos(azimuth), "y_m": range_m * math.sin(azimuth),
                      "speed_m_per_s": abs(speed)}


def packet_loss(data, rng):
    """Lost packets filled with zeros: bytes in, bytes out."""
    data = bytearray(data)
    count = -(-len(data) // PACKET_BYTES)
    lost = rng.choice(count, max(3, int(rng.uniform(0.01, 0.06) * count)), replace=False)
    for packet in lost:
        start, stop = packet * PACKET_BYTES, min((packet + 1) * PACKET_BYTES, len(data))
        data[start:stop] = bytes(stop - start)
    return bytes(data), {"lost_fraction": len(lost) / count}


ON_SAMPLES = {f.__name__: f for f in (channel_phase_error, iq_conjugation, channel_conjugation, tx_rx_leakage,
                                      adc_saturation, moving_target)}
INJECTIONS = (*ON_SAMPLES, "packet_loss")


def inject(name, rng):
    """(bytes of the recording with one effect in it, its parameters)."""
    if name == "packet_loss":
        return packet_loss(payload(read_capture()), rng)
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


def beyond(findings, untouched):
    """Findings that the untouched recording does not give too; each of those explains one of the same cause."""
    left = list(findings)
    for known in untouched:
        same = [f for f in left if f["cause"] == known["cause"]]
        if same:
            left.remove(min(same, key=lambda f: apart(f, known)))
    return left
