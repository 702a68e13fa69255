"""Bags, by the Python package rosbag, which ROS brings."""
from dataclasses import dataclass, replace
import os

import numpy as np

from mmradartwin.captures import AdcFrames
from mmradartwin.findings import findings_of
from mmradartwin.grids import RangeAngleMap, ReceiveGrid
from mmradartwin.input_error import InputError
from mmradartwin.paths import records_of
from mmradartwin.radar import Radar
from mmradartwin.sessions import poses_of, transform, without_duplicates
from mmradartwin.strict_yaml import YamlMap


@dataclass(frozen=True)
class Bag:
    """A bag; its messages are read when they are asked for."""
    file: str
    namespace: str       # of the radar, "" without one
    radar: Radar
    topics: dict         # type of every topic's messages by the topic's name
    poses: list          # Pose, of the session that the bag was made of; empty of any other bag
    duplicates: list
    problems: dict
    pose_stamps_ns: list    # of all poses that have one, in order

    def frames(self, first_ns=0, last_ns=2**63 - 1):
        """AdcFrames stamped from first_ns to last_ns, in order of time."""
        cubes = sorted((m for m in self._messages("radar/adc") if first_ns <= m.header.stamp.to_nsec() <= last_ns),
                       key=lambda m: m.header.stamp.to_nsec())
        shape = (self.radar.chirps_per_frame, self.radar.samples_per_chirp, self.radar.receivers, 2)
        for m in cubes:
            if (m.chirps, m.samples_per_chirp, m.receivers) != shape[:3] or len(m.samples) != np.prod(shape):
                raise InputError(f"{self.file}: frame {m.sequence} has another shape than radar/config says")
        counts = [np.array(m.samples, np.int16) for m in cubes]
        valid = [np.frombuffer(bytes(m.chirp_valid), np.uint8) != 0 for m in cubes]
        return AdcFrames(np.reshape(counts, (len(cubes), *shape)).astype(np.int16),
                         np.array([m.header.stamp.to_nsec() for m in cubes], np.int64),
                         np.reshape(valid, (len(cubes), shape[0])).astype(bool))

    def pose_frames(self, name):
        """AdcFrames of a pose of the session that the bag was made of: those from its stamp to the next pose's."""
        slack_ns = self.radar.frame_offset_ns(1) // 4
        pose = next((pose for pose in self.poses if pose.name == name), None)
        if pose is None:
            raise InputError(f"{self.file}: has no pose '{name}' that can be used; where a bag brings no session, "
                             "bag_to_session finds the poses in tf")
        later = [stamp for stamp in self.pose_stamps_ns if stamp > pose.stamp_ns]
        frames = self.frames(pose.stamp_ns - slack_ns, later[0] - slack_ns - 1 if later else 2**63 - 1)
        if not len(frames.counts):
            raise InputError(f"{self.file}: pose '{name}': bag holds no frames of it")
        return frames

    def grid(self, name):
        """ReceiveGrid of a pose: the coherent average of its frames."""
        pose_matrix = next((pose.T_map_radar for pose in self.poses if pose.name == name), None)
        return replace(self.pose_frames(name).grid(self.radar), T_map_radar=pose_matrix)

    def grids(self, topic="radar/grid"):
        """Iterates over the ReceiveGrids of a topic (radar/grid, twin/grid)."""
        for m in self._messages(topic):
            values = np.array(m.data, float).reshape(m.channels, m.samples, 2)
            yield ReceiveGrid(values[..., 0] + 1j * values[..., 1], m.full_scale, m.frames, m.header.stamp.to_nsec(),
                              _matrix(m.T_map_radar) if m.pose_valid else None)

    def maps(self, topic="radar/range_angle"):
        """Iterates over the RangeAngleMaps of a topic (radar/range_angle, twin/range_angle); levels are float32 there."""
        for m in self._messages(topic):
            yield RangeAngleMap(np.array(m.range_m), np.array(m.azimuth_rad),
                                np.array(m.power_db, float).reshape(len(m.range_m), len(m.azimuth_rad)), m.frames,
                                m.header.stamp.to_nsec(), _matrix(m.T_map_radar) if m.pose_valid else None)

    def paths(self, topic="twin/paths"):
        """Iterates over (stamp_ns, T_map_radar, PathRecords) of a topic."""
        point = lambda p: (p.x, p.y, p.z)
        for m in self._messages(topic):
            yield m.header.stamp.to_nsec(), _matrix(m.T_map_radar), records_of(
                [point(r.departure) for r in m.records], [point(r.arrival) for r in m.records],
                [r.amplitude for r in m.records], [r.length_m for r in m.records],
                [np.array(r.c_re) + 1j * np.array(r.c_im) for r in m.records],
                bounces=np.array([r.bounces for r in m.records], int), event=[r.event for r in m.records],
                actors=[tuple(r.actors) for r in m.records], materials=[tuple(r.materials) for r in m.records],
                vertices_m=[np.array([point(v) for v in r.vertices]).reshape(-1, 3) for r in m.records])

    def findings(self, topic="attribution/findings"):
        """Iterates over the Findings of a topic."""
        for m in self._messages(topic):
            yield findings_of(m.json, f"{self.file}:{topic}")

    def _messages(self, topic):
        return _messages(self.file, self.topics, self._name(topic))

    def _name(self, topic):
        return f"{self.namespace}/{topic}".lstrip("/")


