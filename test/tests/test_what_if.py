#!/usr/bin/env python3
"""A twin that is changed by hand while results are inspected and while a bag is replayed: maps, numbers and files follow."""
import json
import os
import subprocess
import sys
import time
import unittest

import yaml

from in_folder import InFolder
from made_session import make_session
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import Launched, end

# In a process of its own: rospy knows one master for as long as it lives. Each line of standard input is a service and
# its request; answers with what it said, the state after it, and the maps that were published last.
DRIVE = """
import json, math, sys, threading, rospy
from mmradartwin_msgs.msg import RangeAngleMap, WhatIf
from mmradartwin_msgs.srv import EditTwin, EditTwinRequest, SaveTwin
from std_srvs.srv import Trigger
from visualization_msgs.msg import InteractiveMarkerFeedback as Feedback
rospy.init_node("hand")
news, seen = threading.Condition(), {}
def keep(key, message):
    with news:
        seen[key] = message
        news.notify_all()
for topic in ("range_angle", "residual_map"):
    rospy.Subscriber("/what_if/" + topic, RangeAngleMap, lambda m, topic=topic: keep(topic, m))
rospy.Subscriber("/what_if/state", WhatIf, lambda m: keep("state", m))
types = {"edit": EditTwin, "save": SaveTwin, "undo": Trigger, "revert": Trigger}
for name in types:
    rospy.wait_for_service("/what_if/" + name, 60)
def numbers(n):
    return {k: None if math.isnan(getattr(n, k)) else getattr(n, k) for k in n.__slots__}
handles = rospy.Publisher("/what_if/handles/feedback", Feedback, queue_size=10)
def drag(actor, steps_m):
    center = next(a.center for a in seen["state"].actors if a.name == actor)
    def tell(event, x_m):
        f = Feedback(client_id="hand", marker_name=actor, event_type=event)
        f.header.frame_id, f.pose.orientation.w = "map", 1
        f.pose.position.x, f.pose.position.y, f.pose.position.z = center.x + x_m, center.y, center.z
        handles.publish(f)
    tell(Feedback.MOUSE_DOWN, 0)
    for x_m in steps_m:
        tell(Feedback.POSE_UPDATE, x_m)
        rospy.rostime.wallsleep(0.1)
    tell(Feedback.MOUSE_UP, steps_m[-1])
    wait(lambda: any(a.name == actor and abs(a.shift_m[0] - steps_m[-1]) < 1e-9 for a in seen["state"].actors))
def wait(when):
    with news:
        if not news.wait_for(when, 60):
            raise SystemExit("no " + str(sorted({"range_angle", "residual_map", "state"} - set(seen))) + str(seen.get("state")))
for line in sys.stdin:
    name, request = json.loads(line)
    if name == "wait":
        wait(lambda: len(seen) == 3 and not seen["state"].problem)
        answer = None
    elif name == "drag":
        drag(**request)
        answer = None
    else:
        if "kind" in request:
            request["kind"] = getattr(EditTwinRequest, request["kind"])
        with news:
            seen.clear()
        answer = rospy.ServiceProxy("/what_if/" + name, types[name])(**request)
        wait(lambda: len(seen) == 3 or name == "save" or name == "edit" and not answer.success and "state" in seen)
    with news:
        state = seen.get("state")
        print(json.dumps({
            "success": answer.success if answer else True, "message": answer.message if answer else "",
            "twin": getattr(answer, "twin_file", ""),
            "given": numbers(state.given) if state else None, "now": numbers(state.now) if state else None,
            "edits": state.edits if state else None, "traced": state.traced if state else None,
            "simulated_ms": state.simulated_ms if state else None, "shown_ms": state.shown_ms if state else None,
            "actors": {a.name: [a.material, a.hidden, list(a.shift_m), a.yaw_deg] for a in state.actors} if state else None,
            "mechanisms": {m.name: m.on for m in state.mechanisms} if state else None,
            "map": list(seen["range_angle"].power_db) if "range_angle" in seen else None}), flush=True)
"""

STILL_S = 3  # after a bag's end, until its last maps have come


def largest_difference(a, b):
    return max(abs(x - y) for x, y in zip(a, b) if x == x and y == y)


