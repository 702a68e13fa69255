"""Session directories."""
from dataclasses import dataclass, field, replace
import math
import os
import re

import numpy as np

from mmradartwin.captures import capture_parts, read_capture
from mmradartwin.input_error import InputError
from mmradartwin.radar import Radar, read_radar
from mmradartwin.strict_yaml import YamlMap, read_text
from mmradartwin.tables import decimal_of, read_rows

COLUMNS = "pose,location,stamp,x,y,z,qx,qy,qz,qw"
ACCURACY = {"scene_m": (0.0005, 0.5), "level_db": (0.05, 10), "pose_m": (0, 0.5), "heading_deg": (0.001, 10),
            "path_range_m": (0.0001, 0.2), "path_angle_deg": (0.001, 5)}
OVERLAP_NS = 1000    # stamps typed with microseconds are rounded


@dataclass(frozen=True)
class Pose:
    """A row of poses.csv."""
    name: str
    location: str
    stamp_ns: int               # start of the first frame
    T_map_radar: np.ndarray     # [4][4]


@dataclass(frozen=True)
class Session:
    """A session directory."""
    folder: str
    radar: Radar
    poses: list                 # Pose, in the order of poses.csv, without duplicates and unusable ones
    duplicates: list            # names of poses within 10 cm, 2 cm in height and 1 deg of an earlier one
    problems: dict              # by name: why a pose cannot be used
    capture_pattern: str = ""   # path of a capture, {pose} for the name; "" without captures
    scene_file: str = None
    twin_file: str = None
    gain_db: float = None       # of a simulated session
    accuracy: dict = field(default_factory=dict)   # what session.yaml states, by key

    def pose(self, name):
        """The pose of a name; raises InputError."""
        for pose in self.poses:
            if pose.name == name:
                return pose
        raise InputError(f"{self.folder}: has no pose '{name}' that can be used"
                         + (f": {self.problems[name]}" if name in self.problems else ""))

    def frames(self, name):
        """AdcFrames of a pose; raises InputError."""
        pose = self.pose(name)
        if not self.capture_pattern:
            raise InputError(f"{self.folder}: pose '{name}': the session names no captures")
        try:
            return read_capture(self._capture(name), self.radar, pose.stamp_ns, self._captures())
        except InputError as error:
            raise InputError(f"pose '{name}': {error}") from None

    def grid(self, name):
        """ReceiveGrid of a pose: the coherent average of all its frames."""
        return replace(self.frames(name).grid(self.radar), T_map_radar=self.pose(name).T_map_radar)

    def _capture(self, name):
        return self.capture_pattern.replace("{pose}", name, 1)

    def _captures(self):
        return [self._capture(name) for name in [*(pose.name for pose in self.poses), *self.duplicates, *self.problems]]


def open_session(path):
    """Opens a session directory or its session.yaml; captures are read later. Raises InputError."""
    file = os.path.join(path, "session.yaml") if os.path.isdir(path) else os.fspath(path)
    yaml = YamlMap.load(file)
    yaml.text("format", ("mmradartwin_session/1",))
    at = lambda key: resolve(yaml.text(key), file) if yaml.has(key) else None
    radar_file, poses_file = resolve(yaml.text("radar"), file), resolve(yaml.text("poses"), file)
    values = {"scene_file": at("scene"), "twin_file": at("twin"), "capture_pattern": at("captures") or ""}
    if values["capture_pattern"] and "{pose}" not in values["capture_pattern"]:
        yaml.fail("captures", f"'{values['capture_pattern']}' must contain {{pose}}, the place of the pose's name")
    if yaml.has("gain_db"):
        values["gain_db"] = yaml.number("gain_db", -400, 400)
    if yaml.has("accuracy"):
        accuracy = yaml.map("accuracy")
        values["accuracy"] = {key: accuracy.number(key, *bounds) for key, bounds in ACCURACY.items() if accuracy.has(key)}
        accuracy.reject_unknown_keys()
    yaml.reject_unknown_keys()
    poses, problems = poses_of(read_text(poses_file), poses_file)
    kept, duplicates = without_duplicates(poses)
    session = Session(os.path.dirname(file) or ".", read_radar(radar_file), kept, duplicates, problems, **values)
    _refuse_overlap(session, poses, poses_file)
    return session


def poses_of(text, file):
    """(poses, problems) of the text of a poses.csv; raises InputError, which names the file."""
    poses, problems = [], {}
    for line, fields in read_rows(text, file, COLUMNS):
        name, where = fields[0], f"{file}: line {line}: "
        if not name or name.startswith(".") or re.search(r"[/\\]", name):
            raise InputError(f"{where}pose '{name}' has a name that no file can have")
        if name in problems or any(pose.name == name for pose in poses):
            raise InputError(f"{where}pose '{name}' stands twice; every pose needs a name of its own")
        try:
            poses.append(_pose(fields))
        except InputError as error:
            problems[name] = f"{where}pose '{name}': {error}"
    if not poses and not problems:
        raise InputError(f"{file}: holds no poses; write one row per pose")
    return poses, problems


