#!/usr/bin/env python3
"""A bag played through the chain: attribution/diagnose on the poses seen so far, twin/apply, and what follows."""
import json
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import unittest

import actionlib
import numpy
import rosgraph
import rospy
import yaml
from actionlib_msgs.msg import GoalStatus
from mmradartwin_msgs.msg import DiagnoseAction, DiagnoseGoal, Findings, Ledger, RangeAngleMap, Residuals, Scene
from mmradartwin_msgs.srv import ApplyTwin

from mmradartwin_tests import effects
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.session import Measurement, Settings
from wait_for import PATIENCE_S, wait_for


def next_message(topic, kind):
    """The next message, or the latched one."""
    received = []
    subscriber = rospy.Subscriber(topic, kind, received.append)
    try:
        return wait_for(lambda: received, topic)[0]
    finally:
        subscriber.unregister()


class Request:
    """A goal on its way."""

    def __init__(self, **goal):
        self.client = actionlib.SimpleActionClient("attribution/diagnose", DiagnoseAction)
        ends = self.client.action_client
        ends = (ends.pub_goal, ends.pub_cancel, ends.result_sub, ends.feedback_sub)
        wait_for(lambda: all(end.get_num_connections() for end in ends), "attribution/diagnose")
        self.feedback, self.done = [], threading.Event()
        self.client.send_goal(DiagnoseGoal(**goal), feedback_cb=self.feedback.append,
                              done_cb=lambda state, result: self.done.set())

    def wait(self):
        """(state, text, result) when it has ended."""
        if not self.done.wait(PATIENCE_S):
            raise AssertionError(f"the goal did not end; last feedback: {self.feedback[-1:]}")
        return self.client.get_state(), self.client.get_goal_status_text(), self.client.get_result()


