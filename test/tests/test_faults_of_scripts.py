"""Faults of the programs in Python, of shell scripts, and of programs that need a ROS master: rows as in test_faults."""
import json
import os
import socket
import tempfile
import unittest

import rosgraph

from card_packets import packets, pcap
from faults import (POSES, POSES_HEAD, RADAR, FaultRows, Row, add_tests, all_of, cut, laughs, noise, nothing, put, remove,
                    scatter, vast_frame)
from test_launch_files import end, free_port, start_master
from test_node_programs import path_of
from test_program_outputs import PROGRAMS

NODES = ("session_player", "play_bag.py", "recorder.py", "supervise.py", "emulated_rig.sh")
PACKAGES = {"session_player": "mmradartwin_driver", "request_diagnosis": "mmradartwin_attribution",
            **{name: "mmradartwin_launch" for name in ("play_bag.py", "recorder.py", "supervise.py", "tell_result.py",
                                                       "demo.sh", "try.sh", "emulated_rig.sh")},
            **{name: "mmradartwin_tests" for name in ("make_session.py", "make_office.py", "compare_with_simulator.py",
                                                      "recall_ceiling.py", "blind_protocol.py", "third_world.py",
                                                      "measure_live_twin.py", "summarise_results.py")}}
# Those that ask a ROS master wait 10 s for it.
SOON_S = 30
OF_PLAYER = ["_card_ip:=127.77.9.2", "_host_ip:=127.77.9.1"]
MANY_POSES = POSES_HEAD + "".join(f"p{i},a,{1_700_000_000 + i},1,2,1,0,0,0,0.5\n" for i in range(300_000))


# ---- masters

def no_master(test, _chance):
    test.environment["ROS_MASTER_URI"] = f"http://127.0.0.1:{free_port()}"


def silent_master(test, _chance):
    """Something else at its port, which takes connections and never answers."""
    server = socket.create_server(("127.0.0.1", 0))
    test.addCleanup(server.close)
    test.environment["ROS_MASTER_URI"] = f"http://127.0.0.1:{server.getsockname()[1]}"


def master_at(address):
    def damage(test, _chance):
        test.environment.pop("ROS_MASTER_URI", None)
        if address is not None:
            test.environment["ROS_MASTER_URI"] = address
    return damage


def a_master(test, _chance):
    """One that answers, with nothing else on it."""
    test.environment["ROS_MASTER_URI"] = test.master_uri
    test.forget_parameters()


MASTERS = {"none": (no_master, "no ROS master answers"), "one that never answers": (silent_master, "no ROS master answers"),
           "an address that is none": (master_at("nonsense"), "ROS_MASTER_URI"),
           "an address without a port": (master_at("http://127.0.0.1"), "ROS_MASTER_URI"),
           "ROS_MASTER_URI is not set": (master_at(None), "ROS_MASTER_URI")}
ASKERS = {"session_player": ["_session:=session", *OF_PLAYER], "request_diagnosis": ["--wait", "3"],
          "play_bag.py": ["session.bag"], "recorder.py": ["--min-free", "1M", "--output-prefix", "out", "-a"]}


def master_rows():
    for master, (make, word) in MASTERS.items():
        for program, words in ASKERS.items():
            yield Row(f"master: {master}", [program, *words], make, (word,), (2,), SOON_S)
        for program in PACKAGES:
            yield Row(f"--help; master: {master}", [program, "--help"], make, (), (0,), SOON_S)


# ---- session_player