class Hand:
    """Somebody who changes the twin by hand."""

    def __init__(self, test, launched):
        self.test = test
        self.launched = launched
        self.process = subprocess.Popen([sys.executable, "-c", DRIVE], env=launched.environment, stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        test.addCleanup(end, self.process)
        test.addCleanup(self.process.stdin.close)
        test.addCleanup(self.process.stdout.close)

    def __call__(self, service, **request):
        self.process.stdin.write(json.dumps([service, request]) + "\n")
        self.process.stdin.flush()
        line = self.process.stdout.readline()
        self.test.assertTrue(line, self.launched.text()[-2000:])
        return json.loads(line)

    def edit(self, kind, **request):
        answer = self("edit", kind=kind, **request)
        self.test.assertTrue(answer["success"], answer["message"])
        return answer


class WhatIf(InFolder):
    def setUp(self):
        super().setUp()
        make_session(self.at("session"), 2, 60, "--duplicates", "0", "--effect", "element_pattern")

    def check_changes(self, launched):
        hand = Hand(self, launched)
        hand("wait")
        begin = hand("undo")  # of nothing: the state with the map that came last
        self.assertFalse(begin["success"])
        self.assertEqual(begin["given"], begin["now"])
        self.assertEqual(begin["edits"], [])
        self.assertGreater(begin["given"]["recall"], 0)
        self.assertFalse(begin["mechanisms"]["element_pattern"])

        # What the session's radar has and the twin lacks explains more of the power.
        hand.edit("MECHANISM", mechanism="element_pattern", entry=0, enabled=True)
        pattern = hand.edit("PARAMETER", mechanism="element_pattern", entry=0, key="cos_exponent", value=2.0)
        self.assertFalse(pattern["traced"])
        self.assertGreater(pattern["now"]["explained_power"], pattern["given"]["explained_power"])
        self.assertEqual(pattern["given"], begin["given"])
        self.assertGreater(largest_difference(pattern["map"], begin["map"]), 1)

        glass = hand.edit("MATERIAL", actor="cabinet_north", material="Glass")
        self.assertFalse(glass["traced"])
        self.assertEqual(glass["actors"]["cabinet_north"][0], "Glass")
        moved = hand.edit("MOVE", actor="tv", shift_m=[0.5, 0.2, 0], yaw_deg=30)
        self.assertTrue(moved["traced"])
        self.assertEqual(moved["actors"]["tv"][2:], [[0.5, 0.2, 0], 30])
        hidden = hand.edit("HIDE", actor="tv", enabled=True)
        self.assertTrue(hidden["actors"]["tv"][1])
        turned = hand.edit("RADAR", shift_m=[0, 0, 0], yaw_deg=20, pitch_deg=0)
        self.assertGreater(largest_difference(turned["map"], hidden["map"]), 3)
        self.assertEqual(len(turned["edits"]), 6)

        refused = hand("edit", kind="PARAMETER", mechanism="element_pattern", entry=0, key="cos_exponent", value=1e9)
        self.assertFalse(refused["success"])
        self.assertIn("cos_exponent", refused["message"])
        self.assertEqual(refused["edits"], turned["edits"])

        undone = hand("undo")
        self.assertEqual(undone["edits"], hidden["edits"])
        self.assertLess(largest_difference(undone["map"], hidden["map"]), 1e-3)
        dragged = hand("drag", actor="bin", steps_m=[0.1, 0.2, 0.3])  # by the mouse, in rviz
        self.assertEqual(len(dragged["edits"]), len(hidden["edits"]) + 1, dragged["edits"])
        self.assertEqual(hand("undo")["edits"], hidden["edits"])
        saved = hand("save", folder=self.at("saved"), overwrite=False)
        self.assertTrue(saved["success"], saved["message"])
        self.assertFalse(hand("save", folder=self.at("saved"), overwrite=False)["success"])
        reverted = hand("revert")
        self.assertEqual(reverted["now"], begin["given"])
        self.assertEqual(reverted["map"], begin["map"])
        self.assertFalse(hand("revert")["success"])
        with open(saved["twin"], encoding="utf-8") as file:
            twin = yaml.safe_load(file)
        self.assertEqual(twin["mechanisms"]["element_pattern"]["cos_exponent"], 2)
        self.assertEqual(twin["mechanisms"]["actor_absent"]["actor"], "tv")


    def test_stored_results(self):
        subprocess.run([find_program("mmradartwin_attribution", "evaluate"), self.at("session"), "--output",
                        self.at("report"), "--quiet", "--no-pictures"], check=True, capture_output=True, timeout=300)
        with Launched("inspect.launch", "results:=" + self.at("report"), "rviz:=false", "pause:=true") as launched:
            self.check_changes(launched)
        # The saved twin is one that evaluate takes.
        subprocess.run([find_program("mmradartwin_attribution", "evaluate"), self.at("session"), "--twin",
                        self.at("saved", "twin.yaml"), "--output", self.at("again"), "--quiet", "--no-pictures"],
                       check=True, capture_output=True, timeout=300)
        explained = []
        for report in ("report", "again"):
            with open(self.at(report, "summary.json"), encoding="utf-8") as file:
                explained.append(json.load(file))
        self.assertNotEqual(explained[0]["answer"], explained[1]["answer"])

    def test_replay(self):
        subprocess.run([find_program("mmradartwin_dsp", "session_to_bag"), self.at("session"), self.at("lab.bag")],
                       check=True, capture_output=True, timeout=300)
        with Launched("replay.launch", "bag:=" + self.at("lab.bag"), "rviz:=false", "diagnosis:=false") as launched:
            launched.wait_for_text("the bag is over")
            time.sleep(STILL_S)
            self.check_changes(launched)
        # The bag's scene goes with the process that unpacked it: what was saved has its own.
        with open(self.at("saved", "scene.yaml"), encoding="utf-8") as file:
            for mesh in yaml.safe_load(file)["meshes"]:
                self.assertTrue(os.path.exists(self.at("saved", mesh["file"])), mesh)


if __name__ == "__main__":
    unittest.main()