def open_bag(file, namespace=None):
    """Opens a bag; namespace: of the radar, where it holds several. Raises InputError, ImportError without rosbag."""
    topics = _topics(file)
    radars = sorted(topic[:-len("radar/adc")].rstrip("/") for topic, kind in topics.items()
                    if kind == "mmradartwin_msgs/AdcCube" and topic.endswith("radar/adc"))
    if namespace is None:
        if len(radars) > 1:
            raise InputError(f"{file}: bag holds frames of {len(radars)} radars; say which by namespace: "
                             + ", ".join(radars))
        namespace = radars[0] if radars else ""
    namespace = namespace.strip("/")
    name = lambda topic: f"{namespace}/{topic}".lstrip("/")
    configs = list(_messages(file, topics, name("radar/config")))
    if not configs:
        raise InputError(f"{file}: bag holds no radar configuration on topic {name('radar/config')} (it has "
                         f"{', '.join(sorted(topics)) or 'nothing'})")
    sessions = list(_messages(file, topics, name("session")))
    poses, problems = _poses(file, sessions[-1]) if sessions else ([], {})
    kept, duplicates = without_duplicates(poses)
    return Bag(file, namespace, _radar(configs[-1]), topics, kept, duplicates, problems,
               sorted(pose.stamp_ns for pose in poses))


def _rosbag():
    try:
        import rosbag
    except ImportError as error:
        raise ImportError("bags are read by the Python package rosbag, which is not here (python3-rosbag); or turn the bag "
                          "into a session directory with bag_to_session") from error
    return rosbag


def _topics(file):
    rosbag = _rosbag()
    try:
        with rosbag.Bag(file) as bag:
            return {topic.lstrip("/"): info.msg_type for topic, info in bag.get_type_and_topic_info().topics.items()}
    except (OSError, rosbag.ROSBagException) as error:
        raise InputError(f"{file}: is no bag that can be read ({error})") from None


def _messages(file, topics, topic):
    """Messages of a topic by time of recording; none where the bag lacks it."""
    if topic not in topics:
        return
    with _rosbag().Bag(file) as bag:
        for _, message, _ in bag.read_messages([topic, "/" + topic]):
            yield message


def _radar(m):
    points = lambda list_of: np.array([(p.x, p.y, p.z) for p in list_of])
    bits = lambda mask: [i for i in range(32) if mask >> i & 1]
    names = ("device", "carrier_hz", "slope_hz_per_s", "samples_per_chirp", "sample_rate_hz", "adc_start_s",
             "loops_per_frame", "frame_period_s", "layout", "iq_order", "idle_s", "ramp_end_s", "rx_gain_db", "tx_backoff_db")
    return Radar(**{name: getattr(m, name) for name in names}, tx_position_m=points(m.tx_position_m),
                 rx_position_m=points(m.rx_position_m), if_highpass_hz=list(m.if_highpass_hz),
                 tx_enable=[bits(mask) for mask in m.tx_enable], rx_enable=list(m.rx_enable))


def _poses(file, session):
    stored = {os.path.normpath(one.name): bytes(one.data).decode("utf-8", "replace") for one in session.files}
    try:
        name = YamlMap.parse(stored["session.yaml"], f"{file}: session.yaml").text("poses")
        return poses_of(stored[os.path.normpath(name)], f"{file}: {name}")
    except KeyError as missing:
        raise InputError(f"{file}: the session in the bag brings no {missing.args[0]}") from None


def _matrix(pose):
    p, q = pose.position, pose.orientation
    return transform((p.x, p.y, p.z), (q.x, q.y, q.z, q.w))
