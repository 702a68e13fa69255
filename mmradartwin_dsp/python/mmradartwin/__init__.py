"""Files of mmradartwin as NumPy arrays; it reads and never writes. docs/data/python.md describes every field.

Units stand in names, shapes in docstrings: F frames, C chirps of a frame, N samples of a chirp, R receivers, M channels
(channel k = R * slot + receiver), P paths. The simulator is mmradartwin.sim, of the package mmradartwin_sim.
"""
from pkgutil import extend_path

# mmradartwin.sim may stand in another folder: it is compiled, and of another package.
__path__ = extend_path(__path__, __name__)  # noqa: F821

from mmradartwin.bags import Bag, open_bag
from mmradartwin.captures import AdcFrames, read_capture
from mmradartwin.findings import Finding, Findings, Parameter, read_findings
from mmradartwin.grids import PoseArrays, RangeAngleMap, ReceiveGrid, read_map_csv, read_npz
from mmradartwin.input_error import InputError
from mmradartwin.paths import PathRecords, read_paths_csv
from mmradartwin.radar import Radar, read_radar
from mmradartwin.sessions import Pose, Session, open_session

__all__ = ["AdcFrames", "Bag", "Finding", "Findings", "InputError", "Parameter", "PathRecords", "Pose", "PoseArrays",
           "Radar", "RangeAngleMap", "ReceiveGrid", "Session", "open_bag", "open_session", "read_capture",
           "read_findings", "read_map_csv", "read_npz", "read_paths_csv", "read_radar"]