def player_rows():
    captures = [f"session/captures/00{i}.bin" for i in (1, 2, 3)]
    damages = {
        "no session.yaml": (remove("session/session.yaml"), ("session.yaml",)),
        "session.yaml: noise": (noise("session/session.yaml"), ("session.yaml",)),
        "session.yaml: a billion laughs": (put("session/session.yaml", laughs()), ("session.yaml",)),
        "no poses.csv": (remove(POSES), ("poses.csv",)), "poses.csv is empty": (put(POSES, b""), ("poses.csv",)),
        "poses.csv: noise": (noise(POSES), ("poses.csv",)),
        "poses.csv: a head alone": (put(POSES, POSES_HEAD), ("poses.csv",)),
        "poses.csv: 300,000 bad poses": (put(POSES, MANY_POSES), ("poses.csv",)),
        "no radar.yaml": (remove(RADAR), ("radar.yaml",)), "radar.yaml: noise": (noise(RADAR), ("radar.yaml",)),
        "radar.yaml: frames of 128 MiB": (vast_frame, ("radar.yaml", "max_frame_mb")),
        "all captures are missing": (all_of(*(remove(file) for file in captures)), ("001.bin",)),
        "all captures are empty": (all_of(*(put(file, b"") for file in captures)), ("001.bin",))}
    for damage, (make, says) in damages.items():
        yield Row(f"played: {damage}", ["session_player", "_session:=session", *OF_PLAYER], all_of(make, a_master), says)
    for words, says, status in ((["_session:=none"], "none", (2,)), (["_session:=session.bag"], "session.bag", (2,)),
                                (["_session:="], "session", (2,)), ([], "session", (2,)),
                                (["_session:=session", "_first:=3"], "number 3", (2,)),
                                (["_session:=session", "_every:=0"], "every", (2,)),
                                (["_session:=session", "_config_port:=70000"], "config_port", (2,)),
                                (["_session:=session", "_tf_lead_s:=nan"], "tf_lead_s", (2,)),
                                (["_session:=session", "_card_ip:=127.0.0.1;touch F"], "127.0.0.1;touch F", (1, 2)),
                                (["_session:=session", "_card_ip:=203.0.113.7"], "203.0.113.7", (1, 2)),
                                (["_session:=session", "_emulator_options:=--none"], "--none", (1, 2)),
                                (["_session:=session", "_whole_rig:=true", "_card_ip:=nowhere"], "nowhere", (1, 2))):
        yield Row(f"played: {' '.join(words)}", ["session_player", *words], a_master, (says,), status)
    yield Row("played rig: none", ["emulated_rig.sh", "none", *OF_PLAYER], a_master, ("none",))
    yield Row("played rig: noise", ["emulated_rig.sh", "session", *OF_PLAYER],
              all_of(a_master, noise("session/session.yaml")), ("session.yaml",))


def request_rows():
    yield Row("asked: no node", ["request_diagnosis", "--wait", "2"], a_master, ("diagnosis_node",), (2,), SOON_S)
    for value in ("nan", "-1", "soon", "inf"):
        yield Row(f"asked: --wait {value}", ["request_diagnosis", "--wait", value], a_master, ("--wait",), (2,), SOON_S)
    for words in (["--none"], ["session"]):
        yield Row(f"asked: {words[0]}", ["request_diagnosis", *words], a_master, (words[0],), (2,), SOON_S)
    yield Row("asked: /use_sim_time and no clock", ["request_diagnosis", "--wait", "2", "__name:=asks"],
              all_of(a_master, sim_time), ("/clock",), (2,), SOON_S)


def sim_time(test, _chance):
    test.master.setParam("/use_sim_time", True)


# ---- bags that are played and recorded

def bag_player_rows():
    bag = "session.bag"
    damages = {"cut": (cut(bag, 0.5), (1, 2)), "cut in its first 20 bytes": (lambda t, c: os.truncate(t.at(bag), 20), (1, 2)),
               "empty": (put(bag, b""), (1, 2)), "noise": (noise(bag), (1, 2)),
               "noise behind a bag's first line": (put(bag, b"#ROSBAG V2.0\n" + bytes(range(256)) * 40), (1, 2)),
               "text": (put(bag, "range,power\n" * 100), (1, 2)), "a pcap": (put(bag, pcap(packets(8))), (1, 2)),
               "scattered bytes": (scatter(bag), (0, 1, 2))}
    for damage, (make, status) in damages.items():
        yield Row(f"played bag: {damage}", ["play_bag.py", bag, "--", "--rate", "1000", "--duration", "5"],
                  all_of(a_master, make), (bag,), status)
    for words, says in (([], "no bag"), (["none.bag"], "none.bag"), (["session"], "session"),
                        ([bag, "none.bag"], "none.bag"), ([bag, "--", "--no-such-option"], "no-such-option"),
                        ([bag, "--", "--rate", "nan"], bag), (["--folder"], "--folder"), (["--none"], "--none")):
        yield Row(f"played bag: {' '.join(words)}", ["play_bag.py", *words], a_master, (says,), (1, 2))
    least = ["recorder.py", "--min-free", "1M", "--output-prefix"]
    for prefix, says in (("", "output"), ("none/run", "none"), ("session.bag/run", "session.bag"), ("x" * 300, "x" * 300),
                         ("/dev/full/run", "/dev/full")):
        yield Row(f"recorded to {prefix[:40]!r}", [*least, prefix, "-a", "--duration", "2"], a_master, (says,), (1, 2), SOON_S)
    for words, says in ((["--min-free", "lots", "--output-prefix", "out"], "min_free"),
                        (["--min-free", "1M", "--output-prefix", "out", "--no-such-option"], "no-such-option"),
                        (["--min-free", "1M", "--output-prefix", "out"], "opics")):
        yield Row(f"recorded: {' '.join(words)}", ["recorder.py", *words], a_master, (says,), (1, 2), SOON_S)
    for words, says in (([], "no COMMAND"), (["--none"], "--none"), (["no_such_program"], "no_such_program"),
                        (["session"], "session")):
        yield Row(f"supervised: {' '.join(words)}", ["supervise.py", *words], a_master, (says,), (1, 2), SOON_S)


