#!/usr/bin/env python3
"""rviz's window driven as a person does, with Qt's events: the panel Twin and the tool Why?, and the messages that follow."""
import math
import os
import queue
import re
import subprocess
import tempfile
import threading
import time
import unittest
import unittest.mock

import numpy
import rosbag
import rosgraph
import rospkg

from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.virtual_screen import VirtualScreen
from test_demo_loop import picture_pixels
from test_emulated_rig import Rig
from test_launch_files import Launched, end
from wait_for import PATIENCE_S, wait_for

# With pictures of what was driven in this folder; else none are kept.
PICTURES = os.environ.get("MMRADARTWIN_PICTURES", "")
LEAST_CONTRAST = 3    # of letters with what lies under them, WCAG 2


class Window:
    """drive_rviz with the shipped layout on a screen of its own."""

    def __init__(self, environment, folder, layout="twin", **more):
        self.screen = VirtualScreen(1920, 1080)
        self.folder = folder
        layout = os.path.join(rospkg.RosPack().get_path("mmradartwin_config"), "rviz", layout + ".rviz")
        self.log = open(os.path.join(folder, "drive.log"), "w", encoding="utf-8")
        keys = ("ROS_MASTER_URI", "ROS_IP")
        self.process = subprocess.Popen([find_program("mmradartwin_attribution", "drive_rviz"), layout],
                                        env=dict(self.screen.environment, **{k: environment[k] for k in keys}, **more),
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.log, text=True)
        self.answers = queue.Queue()
        threading.Thread(target=self.read, daemon=True).start()
        assert self.answer() == "window"

    def read(self):
        for line in self.process.stdout:
            if line.startswith(("ok", "error")):
                self.answers.put(line.rstrip("\n"))

    def answer(self):
        try:
            word, _, text = self.answers.get(timeout=PATIENCE_S).partition(" ")
        except queue.Empty:
            raise AssertionError("the window does not answer") from None
        if word != "ok":
            raise AssertionError(text)
        return text

    def do(self, order):
        self.process.stdin.write(order + "\n")
        self.process.stdin.flush()
        return self.answer()

    def text(self, name):
        return self.do("text " + name)

    def wait_for_text(self, name, words):
        return wait_for(lambda: (text := self.text(name)) and words in text and text,
                        lambda: f"\"{words}\" in {name}: {self.text(name)}; it says {self.text('said')}")

    def pixels(self, name):
        """What a widget shows, [rows][columns][red, green, blue]."""
        file = os.path.join(self.folder, "widget.png")
        self.do(f"grab {name} {file}")
        return picture_pixels(file)

    def faintest_label(self, name):
        """Of all words in a widget: how many there are, and the least contrast with what lies under them."""
        count, ratio = re.match(r"(\d+) labels, the faintest ([\d.]+)", self.do("contrast " + name)).groups()
        return int(count), float(ratio)

    def picture(self, name):
        if PICTURES:
            time.sleep(2)  # rviz draws what it has
            self.screen.picture(os.path.join(PICTURES, name + ".png"))

    def close(self):
        self.process.stdin.close()
        end(self.process, 20)
        self.process.stdout.close()
        self.screen.close()
        self.log.close()


class Driven(unittest.TestCase):
    effect, frames, locations = "element_pattern", "100", "3"

    @classmethod
    def setUpClass(cls):
        kept = tempfile.TemporaryDirectory(prefix="mmradartwin_panel_")
        cls.addClassCleanup(kept.cleanup)
        cls.folder = kept.name
        cls.session, cls.bag, cls.results = (os.path.join(cls.folder, n) for n in ("session", "lab.bag", "report"))
        for command in ([find_program("mmradartwin_tests", "make_session.py"), "--output", cls.session, "--locations",
                         cls.locations, "--headings", "1", "--frames", cls.frames, "--pause", "1", "--seed", "3",
                         "--effect", cls.effect],
                        [find_program("mmradartwin_dsp", "session_to_bag"), cls.session, cls.bag],
                        [find_program("mmradartwin_attribution", "evaluate"), cls.session, "--output", cls.results,
                         "--quiet"]):
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=600)

    def start(self, *arguments, **of_window):
        self.open_window(Launched(*arguments, "rviz:=false"), **of_window)

    def open_window(self, launched, **of_window):
        self.launched = launched
        self.addCleanup(self.launched.__exit__)
        wait_for(lambda: rosgraph.is_master_online(self.launched.environment["ROS_MASTER_URI"]), "a master")
        self.window = Window(self.launched.environment, self.folder, **of_window)
        self.addCleanup(self.window.close)

    def last(self, topic):
        """The message of a latched topic, or the next one."""
        file = os.path.join(self.folder, "last.bag")
        self.launched.record({topic: 1}, file)
        with rosbag.Bag(file) as bag:
            return [message for _, message, _ in bag.read_messages()][-1]


    def assert_labels_stand_out(self, name):
        """Also of buttons that are switched off."""
        said = self.window.do("contrast " + name)
        count, ratio = self.window.faintest_label(name)
        self.assertGreater(count, 8, said)
        self.assertGreaterEqual(ratio, LEAST_CONTRAST, said)

    def findings_are(self, cause):
        self.window.wait_for_text("findings", cause.replace("_", " "))
        findings = self.last("/attribution/findings")
        self.assertEqual(findings.findings[0].cause, cause)
        self.assertIn(f"{findings.findings[0].log_likelihood_gain:.0f} nats", self.window.text("findings"))

    def apply(self, cause):
        """Has what was found simulated; gives the twin as given and the new one."""
        given = self.last("/twin/scene").twin_yaml
        self.assertNotIn(cause, given)
        self.window.do("click apply")
        self.window.wait_for_text("apply", "grey: is simulated")
        extended = self.last("/twin/scene").twin_yaml
        self.assertIn(cause, extended)
        self.window.wait_for_text("figures", "as given")
        return given, extended

    def revert(self, given):
        self.window.do("click revert")
        self.window.wait_for_text("revert", "grey: the twin is the first one")
        self.assertEqual(self.last("/twin/scene").twin_yaml, given)
        self.window.wait_for_text("figures", "with findings")


