#!/usr/bin/env python3
"""Rates and lag of the live twin: twin_node, beside rviz, fed with measured grids at the radar's frame rate.

Three phases of --seconds each: the radar stands, it moves (0.3 m/s, 20 deg/s), it stands while an actor moves with tf.
For each: grids sent and simulated per second, lag from sending a grid to receiving the twin's of the same stamp, and
grids that got no answer because a newer one had come. Nothing is asserted: the figures are the machine's.
"""
import argparse
import math
import os
import signal
import socket
import subprocess
import sys
import time

import rosgraph
import rospkg

sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

from mmradartwin_tests.arguments import positive

HEADER = f"{'phase':<22}{'sent/s':>8}{'twin/s':>8}{'lag median':>12}{'95 %':>8}{'worst':>8}{'skipped':>9}"


def free_port():
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def wait_for(condition, patience_s=60):
    deadline = time.monotonic() + patience_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.1)
    return True


class Stream:
    """radar/grid as the signal chain publishes it, and what comes back on twin/grid."""

    def __init__(self, rate_hz):
        import rospy
        import tf2_ros
        from geometry_msgs.msg import TransformStamped
        from mmradartwin_msgs.msg import ReceiveGrid

        self.rospy, self.Grid, self.Transform, self.rate_hz = rospy, ReceiveGrid, TransformStamped, rate_hz
        self.sent, self.lags = {}, []
        self.publisher = rospy.Publisher("radar/grid", ReceiveGrid, queue_size=100)
        self.broadcaster = tf2_ros.TransformBroadcaster()
        rospy.Subscriber("twin/grid", ReceiveGrid, self.on_grid, queue_size=100, tcp_nodelay=True)

    def on_grid(self, grid):
        now, sent = time.monotonic(), self.sent.pop(grid.header.stamp.to_nsec(), None)
        if sent is not None:
            self.lags.append(now - sent)

    def send(self, x, y, yaw, transform):
        message = self.Grid(channels=8, samples=64, data=[0.0] * 1024, full_scale=32768, frames=1, pose_valid=True)
        message.header.stamp = self.rospy.Time.now()
        message.header.frame_id = "radar_link"
        pose = message.T_map_radar
        pose.position.x, pose.position.y, pose.position.z = x, y, 1.0
        pose.orientation.z, pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
        for child, (at_x, at_y, at_z, turn) in transform.items():
            T = self.Transform()
            T.header.stamp, T.header.frame_id, T.child_frame_id = message.header.stamp, "map", child
            T.transform.translation.x, T.transform.translation.y, T.transform.translation.z = at_x, at_y, at_z
            T.transform.rotation.z, T.transform.rotation.w = math.sin(turn / 2), math.cos(turn / 2)
            self.broadcaster.sendTransform(T)
        self.sent[message.header.stamp.to_nsec()] = time.monotonic()
        self.publisher.publish(message)

    def answered(self):
        """True once the node simulates; until then one more grid is sent at each call."""
        if not self.lags:
            self.send(3.0, 2.6, 0.3, {})
        return bool(self.lags)

    def phase(self, name, seconds, pose_at, actor_at=None):
        """Prints one row; pose_at and actor_at say x, y, yaw and x of the time since the phase began."""
        self.sent.clear()
        self.lags.clear()
        begin = time.monotonic()
        count = int(seconds * self.rate_hz)
        for i in range(count):
            time.sleep(max(0.0, begin + i / self.rate_hz - time.monotonic()))
            t = i / self.rate_hz
            x, y, yaw = pose_at(t)
            transform = {"radar_link": (x, y, 1.0, yaw)}
            if actor_at:
                transform["bin"] = (actor_at(t), 0.0, 0.0, 0.0)
            self.send(x, y, yaw, transform)
        took = time.monotonic() - begin
        time.sleep(1)  # for the last grids
        lags = sorted(self.lags)
        at = lambda share: 1e3 * lags[min(len(lags) - 1, int(share * len(lags)))] if lags else float("nan")
        print(f"{name:<22}{count / took:8.1f}{len(lags) / took:8.1f}{at(0.5):9.1f} ms{at(0.95):8.1f}{at(1.0):8.1f}"
              f"{count - len(lags):9d}", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=positive, default=10, help="of each phase")
    parser.add_argument("--rate", type=positive, default=20, help="frames per second")
    parser.add_argument("--no-rviz", action="store_true", help="without rviz beside it")
    parser.add_argument("--twin", default="", help="twin.yaml; default: the base mechanisms")
    arguments = parser.parse_args()
    if arguments.twin and not os.path.isfile(arguments.twin):
        parser.error(f"--twin {arguments.twin}: is no file")
    config = rospkg.RosPack().get_path("mmradartwin_config")
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{free_port()}"
    port = os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # ends what was started
    processes = []

    def start(*command):
        # A session of its own, so that what rosrun and xvfb-run start ends with them.
        processes.append(subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                          start_new_session=True))

    try:
        start("roscore", "-p", port)
        if not wait_for(rosgraph.is_master_online):
            print("error: no roscore came up within 60 s", file=sys.stderr)
            return 1
        node = ["rosrun", "mmradartwin_sim", "twin_node", f"_scene:={config}/office/scene.yaml",
                f"_radar:={config}/radar.yaml"]
        start(*node, *([f"_twin:={arguments.twin}"] if arguments.twin else []))
        if not arguments.no_rviz:
            rviz = ["rosrun", "rviz", "rviz", "-d", f"{config}/rviz/twin.rviz"]
            start(*rviz if os.environ.get("DISPLAY") else ["xvfb-run", "-a", "-s", "-screen 0 1600x1000x24"] + rviz)
        import rospy
        rospy.init_node("measure_live_twin", disable_signals=True)
        stream = Stream(arguments.rate)
        if not wait_for(stream.answered):
            print("error: twin_node did not answer within 60 s", file=sys.stderr)
            return 1
        time.sleep(0 if arguments.no_rviz else 8)  # rviz reads its meshes
        print(HEADER, flush=True)
        stands = lambda t: (3.0, 2.6, 0.3)
        stream.phase("radar stands", arguments.seconds, stands)
        stream.phase("radar moves", arguments.seconds,
                     lambda t: (3.0 + 0.5 * math.sin(0.6 * t), 2.6, 0.3 + math.radians(20) * t))
        stream.phase("an actor moves", arguments.seconds, stands, lambda t: 0.3 * math.sin(t))
        return 0
    finally:
        for end in (signal.SIGTERM, signal.SIGKILL):
            for process in reversed(processes):
                try:
                    os.killpg(process.pid, end)
                except ProcessLookupError:
                    continue
                try:
                    process.wait(10)
                except subprocess.TimeoutExpired:
                    pass


if __name__ == "__main__":
    sys.exit(main())