# ---- scripts

def json_texts(name):
    return {"noise": noise(name), "empty": put(name, ""), "a list": put(name, "[1, 2]"), "a number": put(name, "1"),
            "nested 100,000 deep": put(name, "[" * 100_000), "no key": put(name, "{}"), "null": put(name, "null"),
            "keys of other kinds": put(name, '{"effects": 3, "findings": 3}'),
            "lists of other things": put(name, '{"effects": [1], "findings": ["x"]}'),
            "a number of 5000 digits": put(name, '{"effects": ' + "9" * 5000 + "}"),
            "half": put(name, '{"effects": [{"cause": "x"}], "findings": [{"cause": "x"}]}'), "missing": remove(name),
            "a folder": all_of(remove(name), lambda t, c: os.mkdir(t.at(name)))}


def told_rows():
    truth = put("truth.json", json.dumps({"effects": [{"cause": "actor_moved", "parameters": {"dx_m": 0.1}}]}))
    findings = put("findings.json", json.dumps({"findings": [{"cause": "actor_moved", "parameters": {"dx_m": {
        "value": 0.1, "ci95": [0.0, 0.2]}}}]}))
    for name in ("truth.json", "findings.json"):
        for damage, make in json_texts(name).items():
            yield Row(f"told {name}: {damage}", ["tell_result.py", "truth.json", "findings.json"],
                      all_of(truth, findings, make), (name,))


def generated_rows():
    small = ["--locations", "1", "--headings", "1", "--frames", "1", "--duplicates", "0", "--jobs", "1"]
    make = ["make_session.py", "--seed", "1", *small]
    for program, words in (("make_session.py", make[1:]), ("make_office.py", [])):
        for output, says in (("", "output"), ("session.bag", "session.bag"), ("session.bag/out", "session.bag"),
                             ("x" * 300, "x" * 300), ("/dev/full", "/dev/full"), ("session", "--force")):
            yield Row(f"generated to {output[:40]!r}", [program, *words, "--output", output], nothing, (says,))
        yield Row("generated to a folder of something else --force", [program, *words, "--output", "photos", "--force"],
                  put("photos/cat.jpg", b"cat"), ("photos",))
    for words in (["--effect", "none"], ["--param", "x=1"], ["--effect", "actor_moved", "--param", "dx_m"],
                  ["--effect", "actor_moved", "--param", "actor=none"], ["--effect", "actor_moved", "--param", "dx_m=far"],
                  ["--effect", "actor_moved", "--strength", "nan"], ["--frames", "0"], ["--poses", "99"],
                  ["--pause", "nan"], ["--duplicates", "-1"], ["--truth", "out/truth.json"], ["--truth", "session"],
                  ["--truth", "session", "--force"], ["--truth", "session.bag"], ["--paths-csv", "session.bag"],
                  ["--paths-csv", "session.bag", "--force"], ["--jobs", "-1"], ["--seed", "-1"]):
        told = "" if words[0] == "--effect" else words[0]
        yield Row(f"generated: {' '.join(words)}", [*make, "--output", "out", *words], nothing, (told,))
    for script in ("demo.sh", "try.sh"):
        for output, says in (("", "usage"), ("session.bag", "session.bag"), ("session.bag/out", "session.bag"),
                             ("/dev/full", "/dev/full")):
            yield Row(f"shown in {output!r}", [script, output], nothing, (says,))
        for name in ("session", "diagnosis", "log"):
            yield Row(f"shown in a folder with somebody's {name}", [script, "mine"], put(f"mine/{name}/cat.jpg", b"cat"),
                      ("mine", name))
    yield Row("shown: a sample that is the output", ["try.sh", "mine", "mine"],
              all_of(put("mine/session/session.yaml", "x"), put("mine/truth.json", "{}"), put("mine/.mmradartwin_try", "")),
              ("mine",))


