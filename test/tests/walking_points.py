"""Recordings of points that stand, walk, vibrate or flicker, made sample by sample from their distances alone."""
import os

import numpy as np

from paper_radar import PAPER_RADAR

LIGHT_M_PER_S = 299792458.0
CARRIER_HZ, SLOPE_HZ_PER_S, RATE_HZ, ADC_START_S = 77.0e9, 75.0e12, 5.0e6, 6.0e-6
SAMPLES, CHIRP_S, RAMP_S = 64, 27.0e-6, 20.0e-6
TX_M = (0.0, 0.0077867)
RX_M = (0.0, 0.0019467, 0.0038934, 0.0058401)

RADAR = PAPER_RADAR + """layout: 4lane
idle_s: {idle_s:.9f}
ramp_end_s: 20.0e-6
"""


def chirp_times_s(frames, loops, frame_period_s, chirp_s):
    """Start of every chirp [frame, loop, slot]."""
    return (np.arange(frames)[:, None, None] * frame_period_s +
            np.arange(loops)[None, :, None] * len(TX_M) * chirp_s + np.arange(len(TX_M)) * chirp_s)


def polar(range_m, azimuth_deg):
    """Place [x, y, 0] before a radar that looks along x, with y to the left."""
    a = np.radians(azimuth_deg)
    return np.array([range_m * np.cos(a), range_m * np.sin(a), 0.0])


def echo(places_m, amplitudes):
    """Samples [frame, loop, slot, sample, receiver] of a point; places [frame, loop, slot, xyz] before the radar in
    metres, amplitudes [frame, loop, slot] complex, in counts."""
    tx = np.zeros((len(TX_M), 3))
    tx[:, 1] = TX_M
    out_m = np.linalg.norm(places_m - tx, axis=-1)
    sample_s = ADC_START_S + np.arange(SAMPLES) / RATE_HZ
    x = np.empty((*places_m.shape[:3], SAMPLES, len(RX_M)), complex)
    for r, y_m in enumerate(RX_M):
        delay_s = (out_m + np.linalg.norm(places_m - [0, y_m, 0], axis=-1)) / LIGHT_M_PER_S
        x[..., r] = amplitudes[..., None] * np.exp(
            2j * np.pi * delay_s[..., None] * (CARRIER_HZ + SLOPE_HZ_PER_S * sample_s))
    return x


class Recording:
    """One pose: a radar at T_map_radar = (position, yaw), frames of loops of two chirps."""

    def __init__(self, frames, loops, frame_period_s=0.05, noise=3.0, seed=1, chirp_s=CHIRP_S):
        self.frames, self.loops, self.frame_period_s = frames, loops, frame_period_s
        self.chirp_s = chirp_s
        self.noise, self.rng = noise, np.random.default_rng(seed)
        self.times_s = chirp_times_s(frames, loops, frame_period_s, chirp_s)
        self.x = np.zeros((frames, loops, len(TX_M), SAMPLES, len(RX_M)), complex)

    def stands(self, range_m, azimuth_deg, amplitude, changes=1.0):
        """changes: complex factor that broadcasts to [frame, loop, slot]."""
        places = np.broadcast_to(polar(range_m, azimuth_deg), (*self.times_s.shape, 3))
        self.x += echo(places, amplitude * np.ones(self.times_s.shape) * changes)
        return self

    def moves(self, places_m, amplitude):
        """places_m: [frame, loop, slot, xyz] before the radar."""
        self.x += echo(places_m, amplitude * np.ones(self.times_s.shape))
        return self

    def walks(self, range_m, azimuth_deg, speed_m_per_s, amplitude, begin_s=0.0):
        """Along the line of sight, away from the radar where the speed is positive."""
        along = polar(1.0, azimuth_deg)
        return self.moves((range_m + speed_m_per_s * (self.times_s - begin_s))[..., None] * along, amplitude)

    def payload(self):
        """int16 in the order of four lanes."""
        noisy = self.x + self.noise / np.sqrt(2) * (self.rng.standard_normal(self.x.shape) +
                                                    1j * self.rng.standard_normal(self.x.shape))
        raw = np.stack([noisy.real, noisy.imag], axis=-2)
        return np.clip(np.rint(raw), -32768, 32767).astype("<i2").tobytes()


def write_session(folder, recordings, poses=None, scene_files=None):
    """A session; poses: (location, x, y, yaw_deg, stamp_s) of every recording, the map's origin by default."""
    os.makedirs(os.path.join(folder, "captures"))
    first = recordings[0]
    poses = poses or [("01", 0.0, 0.0, 0.0, 1760000000.0)]
    lines = ["pose,location,stamp,x,y,z,qx,qy,qz,qw"]
    for number, (recording, (location, x, y, yaw_deg, stamp_s)) in enumerate(zip(recordings, poses), 1):
        half = np.radians(yaw_deg) / 2
        lines.append(f"{number:03d},{location},{stamp_s:.3f},{x},{y},1,0,0,{np.sin(half):.9f},{np.cos(half):.9f}")
        with open(os.path.join(folder, "captures", f"{number:03d}.bin"), "wb") as out:
            out.write(recording.payload())
    session = "format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\ncaptures: captures/{pose}.bin\n"
    if scene_files:
        session += "scene: scene.yaml\n"
    files = {"radar.yaml": RADAR.format(loops=first.loops, frame_period_s=first.frame_period_s,
                                          idle_s=first.chirp_s - RAMP_S),
             "poses.csv": "\n".join(lines) + "\n", "session.yaml": session, **(scene_files or {})}
    for name, text in files.items():
        with open(os.path.join(folder, name), "w", encoding="ascii") as out:
            out.write(text)