class Inspect(Driven):
    def setUp(self):
        opener = os.path.join(self.folder, "bin")
        os.makedirs(opener, exist_ok=True)
        with open(os.path.join(opener, "xdg-open"), "w", encoding="ascii") as file:
            file.write(f"#!/bin/sh\nprintf %s \"$1\" >'{self.folder}/opened'\n")
        os.chmod(os.path.join(opener, "xdg-open"), 0o755)
        self.start("inspect.launch", "results:=" + self.results, "pause:=true",
                   PATH=opener + os.pathsep + os.environ["PATH"])
        self.window.wait_for_text("source", "1 of 3")
        with rosbag.Bag(os.path.join(self.results, "results.bag")) as bag:
            self.poses = next(m for _, m, _ in bag.read_messages("inspect/poses")).poses

    def shown_is(self, name):
        return self.window.wait_for_text("source", f"pose <b>{name}</b>")

    def test_poses_are_walked_through(self):
        window = self.window
        names = [pose.name for pose in self.poses]
        window.do("click next")
        self.shown_is(names[1])
        self.assertEqual(self.last("/attribution/residuals").pose, names[1])
        window.do("click previous")
        self.shown_is(names[0])
        window.do("click worst")
        worst = min(self.poses, key=lambda pose: pose.figures.recall).name
        self.shown_is(worst)
        self.assertEqual(self.last("/attribution/pose").name, worst)
        self.assertEqual(window.text("order"), "worst recall first")
        for order in ("q1_energy", "q2_energy", "residual_rms_db"):
            window.do("key order Down")
            wait_for(lambda order=order: self.last("/inspect/shown").order == order, order)
        worst = max(self.poses, key=lambda pose: pose.residual_rms_db).name
        window.wait_for_text("order", "greatest difference first")
        self.shown_is(worst)
        self.assertEqual(self.last("/inspect/shown").order, "residual_rms_db")
        window.picture("worst_pose")
        window.do("click play")
        window.wait_for_text("play", "Pause")
        self.assertTrue(self.last("/inspect/shown").playing)
        wait_for(lambda: f"pose <b>{worst}</b>" not in window.text("source"), "another pose by itself")
        window.do("click play")
        window.wait_for_text("play", "Play")

    def test_what_stored_results_cannot_do_says_why(self):
        self.window.do("tab tabs Diagnosis")
        self.assertIn("grey: stored results hold no frames", self.window.text("diagnose"))
        self.assertIn("grey: stored results are not simulated anew", self.window.text("apply"))
        self.window.do("click report")
        wait_for(lambda: os.path.exists(os.path.join(self.folder, "opened")), "xdg-open")
        with open(os.path.join(self.folder, "opened"), encoding="utf-8") as file:
            self.assertEqual(file.read(), os.path.join(self.results, "report.html"))

    def test_a_place_is_explained(self):
        window = self.window
        residuals = self.last("/attribution/residuals")
        self.assertGreater(len(residuals.residuals), 0)
        window.wait_for_text("why", "Click on a place")
        # The list's first line is the first residual.
        wait_for(lambda: self.link("residual_list", 1), "a link in the list")
        window.wait_for_text("why", "the twin has")
        told, wanted = self.last("/attribution/explanation"), residuals.residuals[0]
        self.assertEqual(told.kind, f"C{wanted.residual_class}")
        self.assertEqual((told.actor, told.material), (wanted.actor, wanted.material))
        self.assertAlmostEqual(told.measured_db, wanted.measured_db)
        self.assertAlmostEqual(told.simulated_db, wanted.simulated_db)
        self.assertEqual([path.record for path in told.paths], list(wanted.records))
        if told.paths:
            self.assertAlmostEqual(sum(path.share for path in told.paths), 1)
        markers = self.last("/attribution/explanation_markers").markers
        self.assertTrue({"place"} | ({"actor"} if wanted.actor else set()) <= {marker.ns for marker in markers})
        window.picture("why_residual")
        # In the panel of a map: boresight is up, left is left.
        window.do("click map_of_Measured 0.43 0.5")
        ahead = wait_for(lambda: (e := self.last("/attribution/explanation")).header.stamp and
                         e.range_m != told.range_m and e, "another answer")
        self.assertLess(abs(ahead.azimuth_rad), math.radians(20))
        window.do("click map_of_Measured 0.3 0.5")
        wait_for(lambda: self.last("/attribution/explanation").azimuth_rad > ahead.azimuth_rad + 0.1, "a place at the left")

    def link(self, name, number):
        try:
            self.window.do(f"link {name} {number}")
        except AssertionError:
            return False
        return True

    def test_the_tool_asks_in_the_room(self):
        window = self.window
        wait_for(lambda: self.last("/attribution/scene_markers").markers, "the room")
        window.do("tool Why?")

        def asked(x, words, y=0.45):
            window.do(f"shift render {x} {y}")
            return words in window.text("why")

        # The radar is in the middle, and looks to the right.
        wait_for(lambda: asked(0.3, "is not compared"), lambda: f"a refusal: {window.text('why')}", 60)
        wait_for(lambda: asked(0.62, "the twin has"), lambda: f"an answer: {window.text('why')}", 60)
        # On the white box of a far wall.
        wait_for(lambda: asked(0.756, "both see", 0.327), lambda: f"an actor: {window.text('why')}", 60)
        told = self.last("/attribution/explanation")
        self.assertEqual(told.kind, "matched")
        self.assertIn(told.actor.replace("_", " "), told.sentence)
        self.assertAlmostEqual(sum(path.share for path in told.paths), 1)
        self.assertLessEqual({"place", "paths", "actor"},
                             {marker.ns for marker in self.last("/attribution/explanation_markers").markers})
        window.picture("why_in_the_room")

    def test_layers_switch_what_is_drawn(self):
        window = self.window
        window.do("tab tabs Layers")

        def ticked():
            try:
                window.do("row layers both maps are strong")
            except AssertionError:
                return False
            return True
        wait_for(ticked, "layers")
        window.picture("layers")
        window.do("key layers Space")


