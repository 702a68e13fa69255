"""A bag of a radar that is carried from place to place: frames while it stands and on the way, tf stamped late."""
import dataclasses
import hashlib
import io
import math
import os

import geometry_msgs.msg
import mmradartwin_msgs.msg
import numpy as np
import rosbag
import rospy
import tf2_msgs.msg

from mmradartwin_tests.campaign import Station, quaternion, rotation_from_vector
from mmradartwin_tests.session import Measurement, write_description
from mmradartwin_tests.tracing import Pose

STAND_S, SPEED_M_PER_S, LEAST_WAY_S = 2.0, 1.0, 0.6
TF_PERIOD_S = 1 / 30


def rotation_vector(rotation):
    """Inverse of rotation_from_vector for less than half a turn."""
    x, y, z, w = quaternion(rotation)
    sine = math.sqrt(x * x + y * y + z * z)
    return np.zeros(3) if sine < 1e-12 else np.array([x, y, z]) / sine * 2 * math.atan2(sine, w)


@dataclasses.dataclass
class Leg:
    """Standing at a place, then on the way to the next."""
    start_s: float
    leave_s: float
    arrive_s: float


class Walk:
    """Where the radar is at any time: at rest, then with a smooth start and stop to the next place."""

    def __init__(self, poses):
        self.poses, self.legs, clock = poses, [], 0.0
        for here, there in zip(poses, poses[1:] + poses[-1:]):
            leave = clock + STAND_S
            arrive = leave + max(LEAST_WAY_S, np.linalg.norm(there.position - here.position) / SPEED_M_PER_S)
            self.legs.append(Leg(clock, leave, arrive))
            clock = arrive
        self.end_s = self.legs[-1].leave_s

    def at(self, t):
        """(Pose, index of the place where it stands or None)."""
        t = min(max(t, 0.0), self.end_s)
        i = max(k for k, leg in enumerate(self.legs) if leg.start_s <= t)
        leg, here = self.legs[i], self.poses[i]
        if t <= leg.leave_s or i + 1 == len(self.poses):
            return here, i
        there = self.poses[i + 1]
        share = 0.5 - 0.5 * math.cos(math.pi * (t - leg.leave_s) / (leg.arrive_s - leg.leave_s))
        turn = rotation_vector(here.rotation.T @ there.rotation)
        return Pose(here.position + share * (there.position - here.position),
                    here.rotation @ rotation_from_vector(share * turn)), None


def config_message(radar):
    """RadarConfig of the generator's radar, and its hash."""
    m = mmradartwin_msgs.msg.RadarConfig(
        device="awr2243", carrier_hz=radar.carrier_hz, slope_hz_per_s=radar.slope_hz_per_s,
        samples_per_chirp=radar.samples, sample_rate_hz=radar.sample_rate_hz, adc_start_s=radar.adc_start_s,
        loops_per_frame=radar.loops, frame_period_s=radar.frame_period_s, layout="4lane", iq_order="iq",
        idle_s=math.nan, ramp_end_s=math.nan, rx_gain_db=math.nan, tx_backoff_db=math.nan)
    m.tx_position_m = [geometry_msgs.msg.Point(*p) for p in radar.tx]
    m.rx_position_m = [geometry_msgs.msg.Point(*p) for p in radar.rx]
    text = io.BytesIO()
    m.serialize(text)
    m.header.frame_id = "radar_link"
    return m, int.from_bytes(hashlib.sha256(text.getvalue()).digest()[:8], "little")


def transform_message(stamp, pose):
    """map -> radar_link."""
    t = geometry_msgs.msg.TransformStamped()
    t.header.stamp, t.header.frame_id, t.child_frame_id = stamp, "map", "radar_link"
    v, q = t.transform.translation, t.transform.rotation
    v.x, v.y, v.z = pose.position
    q.x, q.y, q.z, q.w = quaternion(pose.rotation)
    return tf2_msgs.msg.TFMessage([t])


def write_moving_bag(settings, bag, lag_s):
    """Carries the radar through the session's places and writes the bag and, to settings.output, what describes room
    and radar. tf says lag_s later than it was where the radar is, each place by its pose error aside."""
    measurement = Measurement(settings)
    places = measurement.stations
    walk = Walk([s.true for s in places])
    start_ns = places[0].stamp_ns
    period_s = measurement.radar.frame_period_s
    stamps_ns = [start_ns + round(i * period_s * 1e9) for i in range(int(walk.end_s / period_s) + 1)]
    # One station per place, one per frame on the way.
    stations, of_frame = list(places), []
    for stamp_ns in stamps_ns:
        pose, place = walk.at(1e-9 * (stamp_ns - start_ns))
        of_frame.append(len(stations) if place is None else place)
        if place is None:
            stations.append(Station(f"way{len(stations)}", "", stamp_ns, pose, pose))
    measurement.stations = stations
    settings.frames = 1
    grids, _ = measurement.receive()
    config, radar_hash = config_message(measurement.radar)
    errors = [(s.reported.position - s.true.position, s.true.rotation.T @ s.reported.rotation) for s in places]

    def reported(t):
        pose, _ = walk.at(t)
        nearest = min(range(len(places)), key=lambda k: np.linalg.norm(places[k].true.position - pose.position))
        offset, turn = errors[nearest]
        return Pose(pose.position + offset, pose.rotation @ turn)

    def time_of(ns):
        return rospy.Time(int(ns) // 10**9, int(ns) % 10**9)

    messages = []   # (recorded, topic, message)
    config.header.stamp = time_of(start_ns)
    messages.append((start_ns, "/radar/config", config))
    for i, (stamp_ns, station) in enumerate(zip(stamps_ns, of_frame)):
        measurement.settings.seed += 1     # noise of its own
        samples = measurement.measure(station, grids[station])[0]
        cube = mmradartwin_msgs.msg.AdcCube(radar_hash=radar_hash, sequence=i, chirps=samples.shape[0] * samples.shape[1],
                                            samples_per_chirp=samples.shape[2], receivers=samples.shape[4])
        cube.header.stamp, cube.header.frame_id = time_of(stamp_ns), "radar_link"
        cube.samples = samples.transpose(0, 1, 2, 4, 3).ravel().tolist()
        cube.chirp_valid = bytes([1] * cube.chirps)
        messages.append((stamp_ns, "/radar/adc", cube))
    for i in range(int((walk.end_s + 2) / TF_PERIOD_S)):
        t = (i + 0.5) * TF_PERIOD_S - 1
        stamp_ns = start_ns + round((t + lag_s) * 1e9)
        messages.append((stamp_ns, "/tf", transform_message(time_of(stamp_ns), reported(t))))
    with rosbag.Bag(bag, "w") as out:
        for recorded_ns, topic, message in sorted(messages, key=lambda m: m[0]):
            out.write(topic, message, time_of(recorded_ns))
    os.makedirs(settings.output, exist_ok=True)
    write_description(settings.output, measurement)
