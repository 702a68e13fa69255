"""Receive grids and range-angle maps."""
from dataclasses import dataclass
import zipfile

import numpy as np

from mmradartwin.input_error import InputError
from mmradartwin.tables import read_table


@dataclass(frozen=True)
class ReceiveGrid:
    """Average of measured frames, or the sum of a twin's paths."""
    x: np.ndarray                      # complex128 [M][N], in units of which full_scale is 0 dBFS
    full_scale: float                  # 32768 of ADC counts, 1 of path amplitudes
    frames: int                        # frames in the average
    stamp_ns: int                      # start of the last frame
    T_map_radar: np.ndarray = None     # [4][4], None without a pose


@dataclass(frozen=True)
class RangeAngleMap:
    """Levels by range and azimuth."""
    range_m: np.ndarray                # [range], centres of the bins
    azimuth_rad: np.ndarray            # [azimuth], positive to the left, ascending; NaN where |sine| > 1
    power_db: np.ndarray               # [range][azimuth], dBFS; NaN where azimuth_rad is
    frames: int = 0                    # frames in the average, 0 where the file does not say
    stamp_ns: int = None
    T_map_radar: np.ndarray = None     # [4][4], None where the file has no pose

    @property
    def azimuth_deg(self):
        """[azimuth]."""
        return np.degrees(self.azimuth_rad)

    def strongest(self, nearest_m=0.16, widest_deg=60.0):
        """(range_m, azimuth_deg, power_db) of the strongest cell beyond nearest_m and within +-widest_deg."""
        power_db = np.where((self.range_m[:, None] > nearest_m) & (np.abs(self.azimuth_deg) <= widest_deg),
                            self.power_db, -np.inf)
        range_bin, azimuth_bin = np.unravel_index(np.argmax(power_db), power_db.shape)
        return (float(self.range_m[range_bin]), float(self.azimuth_deg[azimuth_bin]),
                float(self.power_db[range_bin, azimuth_bin]))


@dataclass(frozen=True)
class PoseArrays:
    """A .npz of process."""
    grid: ReceiveGrid
    map: RangeAngleMap
    counts: np.ndarray = None          # int16 [F][C][N][R][I, Q], None without --cubes


def read_npz(file):
    """Reads what `process --npz` wrote of a pose; raises InputError."""
    needed = ("grid", "full_scale", "frames", "stamp_s", "T_map_radar", "range_m", "azimuth_rad", "power_db")
    try:
        archive = np.load(file, allow_pickle=False)
        arrays = {name: archive[name] for name in archive.files} if isinstance(archive, np.lib.npyio.NpzFile) else None
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise InputError(f"{file}: is no .npz that can be read ({error})") from None
    if arrays is None:
        raise InputError(f"{file}: is one array; give a .npz that process --npz wrote")
    archive.close()
    missing = [name for name in needed if name not in arrays]
    if missing:
        raise InputError(f"{file}: lacks {', '.join(missing)}; give a .npz that process --npz wrote")
    shape = (len(arrays["range_m"]), len(arrays["azimuth_rad"]))
    if arrays["power_db"].shape != shape:
        raise InputError(f"{file}: power_db has shape {arrays['power_db'].shape}; its axes say {shape}")
    # As a double, seconds since 1970 are good for 0.2 us; poses.csv has them exactly.
    common = {"frames": int(arrays["frames"]), "stamp_ns": int(round(float(arrays["stamp_s"]) * 1e9)),
              "T_map_radar": arrays["T_map_radar"]}
    return PoseArrays(ReceiveGrid(x=arrays["grid"], full_scale=float(arrays["full_scale"]), **common),
                      RangeAngleMap(arrays["range_m"], arrays["azimuth_rad"], arrays["power_db"], **common),
                      arrays.get("cube"))


def read_map_csv(file):
    """Reads maps/{pose}.csv of process, six decimals each; raises InputError."""
    table = read_table(file, "range_m,azimuth_deg,power_db", numbers=("range_m", "azimuth_deg", "power_db"))
    azimuths = int(np.argmax(table["range_m"] != table["range_m"][0])) or len(table["range_m"])
    if len(table["range_m"]) % azimuths:
        raise InputError(f"{file}: {len(table['range_m'])} cells are no whole rows of {azimuths}; it was cut off")
    cells = {name: column.reshape(-1, azimuths) for name, column in table.items()}
    if not (cells["range_m"] == cells["range_m"][:, :1]).all():
        raise InputError(f"{file}: rows do not run through all azimuths of a range; give a map of process")
    return RangeAngleMap(cells["range_m"][:, 0], np.radians(cells["azimuth_deg"][0]), cells["power_db"])