class WhatIf(Driven):
    """The twin of stored results is changed by hand."""

    def test_an_actor_is_moved_and_put_back(self):
        self.start("inspect.launch", "results:=" + self.results, "pause:=true", layout="what_if")
        window = self.window
        window.wait_for_text("words", "nothing is changed")
        self.assert_labels_stand_out("what_if_panel")
        window.picture("what_if_before")
        window.do("row actors sofa")
        for keys in ("0.5", "Return"):
            window.do("key x_m_value " + keys)
        window.wait_for_text("words", "1 change(s)")
        state = self.last("/what_if/state")
        self.assertEqual({actor.name: actor.shift_m[0] for actor in state.actors if actor.shift_m[0]}, {"sofa": 0.5})
        self.assertNotEqual(state.now.explained_power, state.given.explained_power)
        window.picture("what_if_after")
        window.do("click undo")
        window.wait_for_text("words", "nothing is changed")


class Replay(Driven):
    """A bag is played, judged, and simulated anew with what was found."""
    effect, frames, locations = "tx_rx_leakage", "30", "6"

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        changed = unittest.mock.patch.dict(os.environ, ROS_HOME=os.path.join(cls.folder, "ros_home"))
        changed.start()
        cls.addClassCleanup(changed.stop)

    def test_a_diagnosis_from_the_window(self):
        self.start("replay.launch", "bag:=" + self.bag, "pause:=true", "rate:=2")
        window = self.window
        window.wait_for_text("source", "replay")
        self.assertIn("grey: a replay goes on by itself", window.text("next"))
        window.wait_for_text("play", "Play")
        window.do("click play")  # the bag is short: whoever looks at the button later finds it over
        window.do("tab tabs Diagnosis")
        self.assertIn("grey: no diagnosis has found anything yet", window.text("apply"))
        self.launched.wait_for_text("the bag is over")
        self.cancel_one()
        window.do("click diagnose")
        self.findings_are(self.effect)
        self.assert_labels_stand_out("twin_panel")
        window.picture("findings")
        self.apply_save_and_revert()

    def cancel_one(self):
        self.window.wait_for_text("diagnose", "Diagnose")
        self.window.do("click diagnose")
        self.window.wait_for_text("progress", "%")
        self.window.picture("diagnosis_runs")
        self.window.do("click cancel")
        self.window.wait_for_text("said", "cancelled; nothing was written")

    def apply_save_and_revert(self):
        window = self.window
        given, extended = self.apply(self.effect)
        self.before_and_after()
        window.picture("after_a_diagnosis")
        file = os.path.join(self.folder, "saved.yaml")
        window.do("click save")
        window.wait_for_text("fileNameEdit", "twin.yaml")
        window.do("key fileNameEdit " + file)
        window.do("key fileNameEdit Return")
        window.wait_for_text("said", "written: " + file)
        with open(file, encoding="utf-8") as text:
            self.assertEqual(text.read(), extended)
        self.revert(given)
        window.do("close before_after_window")
        window.do("click before_after")
        window.wait_for_text("before_after_words", "left")

    def before_and_after(self):
        """The window that opens shows both twins at one place; less differs with what was found."""
        window = self.window
        self.assertIn("as given at the left", window.wait_for_text("before_after_words", "left"))

        def colour(name):
            pixels = window.pixels(name)[45:, :-70]  # without title and colour bar
            return (pixels.max(axis=2) - pixels.min(axis=2)).mean()
        wait_for(lambda: colour("residual_corrected") < 0.9 * colour("residual_given"),
                 lambda: f"a fainter residual: {colour('residual_given')}, {colour('residual_corrected')}")
        self.assertGreater(numpy.abs(window.pixels("simulated_given") - window.pixels("simulated_corrected")).max(), 30)
        self.assertGreaterEqual(window.faintest_label("before_after_window")[1], LEAST_CONTRAST)
        if PICTURES:
            window.do(f"grab before_after_window {PICTURES}/before_after.png")