def _pose(fields):
    name, location, stamp = fields[:3]
    if not location:
        raise InputError("location is empty; name the spot, poses of one spot share it")
    numbers = []
    for column, text in zip(COLUMNS.split(",")[3:], fields[3:]):
        numbers.append(decimal_of(text))
        if numbers[-1] is None:
            raise InputError(f"{column} '{text}' is no number; correct or remove the row")
        if not math.isfinite(numbers[-1]):
            raise InputError(f"{column} is {text}; correct or remove the row")
    return Pose(name, location, stamp_ns_of(stamp), transform(numbers[:3], numbers[3:]))


def stamp_ns_of(text):
    """Nanoseconds of a decimal number of seconds, exactly."""
    match = re.fullmatch(r"([0-9]+)(?:\.([0-9]*))?", text)
    if not match or int(match[1]) > 4294967295:
        raise InputError(f"stamp '{text[:40]}' is no decimal number of seconds; write it as in 1700000000.25, allowed: 0 to "
                         "4294967295")
    fraction = match[2] or ""
    return int(match[1]) * 10**9 + int(fraction[:9].ljust(9, "0")) + (fraction[9:10] >= "5")


def transform(position_m, quaternion_xyzw):
    """[4][4] of a position and a quaternion; raises InputError where that is no rotation."""
    x, y, z, w = (float(q) for q in quaternion_xyzw)
    norm = math.sqrt((x * x + z * z) + (y * y + w * w))
    if not abs(norm - 1) <= 1e-3:
        raise InputError(f"quaternion qx,qy,qz,qw has norm {norm:g}; allowed: 0.999 to 1.001; correct or remove the row")
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    tx, ty, tz = 2 * x, 2 * y, 2 * z
    T = np.eye(4)
    T[:3, :3] = [[1 - (ty * y + tz * z), ty * x - tz * w, tz * x + ty * w],
                 [ty * x + tz * w, 1 - (tx * x + tz * z), tz * y - tx * w],
                 [tz * x - ty * w, tz * y + tx * w, 1 - (tx * x + ty * y)]]
    T[:3, 3] = position_m
    return T


def without_duplicates(poses):
    """(poses kept, in their order, names of later ones of each pair that sees the same)."""
    kept = []
    for pose in sorted(poses, key=lambda pose: pose.stamp_ns):
        if not any(_same_view(earlier.T_map_radar, pose.T_map_radar) for earlier in kept):
            kept.append(pose)
    names = {pose.name for pose in kept}
    return [pose for pose in poses if pose.name in names], [pose.name for pose in poses if pose.name not in names]


def _same_view(a, b):
    step = a[:3, 3] - b[:3, 3]
    turn = math.atan2(a[1, 0], a[0, 0]) - math.atan2(b[1, 0], b[0, 0])
    return (math.hypot(step[0], step[1]) <= 0.10 and abs(step[2]) <= 0.02
            and abs(math.remainder(turn, 2 * math.pi)) <= math.radians(1))


def _refuse_overlap(session, poses, poses_file):
    if not session.capture_pattern:
        return
    by_time = sorted(poses, key=lambda pose: pose.stamp_ns)
    for pose, after in zip(by_time, by_time[1:]):
        try:
            parts = capture_parts(session._capture(pose.name), session._captures())
            frames = sum(os.path.getsize(part) for part in parts) // session.radar.bytes_per_frame
        except (InputError, OSError):
            continue    # reading the pose says so
        if after.stamp_ns < pose.stamp_ns + session.radar.frame_offset_ns(frames) - OVERLAP_NS:
            raise InputError(f"{poses_file}: poses '{pose.name}' and '{after.name}' overlap in time: {frames} frames of the "
                             "first last longer; correct the stamps or frame_period_s")


def resolve(path, base_file):
    """A path of a session's file: relative to that file, absolute, or package://package/rest."""
    if not path.startswith("package://"):
        return os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(base_file)), path))
    package, _, rest = path[len("package://"):].partition("/")
    try:
        import rospkg
        return os.path.join(rospkg.RosPack().get_path(package), rest)
    except ImportError:
        raise InputError(f"{base_file}: {path}: needs the Python package rospkg (python3-rospkg)") from None
    except rospkg.ResourceNotFound:
        raise InputError(f"{base_file}: {path}: package '{package}' is not in ROS_PACKAGE_PATH; source the workspace's "
                         "setup.bash first") from None
