#!/usr/bin/env python3
"""A whole live session whose pose comes from the camera's cloud: live.launch rig:=emulated pose:=room on the office."""
import math
import os
import shutil
import subprocess
import tempfile
import unittest

import numpy
import rosbag

from mmradartwin_tests.installed_programs import find_program
from made_session import make_session
from test_emulated_rig import Rig
from test_launch_files import end
from wait_for import wait_for

CAMERA = find_program("mmradartwin_sim", "resting_camera")
FRAMES = 40
PLACE_M, YAW, PITCH = (6.0, 1.5, 1.25), 1.6, 0.08   # of camera_link in map: where the office fixes all directions
MOUNT_M = (0.05, 0.02, -0.03)                       # camera_link -> radar_link, not turned


def camera_rotation():
    """[3, 3] R_map_camera."""
    c, s = math.cos(YAW), math.sin(YAW)
    cp, sp = math.cos(PITCH), math.sin(PITCH)
    return numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ numpy.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])


def rotation_of(q):
    """[3, 3] of a geometry_msgs/Quaternion."""
    x, y, z, w = q.x, q.y, q.z, q.w
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


@unittest.skipUnless(os.geteuid() == 0, "an emulated card's network needs root")
class RoomPoseLive(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="mmradartwin_room_")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.session = os.path.join(self.folder, "session")
        make_session(self.session, 1, FRAMES, "--duplicates", "0")

    def camera(self, rig):
        camera = subprocess.Popen([CAMERA, os.path.join(self.session, "scene.yaml"), *map(str, PLACE_M), str(YAW),
                                   str(PITCH), "cloud:=/camera/depth/color/points", "imu:=/camera/imu"],
                                  env=rig.environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(end, camera)
        return camera

    def recorded(self, rig, name, counts, more=()):
        """Messages until so many have come, {topic: count}, and of more topics: [(topic, message)]."""
        file = os.path.join(self.folder, name + ".bag")
        rig.record(counts, file, more)
        with rosbag.Bag(file) as bag:
            return [(topic, message) for topic, message, _ in bag.read_messages()]

    def test_frames_have_the_pose_that_the_camera_finds(self):
        guess = f"{PLACE_M[0] + 0.15} {PLACE_M[1] - 0.1} {math.degrees(YAW) + 4}"
        with Rig(self.folder, self.session, None, "pose:=room", "initial_pose:=" + guess, "diagnosis:=false",
                 "camera_height:=1.3", "mount:=" + " ".join(map(str, MOUNT_M)) + " 0 0 0",
                 "scene:=" + os.path.join(self.session, "scene.yaml")) as rig:
            rig.wait_for_text("samples arrive", 1, 240)
            # Nobody else says where the rig is, and it has not looked yet.
            before = self.recorded(rig, "before", {"/radar/grid": 2 * FRAMES, "/diagnostics": 3}, ["/tf"])
            self.assertTrue([m for t, m in before if t == "/radar/grid"], "no grids come")
            self.assertFalse([m for t, m in before if t == "/radar/grid" and m.pose_valid])
            self.assertFalse([m for t, m in before if t == "/tf"])

            camera = self.camera(rig)
            wait_for(lambda: any(m.pose_valid for _, m in self.recorded(rig, "first", {"/radar/grid": FRAMES // 2})),
                     lambda: "a frame with a pose:\n" + rig.text()[-3000:])
            seen = self.recorded(rig, "seen", {"/radar/grid": 3 * FRAMES, "/room_pose": 3, "/twin/grid": 1,
                                               "/diagnostics": 3}, ["/tf"])
            end(camera)
            rig.wait_for_text("goes on without a pose", rig.text().count("goes on without a pose") + 1)
            blind = self.recorded(rig, "blind", {"/radar/grid": 2 * FRAMES, "/diagnostics": 3})
        R = camera_rotation()
        true_m = numpy.array(PLACE_M) + R @ numpy.array(MOUNT_M)
        posed = [m for t, m in seen if t == "/radar/grid" and m.pose_valid]
        self.assertGreater(len(posed), 20)
        for message in posed:
            p = message.T_map_radar.position
            self.assertLess(numpy.linalg.norm([p.x, p.y, p.z] - true_m), 0.03)
            turned = R.T @ rotation_of(message.T_map_radar.orientation)
            self.assertLess(math.degrees(math.acos(min(1.0, (numpy.trace(turned) - 1) / 2))), 1.0)
        # It stands still: a fit's noise does not begin the average anew, and the twin stands where the frames do.
        self.assertGreater(max(m.frames for m in posed), 5)
        twin = [m.T_map_radar.position for t, m in seen if t == "/twin/grid"]
        self.assertTrue(twin)
        for p in twin:
            self.assertLess(numpy.linalg.norm([p.x, p.y, p.z] - true_m), 0.03)
        self.assertEqual({m.child_frame_id for t, message in seen if t == "/tf" for m in message.transforms},
                         {"camera_link"})
        self.assertTrue([m for t, m in seen if t == "/room_pose" and 0 < m.pose.covariance[0] < 4e-4])

        # A camera that falls silent: no pose is made up.
        last = [m for t, m in blind if t == "/radar/grid"]
        self.assertTrue(last)
        self.assertFalse(last[-1].pose_valid)

        for messages, task, level, words in ((before, "pose from the room", 2, "no cloud on"),
                                             (seen, "pose from the room", 0, "publishing"),
                                             (blind, "pose from the room", 2, "no cloud on"),
                                             (blind, "radar pose", 2, "old")):
            said = {(s.level, s.message) for t, m in messages if t == "/diagnostics" for s in m.status
                    if task in s.name}
            self.assertTrue([1 for given, text in said if given == level and words in text], f"{task}, {words}: {said}")


if __name__ == "__main__":
    unittest.main()
