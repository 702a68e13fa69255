"""Path records of the simulator."""
from dataclasses import dataclass

import numpy as np

from mmradartwin.tables import read_table

HEADER = ("length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,bounces,"
          "event,actors,materials")
TEXTS = ("event", "actors", "materials")


@dataclass(frozen=True)
class PathRecords:
    """The paths of one pose, an entry each; the names are those of paths/{pose}.csv."""
    length_m: np.ndarray               # [P], whole way at virtual element 0
    azimuth_dep_deg: np.ndarray        # [P], departure as the radar sees it, positive to the left
    elevation_dep_deg: np.ndarray      # [P]
    azimuth_arr_deg: np.ndarray        # [P], arrival, from the radar outwards too
    elevation_arr_deg: np.ndarray      # [P]
    amplitude_db: np.ndarray           # [P], 20 log10 of the dimensionless amplitude
    phase_rad: np.ndarray              # [P], at element 0 and the window's centre
    bounces: np.ndarray                # int [P]
    event: list                        # [P] name of the mechanism
    actors: list                       # [P] tuple of names, one per interaction
    materials: list                    # [P] tuple of names, one per interaction
    # What a CSV does not hold; None of one.
    channel_length_m: np.ndarray = None     # [P][M]
    contribution: np.ndarray = None         # complex128 [P][M], c at the window's centre
    vertices_m: list = None                 # [P] arrays [interaction][x, y, z], map

    def __len__(self):
        return len(self.length_m)


def read_paths_csv(file):
    """Reads paths/{pose}.csv of simulate; raises InputError."""
    table = read_table(file, HEADER, numbers=[name for name in HEADER.split(",") if name not in TEXTS])
    table["bounces"] = table["bounces"].astype(int)
    for name in ("actors", "materials"):
        table[name] = [tuple(text.split(";")) if text else () for text in table[name]]
    return PathRecords(**table)


def records_of(departure, arrival, amplitude, channel_length_m, contribution, **labels):
    """PathRecords of unit vectors [P][x, y, z], amplitudes [P] and what stands by channel [P][M]."""
    departure, arrival = (np.reshape(directions, (-1, 3)) for directions in (departure, arrival))
    angles = {}
    for name, direction in (("dep", departure), ("arr", arrival)):
        angles[f"azimuth_{name}_deg"] = np.degrees(np.arctan2(direction[:, 1], direction[:, 0]))
        angles[f"elevation_{name}_deg"] = np.degrees(np.arcsin(np.clip(direction[:, 2], -1, 1)))
    channel_length_m = np.reshape(channel_length_m, (len(departure), -1))
    contribution = np.reshape(contribution, channel_length_m.shape)
    first = 0 if len(departure) else slice(0)
    with np.errstate(divide="ignore"):
        amplitude_db = 20 * np.log10(np.asarray(amplitude, float))
    return PathRecords(length_m=channel_length_m[:, first].reshape(-1), amplitude_db=amplitude_db,
                       phase_rad=np.angle(contribution[:, first]).reshape(-1), channel_length_m=channel_length_m,
                       contribution=contribution, **angles, **labels)