@unittest.skipUnless(os.geteuid() == 0, "an emulated card's network needs root")
class Live(Driven):
    """An emulated radar is watched, asked, judged, and simulated anew with what was found. It moves on after some seconds,
    and then what was asked of a place is forgotten."""
    effect, frames, locations = "tx_rx_leakage", "120", "5"

    def test_a_live_radar_is_asked_and_judged(self):
        changed = unittest.mock.patch.dict(os.environ)
        changed.start()
        self.addCleanup(changed.stop)
        rig = Rig(self.folder, self.session, None)
        self.open_window(rig)
        window = self.window
        rig.wait_for_text("samples arrive", 1, 240)
        window.wait_for_text("source", "live")
        self.assertIn("grey: a live radar has no stored poses", window.text("next"))
        self.assertIn("grey: a live radar cannot be stopped", window.text("play"))
        window.wait_for_text("figures", "recall")
        residuals = self.last("/attribution/residuals")
        self.assertTrue(residuals.regions)
        self.ask_about_the_list()
        self.ask_about_a_map()
        window.picture("live")
        # All poses have been played once.
        rig.wait_for_messages("/diagnosis", {"/radar/adc": int(1.3 * int(self.frames) * int(self.locations))})
        window.do("tab tabs Diagnosis")
        window.do("click diagnose")
        window.wait_for_text("progress", "%")
        self.findings_are(self.effect)
        given, _ = self.apply(self.effect)
        self.last("/attribution/residual_map")    # of the new twin
        window.wait_for_text("before_after_words", "left")
        window.picture("live_after_a_diagnosis")
        self.revert(given)

    def asked(self, order):
        """The answer to a click, and what the panel says of it; nothing where the radar moved on meanwhile."""
        try:
            self.window.do(order)
        except AssertionError:    # the list has no line, since nothing differs at this pose
            return None
        end_s = time.monotonic() + 3
        while "the twin has" not in (said := self.window.text("why")):
            if time.monotonic() > end_s:
                return None
            time.sleep(0.1)
        told = self.last("/attribution/explanation")
        return told.kind and (told, said)

    def ask_about_the_list(self):
        """A click on a number of "What differs", whatever stands there at that moment."""
        told, said = wait_for(lambda: self.asked("link residual_list 1"), "an answer about what differs")
        self.assertRegex(told.kind, "^C[1-5]$")
        self.assertIn("dB here", said)
        self.assertGreater(told.range_m, 0)

    def ask_about_a_map(self):
        told, _ = wait_for(lambda: self.asked("click map_of_Measured 0.43 0.5"), "an answer about a place ahead")
        self.assertLess(abs(told.azimuth_rad), math.radians(20))
        self.assertTrue(math.isfinite(told.measured_db) and math.isfinite(told.simulated_db))


if __name__ == "__main__":
    unittest.main()