class LiveDiagnosis(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="mmradartwin_live_")
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        # The channels' errors are known: what the chain takes out, the diagnosis has to take out, too.
        cls.errors = {"phase_deg": [0, 30, -20, 10, 25, 55, 5, 35], "gain_db": [0, 1, -1, 0.5, 0, 1, -1, 0.5]}
        with open(cls.at("channels.yaml"), "w", encoding="ascii") as file:
            yaml.safe_dump({"format": "mmradartwin_channels/1", **cls.errors}, file)
        chosen = [effects.make_effect(name, parameters, None)
                  for name, parameters in (("tx_rx_leakage", {}), ("channel_phase_error", cls.errors))]
        Measurement(Settings(output=cls.at("session"), seed=31, poses=8, frames=30, pause_s=0.3, effects=chosen)).run()
        quiet = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        for package, program, *arguments in (
                ("mmradartwin_dsp", "session_to_bag", cls.at("session"), cls.at("session.bag")),
                ("mmradartwin_attribution", "diagnose", cls.at("session.bag"), "--output", cls.at("offline"),
                 "--channels", cls.at("channels.yaml"))):
            subprocess.run([find_program(package, program), *arguments], check=True, timeout=PATIENCE_S, **quiet)
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_HOME=cls.at("ros_home"))
        with open(cls.at("log"), "w", encoding="utf-8") as log:
            cls.launch = subprocess.Popen(["roslaunch", "-p", str(port), "mmradartwin_launch", "twin_chain.launch",
                                           "rviz:=false", "folder:=" + cls.folder, "channels:=channels.yaml"],
                                          stdout=log, stderr=subprocess.STDOUT,
                                          stdin=subprocess.DEVNULL, start_new_session=True)
        cls.addClassCleanup(cls.end_launch)
        master = rosgraph.Master("/live_diagnosis_test")
        wait_for(master.is_online, "roscore")
        wanted = {"/signal_chain", "/twin", "/attribution", "/diagnosis"}
        wait_for(lambda: wanted <= {n for ends in master.getSystemState() for _, nodes in ends for n in nodes},
                   "nodes")
        listeners = {"/signal_chain", "/diagnosis"}
        wait_for(lambda: listeners <= set(dict(master.getSystemState()[1]).get("/radar/adc", [])), "listeners")
        rospy.init_node("live_diagnosis_test", disable_signals=True)

        # As a user asks who is too early; then the session comes, and he asks again.
        ask = [find_program("mmradartwin_attribution", "request_diagnosis"), "--wait", str(PATIENCE_S)]
        cls.early = subprocess.run(ask, capture_output=True, text=True, timeout=2 * PATIENCE_S, check=False)
        play = ["rosbag", "play", "--quiet", "--delay", "4", "--rate", "2", cls.at("session.bag")]
        subprocess.run(play, check=True, timeout=PATIENCE_S, **quiet)
        cls.request = Request(output=cls.at("live"))
        cls.state, cls.text, cls.result = cls.request.wait()

    @classmethod
    def at(cls, *names):
        return os.path.join(cls.folder, *names)

    @classmethod
    def end_launch(cls):
        cls.launch.send_signal(signal.SIGINT)
        try:
            cls.launch.wait(30)
        except subprocess.TimeoutExpired:
            os.killpg(cls.launch.pid, signal.SIGKILL)

    def log(self):
        with open(self.at("log"), encoding="utf-8", errors="replace") as file:
            return file.read()[-3000:]

    @staticmethod
    def findings_of(file):
        with open(file, encoding="utf-8") as text:
            return json.load(text)

    @staticmethod
    def apply(file):
        return rospy.ServiceProxy("twin/apply", ApplyTwin)(file)

    def test_asked_before_any_pose_it_says_what_to_wait_for(self):
        self.assertEqual(self.early.returncode, 2, self.early.stderr)
        self.assertIn("radar/config", self.early.stderr)

    def test_it_finds_what_the_offline_program_finds(self):
        self.assertEqual(self.state, GoalStatus.SUCCEEDED, self.text + self.log())
        live = self.findings_of(self.result.findings_file)
        offline = self.findings_of(self.at("offline", "findings.json"))
        self.assertEqual([f["cause"] for f in live["findings"]], ["tx_rx_leakage"])
        self.assertEqual(live["poses"], offline["poses"])
        self.assertEqual([f["cause"] for f in live["findings"]], [f["cause"] for f in offline["findings"]])
        for one, other in zip(live["findings"], offline["findings"]):
            self.assertEqual(one["parameters"].keys(), other["parameters"].keys())
            for name, parameter in one["parameters"].items():
                numpy.testing.assert_allclose(parameter["value"], other["parameters"][name]["value"], rtol=1e-6)
            gains = [f["evidence"]["log_likelihood_gain"] for f in (one, other)]
            numpy.testing.assert_allclose(gains[0], gains[1], rtol=1e-6)

    def test_a_twin_with_the_channel_errors_that_are_taken_out_is_refused(self):
        with open(self.at("twice.yaml"), "w", encoding="ascii") as file:
            yaml.safe_dump({"mechanisms": {"specular": {"max_bounces": 3}, "channel_phase_error": self.errors}}, file)
        state, text, _ = Request(output=self.at("twice"), twin=self.at("twice.yaml")).wait()
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn("count twice", text)

    def test_the_result_says_the_same_as_the_file(self):
        file = self.findings_of(self.result.findings_file)
        findings = self.result.findings
        self.assertEqual(findings.verdict, file["verdict"])
        self.assertEqual(self.result.poses, 8)
        first, entry = findings.findings[0], file["findings"][0]
        self.assertEqual([first.cause, first.residual_class, first.action],
                         [entry[key] for key in ("cause", "class", "action")])
        self.assertEqual({p.name: (p.unit, p.value[0]) for p in first.parameters},
                         {name: (p["unit"], p["value"]) for name, p in entry["parameters"].items()})
        self.assertEqual([first.explained_power_before, first.explained_power_after],
                         [entry["gain"]["explained_power"][key] for key in ("before", "after")])
        self.assertEqual(json.loads(first.json), entry)
        self.assertEqual(next_message("attribution/findings", Findings).json, findings.json)
        for name in (self.result.report_file, self.result.extended_twin_file):
            self.assertTrue(os.path.isfile(name), name)

    def test_feedback_tells_how_far_it_is(self):
        stages = [f.stage for f in self.request.feedback]
        self.assertIn("reading captures", stages)
        self.assertGreater(len(set(stages)), 5)
        self.assertTrue(all(0 <= f.share <= 1 for f in self.request.feedback))

    def test_a_goal_can_be_cancelled_and_leaves_nothing(self):
        request = Request(output=self.at("cancelled"))
        wait_for(lambda: request.feedback, "feedback")
        request.client.cancel_goal()
        state, text, _ = request.wait()
        self.assertEqual(state, GoalStatus.PREEMPTED, text)
        self.assertFalse(os.path.exists(self.at("cancelled")))

    def test_a_goal_that_cannot_be_met_says_why(self):
        state, text, _ = Request(output="somewhere").wait()
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn("absolute", text)
        state, text, _ = Request(output=self.at("other"), twin=self.at("no_twin.yaml")).wait()
        self.assertEqual(state, GoalStatus.ABORTED)
        self.assertIn("no_twin.yaml", text)

    def test_a_twin_that_cannot_be_used_is_refused_and_the_old_one_stays(self):
        before = next_message("twin/scene", Scene)
        with open(self.at("bad.yaml"), "w", encoding="utf-8") as file:
            file.write("mechanisms:\n  specular: {max_bounces: 3}\n  warp_drive: {}\n")
        for name, reason in ((self.at("bad.yaml"), "warp_drive"), (self.at("nowhere.yaml"), "nowhere.yaml"),
                             ("bad.yaml", "absolute")):
            answer = self.apply(name)
            self.assertFalse(answer.success, name)
            self.assertIn(reason, answer.message)
        after = next_message("twin/scene", Scene)
        self.assertEqual(after.header.seq, before.header.seq)
        self.assertEqual(after.twin_yaml, before.twin_yaml)

    def test_the_extended_twin_is_simulated_once_applied(self):
        def simulated():
            return numpy.array(next_message("twin/range_angle", RangeAngleMap).power_db)

        cause = self.result.findings.findings[0].cause
        self.assertNotIn(cause, next_message("twin/scene", Scene).twin_yaml)
        self.assertGreater(next_message("attribution/ledger", Ledger).poses, 0)
        before, residuals = simulated(), []
        subscriber = rospy.Subscriber("attribution/residuals", Residuals, residuals.append)
        self.addCleanup(subscriber.unregister)
        wait_for(subscriber.get_num_connections, "attribution/residuals")
        answer = self.apply(self.result.extended_twin_file)
        self.assertTrue(answer.success, answer.message)
        self.assertIn(cause, next_message("twin/scene", Scene).twin_yaml)
        wait_for(lambda: numpy.abs(simulated() - before).max() > 3, "the map of the extended twin")
        wait_for(lambda: next_message("attribution/ledger", Ledger).poses == 0, "a ledger of the new twin's own")
        # The stream has ended, and its last map is compared with the new twin all the same.
        wait_for(lambda: residuals, "residuals of the new twin")
        answer = self.apply("")
        self.assertTrue(answer.success, answer.message)
        wait_for(lambda: numpy.abs(simulated() - before).max() < 1e-3, "the map of the twin at the start")


if __name__ == "__main__":
    unittest.main()