def measured_rows():
    for program in ("compare_with_simulator.py", "recall_ceiling.py"):
        for words in (["--poses", "0"], ["--poses", "-1"], ["--poses", "many"], ["--seed", "-1"], ["--none"]):
            yield Row(f"measured: {' '.join(words)}", [program, *words], nothing, (words[0],))
    yield Row("measured: --sessions 0", ["recall_ceiling.py", "--sessions", "0"], nothing, ("--sessions",))
    for words in (["--seconds", "nan"], ["--seconds", "-1"], ["--rate", "0"], ["--rate", "nan"], ["--twin", "none.yaml"]):
        yield Row(f"measured live: {' '.join(words)}", ["measure_live_twin.py", "--no-rviz", *words], nothing, (words[0],),
                  (2,), SOON_S)
    for program in ("blind_protocol.py", "third_world.py"):
        for output in ("", "session.bag", "session.bag/out", "/dev/full"):
            yield Row(f"trials in {output!r}", [program, "--table", "--output", output], nothing, (output or "output",))
        for text, content in {"noise": None, "a list": "[1]\n", "no key": "{}\n", "text": "range,power\n",
                              "a key alone": '{"key": "clean-1"}\n', "nested 100,000 deep": "[" * 100_000 + "\n"}.items():
            file = "trials/results.jsonl"
            damage = put(file, content) if content is not None else all_of(put(file, ""), noise(file))
            yield Row(f"trials: results.jsonl: {text}", [program, "--table", "--output", "trials"], damage,
                      ("results.jsonl",), (0, 2) if text == "noise" else (2,))
    for words in (["--rows", "none"], ["--trials", "clean=x"], ["--poses", "1"], ["--frames", "1"], ["--budget", "soon"]):
        yield Row(f"trials: {' '.join(words)}", ["blind_protocol.py", "--table", "--output", "out", *words], nothing, (words[0],))
    for words in (["--what", "none"], ["--seeds", "x"], ["--without", "none"]):
        yield Row(f"trials: {' '.join(words)}", ["third_world.py", "--output", "out", *words], nothing, (words[0],))
    summed = ["summarise_results.py", "results"]
    yield Row("summed: a file", ["summarise_results.py", "session.bag"], nothing, ("session.bag",))
    for text, content in {"noise": None, "a list": "[1]", "no key": "{}", "empty": ""}.items():
        damage = all_of(put("results/a.xml", "<testsuite/>"), put("ran.xml", "<testsuite/>"),
                        noise("list.json") if content is None else put("list.json", content))
        yield Row(f"summed: list: {text}", [*summed, "--list", "list.json", "--ran", "ran.xml"], damage, ("list.json",))
    yield Row("summed: --step", [*summed, "--step", "core"], put("results/a.xml", "<testsuite/>"), ("--step",))


ROWS = {"masters": master_rows, "played_sessions": player_rows, "asked_diagnoses": request_rows, "played_bags": bag_player_rows,
        "told_results": told_rows, "generated_sessions": generated_rows, "measured": measured_rows}


class Faults(FaultRows):
    """Of what runs beside the offline programs."""
    programs = {**PROGRAMS, **{name: path_of(package, name) for name, package in PACKAGES.items()}}
    nodes = NODES

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.master_uri = f"http://127.0.0.1:{free_port()}"
        cls.master = rosgraph.Master("/faults_test", cls.master_uri)
        cls.addClassCleanup(end, start_master(dict(os.environ, ROS_MASTER_URI=cls.master_uri, ROS_IP="127.0.0.1")))

    def setUp(self):
        super().setUp()
        self.logs = self.enterContext(tempfile.TemporaryDirectory())
        self.again()

    def again(self):
        super().again()
        # Logs of ROS are no results.
        self.environment.update(ROS_IP="127.0.0.1", **dict.fromkeys(("ROS_LOG_DIR", "ROS_HOME", "XDG_CACHE_HOME"), self.logs))

    def forget_parameters(self):
        """Those of a node outlive it."""
        for name in self.master.getParamNames():
            if name.startswith(("/session_player/", "/use_sim_time")):
                self.master.deleteParam(name)


add_tests(Faults, ROWS)


if __name__ == "__main__":
    unittest.main()
