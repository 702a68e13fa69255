#!/usr/bin/env python3
"""What attribution_node lets tune by eye while it runs."""
import json
import os
import subprocess
import sys
import unittest
import unittest.mock

import rosgraph

from in_folder import InFolder
from made_session import make_session
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import Launched, end, free_port, start_master
from wait_for import wait_for

# In a process of its own: rospy knows one master for as long as it lives. Prints a line of JSON for each change:
# the values in use then, and what the next markers and residuals show, where it was taken.
TUNE = """
import json, sys, threading, rospy
from dynamic_reconfigure.client import Client
from mmradartwin_msgs.msg import Residuals
from visualization_msgs.msg import Marker, MarkerArray
rospy.init_node("tuner")
news, seen = threading.Condition(), {}
def keep(key, message):
    with news:
        seen[key] = message
        news.notify_all()
rospy.Subscriber("/attribution/residuals", Residuals, lambda m: keep("residuals", m), queue_size=10)
rospy.Subscriber("/attribution/markers", MarkerArray, lambda m: keep("markers", m), queue_size=10)
client = Client("/attribution/tuning", timeout=60)
def shown():
    with news:
        if not news.wait_for(lambda: len(seen) == 2, 60):
            raise SystemExit("no markers and residuals after a change")
        markers = [m for m in seen["markers"].markers if m.action == Marker.ADD]
        return {"path points": sum(len(m.points) for m in markers if m.ns.startswith("paths ")),
                "responses": sum(len(m.points) for m in markers if m.ns in ("matched", "C1", "C2", "C3", "C4", "C5")),
                "residuals": len(seen["residuals"].residuals)}
for line in sys.stdin:
    with news:
        seen.clear()
    wanted = json.loads(line)
    values = client.update_configuration(wanted)
    taken = all(values[name] == value for name, value in wanted.items())
    print(json.dumps([{k: values[k] for k in values if k != "groups"}, shown() if taken else None]), flush=True)
"""


class Tuning(InFolder):
    def test_the_last_pair_of_maps_shows_each_change(self):
        make_session(self.at("session"), 2, 60, "--duplicates", "0")
        subprocess.run([find_program("mmradartwin_dsp", "session_to_bag"), self.at("session"), self.at("lab.bag")],
                       check=True, capture_output=True, timeout=300)
        self.enterContext(unittest.mock.patch.dict(os.environ, ROSCONSOLE_STDOUT_LINE_BUFFERED="1"))
        with Launched("replay.launch", "bag:=" + self.at("lab.bag"), "rviz:=false", "diagnosis:=false") as launched:
            launched.wait_for_text("the bag is over")  # and nothing comes by itself any more
            tuner = subprocess.Popen([sys.executable, "-c", TUNE], env=launched.environment, stdin=subprocess.PIPE,
                                     stdout=subprocess.PIPE, text=True)
            self.addCleanup(end, tuner)
            self.addCleanup(tuner.stdin.close)
            self.addCleanup(tuner.stdout.close)

            def tuned(**values):
                tuner.stdin.write(json.dumps(values) + "\n")
                tuner.stdin.flush()
                line = tuner.stdout.readline()
                self.assertTrue(line, launched.text()[-2000:])
                return json.loads(line)

            values, first = tuned(max_paths=50)
            self.assertEqual((values["max_paths"], values["strong_db"]), (50, -15))
            self.assertGreater(first["path points"], 0)
            self.assertGreater(first["residuals"] + first["responses"], 0)
            self.assertEqual(tuned(max_paths=0)[1]["path points"], 0)

            # Thresholds: fewer responses are compared above a higher level, more above a lower one.
            few = tuned(strong_db=-1)[1]
            many = tuned(weak_db=-45, medium_db=-42, strong_db=-40)[1]
            self.assertLess(few["responses"], first["responses"])
            self.assertGreater(many["residuals"], first["residuals"])
            launched.wait_for_text("the ledger begins anew", 2)

            # What contradicts itself stays as it was, and so does the rest of the same request.
            values, _ = tuned(strong_db=-44, max_paths=7)
            self.assertEqual((values["strong_db"], values["max_paths"]), (-40, 0))
            self.assertEqual(tuned(max_paths=0)[1], many)
            launched.wait_for_text("tuning refused: medium_db must not be above strong_db")

    def test_a_new_run_begins_with_parameters_and_files(self):
        environment = dict(os.environ, ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1",
                           ROS_HOME=self.folder)
        self.addCleanup(end, start_master(environment))
        master = rosgraph.Master("/test", environment["ROS_MASTER_URI"])
        master.setParam("/attribution/tuning", {"max_paths": 3, "of_another_version": 1})
        with open(self.at("attribution.yaml"), "w", encoding="ascii") as file:
            file.write("strong_db: -12\n")
        node = subprocess.Popen([find_program("mmradartwin_attribution", "attribution_node"), "_markers_hz:=3",
                                 "_config:=" + self.at("attribution.yaml")], env=environment)
        self.addCleanup(end, node)

        def tuned_to():
            """The values that the node has begun with, None before."""
            try:
                values = master.getParam("/attribution/tuning")
            except rosgraph.MasterException:  # what was left behind is gone, and nothing there yet
                return None
            return values if values.get("strong_db") == -12 else None

        tuned = wait_for(tuned_to, "the node's values")
        self.assertEqual((tuned["max_paths"], tuned["markers_hz"]), (60, 3))
        self.assertNotIn("of_another_version", tuned)


if __name__ == "__main__":
    unittest.main()
