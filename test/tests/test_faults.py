"""Faults of files, one a row: what is done, what the program must say, what must not be lost.

Each run takes every row once; with MMRADARTWIN_LONG twenty times, with other damage each time. docs/verification/faults.md
is the table of rows.
"""
import os
import shutil
import struct
import unittest

from card_packets import jumping, packets, pcap
from faults import (CAPTURE, OUT, POSES, POSES_HEAD, RADAR, FaultRows, Row, add_tests, all_of, append, change, cut, folder_instead,
                    in_millimetres, laughs, misled_index, noise, nothing, put, remove, scatter, tail_noise, vast_frame, zero)

# ---- meshes

CORNERS = 900_000
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"


def many_corners(_test=None):
    return "o floor\nusemtl Metal\n" + "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n" + "f" + " 1 2 3 4" * (CORNERS // 4) + "\n"


def glb_that_claims(size):
    return b"glTF" + struct.pack("<II", 2, size) + struct.pack("<I", size - 20) + b"JSON"


READERS = {"process": ["session", *OUT], "simulate": ["session", *OUT], "session_to_bag": ["session", "out"]}
BAG_READERS = {"process": ["session.bag", *OUT], "simulate": ["session.bag", *OUT],
               "bag_to_session": ["session.bag", "out"], "validate": ["session.bag"]}
TO_CAPTURE = ("pcap_to_capture", ["a.pcap", "--radar", "session/radar.yaml", *OUT])


def bag_rows():
    damages = {"cut": cut("session.bag"), "cut in its first 20 bytes": lambda t, c: os.truncate(t.at("session.bag"), 20),
               "scattered bytes": scatter("session.bag"), "a stretch of zeros": zero("session.bag"),
               "its index damaged": lambda t, c: tail_noise(t, c, "session.bag"), "empty": put("session.bag", b""),
               "noise behind a bag's first line": put("session.bag", b"#ROSBAG V2.0\n" + bytes(range(256)) * 40),
               "an index entry that leads out of its chunk": misled_index("session.bag"),
               "a message that leads out of its chunk": misled_index("session.bag", message_too=True),
               "its materials are no YAML": change("session.bag", "\nmaterials:\n  Metal: {", "\nmaterials:\n  Metal: }")}
    for damage, make in damages.items():
        for program, words in BAG_READERS.items():
            harmless = damage not in ("cut in its first 20 bytes", "empty", "noise behind a bag's first line",
                                      "an index entry that leads out of its chunk", "a message that leads out of its chunk")
            yield Row(f"bag: {damage}", [program, *words], make, ("session.bag",), (0, 2) if harmless else (2,))


def capture_rows():
    damages = {"missing": (remove(CAPTURE), "001.bin"), "empty": (put(CAPTURE, b""), "001.bin"),
               "cut within a frame": (cut(CAPTURE, 0.4), "001.bin"), "a folder": (folder_instead(CAPTURE), "001.bin"),
               "one byte longer": (append(CAPTURE, b"x"), "001.bin")}
    for damage, (make, word) in damages.items():
        for program in ("process", "session_to_bag"):
            yield Row(f"capture: {damage}", [program, *READERS[program]], make, (word,), (2,))


def yaml_rows():
    vast = change(RADAR, "loops_per_frame: 1", "loops_per_frame: 32768")
    for program, words in READERS.items():
        yield Row("radar.yaml: frames of 17 GB", [program, *words], lambda t, c: (
            vast(t, c), change(RADAR, "samples_per_chirp: 64", "samples_per_chirp: 16384")(t, c)),
            ("radar.yaml", "key"))
    pcap_too = put("a.pcap", pcap(packets(8)))
    yield Row("radar.yaml: frames of 128 MiB", ["pcap_to_capture", *TO_CAPTURE[1]], lambda t, c: (
        pcap_too(t, c), vast_frame(t, c)), ("radar.yaml", "max_frame_mb", "128 MiB"))
    for program, words in READERS.items():
        yield Row("radar.yaml: frames of 128 MiB", [program, *words], vast_frame, ("radar.yaml", "max_frame_mb"))
    # What no reader of bags would take is not written.
    yield Row("radar.yaml: frames of 128 MiB, which it allows", ["session_to_bag", *READERS["session_to_bag"]],
              lambda t, c: (vast_frame(t, c), append(RADAR, "\nmax_frame_mb: 128\n")(t, c)), ("radar/config", "bags", "64 MiB"))
    texts = {"noise": None, "not UTF-8": b"device: \xff\xfe\n", "nothing": b"", "a list": b"- 1\n- 2\n",
             "nested 100,000 deep": b"a: " + b"[" * 100_000, "a billion laughs": laughs().encode(),
             "tabs": b"device:\tawr2243\n\tx: 1\n", "a loop of aliases": b"device: &x [*x]\n"}
    for text, content in texts.items():
        for file in ("session/radar.yaml", "session/session.yaml", "session/scene.yaml"):
            yield Row(f"{os.path.basename(file)}: {text}", ["simulate", *READERS["simulate"]],
                      noise(file) if content is None else put(file, content), (os.path.basename(file),))


def pose_rows():
    long_name = "x" * 5000
    names = {"a name that is no UTF-8": (b"b\xff\xfe", "UTF-8"), "a name of 5000 characters": (long_name.encode(), "5000 bytes"),
             "a name with a control character": (b"a\x1b[31m", "name"), "a name that begins with a dot": (b".x", "dot"),
             "a name with a slash": (b"a/x", "slash")}
    for what, (name, word) in names.items():
        for program in ("process", "session_to_bag", "simulate"):
            yield Row(f"poses.csv: {what}", [program, *READERS[program]],
                      lambda t, c, name=name: change(POSES, "\n001,", b"\n" + name + b",")(t, c), ("poses.csv", word))
    many = POSES_HEAD + "".join(f"p{i},a,{1_700_000_000 + i},1,2,1,0,0,0,0.5\n" for i in range(300_000))
    for program in ("process", "session_to_bag", "simulate"):
        yield Row("poses.csv: 300,000 bad poses", [program, *READERS[program]], put(POSES, many), ("poses.csv",))
    good = POSES_HEAD + "".join(f"p{i},a,{1_700_000_000 + i},1,2,1,0,0,0,1\n" for i in range(300_000))
    yield Row("poses.csv: 300,000 poses without captures", ["session_to_bag", *READERS["session_to_bag"]], put(POSES, good),
              ("p0.bin", "more of the kind"))


def pcap_rows():
    whole = pcap(packets(40))
    rows = {"cut within a packet": (whole[:-300], (0, 2), ()), "noise": (None, (2,), ("a.pcap",)),
            "empty": (b"", (2,), ("a.pcap",)), "header alone": (whole[:24], (2,), ("a.pcap",)),
            "a record of 4 GB": (whole[:24] + struct.pack("<IIII", 1, 1, 2**32 - 1, 2**32 - 1), (2,), ("a.pcap",)),
            "one packet that is nowhere": (pcap([(721, 1456 * 720 + 2**40, bytes(1456))]), (2,), ("a.pcap",)),
            "counts that jump by 60 MB": (pcap(jumping(200, 60_000_000)), (2,), ("a.pcap",)),
            "counts that jump by 1 MB": (pcap(jumping(3000, 1_000_000)), (2,), ("a.pcap",))}
    for what, (content, status, says) in rows.items():
        yield Row(f"pcap: {what}", list((TO_CAPTURE[0], *TO_CAPTURE[1])),
                  noise("a.pcap") if content is None else put("a.pcap", content), says, status)
    for output in ("a.pcap", "session/radar.yaml"):
        for force in ([], ["--force"]):
            yield Row(f"pcap: {output} as output {' '.join(force)}", ["pcap_to_capture", "a.pcap", "--radar", RADAR, "--output",
                                                                     output, *force], put("a.pcap", whole), (output,))


def mesh_rows():
    meshes = {"face of 900,000 corners.obj": (many_corners().encode(), (2,)),
              "24 bytes that claim 4 GB.glb": (glb_that_claims(2**32 - 1) + b"{}  ", (2,)),
              "24 bytes that claim 1 GB.glb": (glb_that_claims(2**30) + b"{}  ", (2,)),
              "4e9 facets.stl": (bytes(80) + struct.pack("<I", 4_000_000_000) + bytes(50), (2,)),
              "2e9 vertices.ply": (b"ply\nformat ascii 1.0\nelement vertex 2000000000\nproperty float x\nproperty float y\n"
                                   b"property float z\nend_header\n0 0 0\n", (2,)),
              "not finite.obj": (("o a\nusemtl Metal\n" + TRIANGLE.replace("v 1", "v nan") + "f 1 2 3\n").encode(), (2,)),
              "vertex that is not there.obj": (("o a\nusemtl Metal\n" + TRIANGLE + "f 1 2 9\n").encode(), (2,)),
              "no triangle.obj": (b"o a\nv 0 0 0\n", (2,)), "nothing.obj": (b"", (2,)), "noise.stl": (None, (2,)),
              "noise.glb": (None, (2,)), "noise.ply": (None, (2,)),
              "line of 50 MB.obj": (("o a\nusemtl Metal\n" + TRIANGLE + "f 1 2 3\n# ").encode() + b"x" * 50_000_000, (0, 2))}
    for name, (content, status) in meshes.items():
        yield Row(f"mesh: {name}", ["make_scene", name, *OUT], noise(name) if content is None else put(name, content),
                  (name,) if status == (2,) else (), status)
    yield Row("mesh: a room in millimetres", ["simulate", *READERS["simulate"]], in_millimetres, ("unit",), (2,))


def memory_rows():
    yield Row("firmware: /dev/zero", ["configure_radar", "full.yaml", "--firmware", "/dev/zero"],
              lambda t, c: full_radar(t), ("/dev/zero", "device"))
    yield Row("firmware: 300 MB", ["configure_radar", "full.yaml", "--firmware", "large.bin"],
              lambda t, c: (full_radar(t), sparse(t, "large.bin", 300 << 20)), ("large.bin", "firmware"))
    many = ", ".join(f"[0, {0.0019467 * i:.7f}, 0]" for i in range(4096))
    yield Row("radar.yaml: 4096 receivers", ["simulate", *READERS["simulate"]],
              lambda t, c: change(RADAR, "rx_position_m: ", f"rx_position_m: [{many}] #")(t, c), ("rx_position_m", "1024"))


def full_radar(test):
    shutil.copy(test.at(RADAR), test.at("full.yaml"))
    with open(test.at("full.yaml"), encoding="utf-8") as text:
        keys = text.read()
    with open(test.at("full.yaml"), "a", encoding="utf-8") as out:
        for key, value in {"idle_s": "7.0e-6", "ramp_end_s": "20.0e-6", "tx_enable": "[[0], [2]]",
                           "rx_enable": "[0, 1, 2, 3]", "rx_gain_db": "48", "tx_backoff_db": "0",
                           "if_highpass_hz": "[175.0e+3, 350.0e+3]"}.items():
            if key + ":" not in keys:
                out.write(f"{key}: {value}\n")


def sparse(test, name, size):
    with open(test.at(name), "wb") as file:
        file.truncate(size)


def output_rows():
    for program, words in {**READERS, "bag_to_session": BAG_READERS["bag_to_session"]}.items():
        empty = [word if word != "out" else "" for word in words]
        yield Row("output: ''", [program, *empty], nothing, ("output",))
        below = [word if word != "out" else "session.bag/out" for word in words]
        yield Row("output: below a file", [program, *below], nothing, ("session.bag",))
        long = [word if word != "out" else "x" * 300 for word in words]
        yield Row("output: a name of 300 characters", [program, *long], nothing, ("cannot be written",))
        full = [word if word != "out" else "/dev/full" for word in words]
        yield Row("output: /dev/full", [program, *full], nothing, ("/dev/full",))


# Programs that judge a whole session.
JUDGES = {"evaluate": ["session", "--no-pictures", "--no-bag", *OUT], "diagnose": ["session", "--findings", "0", *OUT],
          "calibrate": ["session", "--wall", "wall_north", *OUT]}


def judged_session_rows():
    damages = {
        "no session.yaml": (remove("session/session.yaml"), ("session.yaml",)),
        "no poses.csv": (remove(POSES), ("poses.csv",)),
        "poses.csv is empty": (put(POSES, b""), ("poses.csv",)),
        "poses.csv: noise": (noise(POSES), ("poses.csv",)),
        "poses.csv: a head alone": (put(POSES, POSES_HEAD), ("poses.csv",)),
        "poses.csv: a name that is no UTF-8": (change(POSES, "\n001,", b"\nb\xff\xfe,"), ("poses.csv", "UTF-8")),
        "poses.csv: a name with a slash": (change(POSES, "\n001,", b"\na/x,"), ("poses.csv", "slash")),
        "poses.csv: 300,000 bad poses": (put(POSES, POSES_HEAD + "".join(
            f"p{i},a,{1_700_000_000 + i},1,2,1,0,0,0,0.5\n" for i in range(300_000))), ("poses.csv",)),
        "no radar.yaml": (remove(RADAR), ("radar.yaml",)),
        "radar.yaml: noise": (noise(RADAR), ("radar.yaml",)),
        "radar.yaml: frames of 128 MiB": (vast_frame, ("radar.yaml", "max_frame_mb")),
        "no mesh": (remove("session/office.obj"), ("office.obj",)),
        "mesh: noise": (noise("session/office.obj"), ("office.obj",)),
        "a room in millimetres": (in_millimetres, ("unit",)),
        "materials.yaml: noise": (noise("session/materials.yaml"), ("materials.yaml",)),
        "a capture is missing": (remove(CAPTURE), ("001.bin",)),
        "a capture is cut within a frame": (cut(CAPTURE, 0.4), ("001.bin",)),
        "a capture is a folder": (folder_instead(CAPTURE), ("001.bin",)),
        "all captures are missing": (lambda t, c: shutil.rmtree(t.at("session/captures")), ("001.bin",)),
        "all captures are empty": (all_of(*(put(f"session/captures/00{i}.bin", b"") for i in (1, 2, 3))), ("001.bin",)),
        "all captures are text": (all_of(*(put(f"session/captures/00{i}.bin", b"range,power\n1.0,2.0\n" * 300)
                                           for i in (1, 2, 3))), ("001.bin",))}
    for damage, (make, says) in damages.items():
        for program, words in JUDGES.items():
            yield Row(f"judged session: {damage}", [program, *words], make, says)


def judged_bag_rows():
    damages = {"cut": cut("session.bag"), "scattered bytes": scatter("session.bag"), "empty": put("session.bag", b""),
               "noise behind a bag's first line": put("session.bag", b"#ROSBAG V2.0\n" + bytes(range(256)) * 40)}
    for damage, make in damages.items():
        for program, words in JUDGES.items():
            harmless = damage == "scattered bytes" and program != "calibrate"
            yield Row(f"judged bag: {damage}", [program, "session.bag", *words[1:]], make, ("session.bag",),
                      (0, 2) if harmless else (2,))


def judged_options_rows():
    """Files that an option names."""
    options = {"--twin": JUDGES, "--scene": ("evaluate",), "--channels": ("evaluate", "diagnose"),
               "--config": ("evaluate", "diagnose"), "--diagnosis-config": ("diagnose",), "--compare": ("diagnose",),
               "--laser": ("calibrate",)}
    texts = {"noise": noise("named"), "a list": put("named", b"- 1\n- 2\n"), "a billion laughs": put("named", laughs()),
             "a key that is none": put("named", b"no_such_key: 1\n"), "missing": nothing,
             "a folder": lambda t, c: os.mkdir(t.at("named"))}
    for option, programs in options.items():
        for program in programs:
            for text, make in texts.items():
                yield Row(f"file of {option}: {text}", [program, *JUDGES[program], option, "named"], make, ("named",))


def judged_output_rows():
    def older(test, _chance):
        put("older/report.html", b"older")(test, None)

    for program, words in JUDGES.items():
        def output(to, *more, words=words):
            return [word if word != "out" else to for word in words] + list(more)
        yield Row("judge's output: ''", [program, *output("")], nothing, ("output",))
        yield Row("judge's output: below a file", [program, *output("session.bag/out")], nothing, ("session.bag",))
        yield Row("judge's output: a name of 300 characters", [program, *output("x" * 300)], nothing, ("cannot be written",))
        yield Row("judge's output: /dev/full", [program, *output("/dev/full")], nothing, ("/dev/full",))
        yield Row("judge's output: exists", [program, *output("older")], older, ("older", "--force"))
        for force in ([], ["--force"]):
            for input_ in ("session", "session/captures", "session/radar.yaml", "session/captures/001.bin"):
                yield Row(f"judge's output: {input_} {' '.join(force)}", [program, *output(input_, *force)], nothing, (input_,))
        yield Row("judge's output: a folder of something else --force", [program, *output("photos", "--force")],
                  put("photos/cat.jpg", b"cat"), ("photos",))


def replayed_rows():
    whole = pcap(packets(40))
    to = ["--rate", "1000", "--host-ip", "127.77.9.1", "--card-ip", "127.77.9.2"]
    rows = {"missing": (nothing, (2,), ("b.pcap",), "b.pcap"), "empty": (put("a.pcap", b""), (2,), ("a.pcap",), "a.pcap"),
            "noise": (noise("a.pcap"), (2,), ("a.pcap",), "a.pcap"),
            "header alone": (put("a.pcap", whole[:24]), (2,), ("a.pcap",), "a.pcap"),
            "a record of 4 GB": (put("a.pcap", whole[:24] + struct.pack("<IIII", 1, 1, 2**32 - 1, 2**32 - 1)), (2,),
                                 ("a.pcap",), "a.pcap"),
            "cut within a packet": (put("a.pcap", whole[:-300]), (0, 2), (), "a.pcap"),
            "scattered bytes": (all_of(put("a.pcap", whole), scatter("a.pcap")), (0, 2), ("a.pcap",), "a.pcap"),
            "counts that jump by 60 MB": (put("a.pcap", pcap(jumping(200, 60_000_000))), (0,), (), "a.pcap"),
            "a folder": (lambda t, c: os.mkdir(t.at("a.pcap")), (2,), ("a.pcap",), "a.pcap"),
            "a session": (nothing, (2,), ("session",), "session"),
            "text": (put("a.pcap", b"range,power\n" * 100), (2,), ("a.pcap",), "a.pcap")}
    for what, (make, status, says, name) in rows.items():
        yield Row(f"replayed pcap: {what}", ["replay_packets", name, *to], make, says, status)
    for option, value in (("--host-ip", "127.0.0.1;touch F"), ("--host-ip", "nowhere"),
                          ("--rate", "nan"), ("--data-port", "70000")):
        yield Row(f"replayed pcap: {option} {value}", ["replay_packets", "a.pcap", "--rate", "1000", option, value],
                  put("a.pcap", whole), (option[2:] if option == "--rate" else value,))
    yield Row("replayed pcap: --card-ip of another computer", ["replay_packets", "a.pcap", "--card-ip", "203.0.113.7"],
              put("a.pcap", whole), ("203.0.113.7",), (1,))


def emulated_rows():
    """Programs that play a session, and those that read a radar's settings."""
    for program, words in {"dca1000_emulator": ["session", "--card-ip", "127.77.9.2", "--host-ip", "127.77.9.1"],
                           "emulated_rig": ["session", "--loopback", "--run-folder", "run"]}.items():
        for damage, (make, says) in {
                "no session.yaml": (remove("session/session.yaml"), ("session.yaml",)),
                "poses.csv: noise": (noise(POSES), ("poses.csv",)),
                "radar.yaml: noise": (noise(RADAR), ("radar.yaml",)),
                "radar.yaml: frames of 128 MiB": (vast_frame, ("radar.yaml", "max_frame_mb")),
                "all captures are missing": (lambda t, c: shutil.rmtree(t.at("session/captures")), ("001.bin",))}.items():
            yield Row(f"played session: {damage}", [program, *words], make, says)
    for damage, make in {"noise": noise("profile.cfg"), "empty": put("profile.cfg", b""),
                         "a line of 50 MB": put("profile.cfg", b"x" * 50_000_000),
                         "numbers that are none": put("profile.cfg", b"channelCfg 15 3 0\nprofileCfg 0 nan inf 7 6\n"),
                         "cut": cut("profile.cfg", 0.4)}.items():
        yield Row(f"imported settings: {damage}", ["import_settings", "profile.cfg", "--device", "xwr1843", *OUT], make,
                  ("profile.cfg",))
    for damage, make in {"noise": noise(RADAR), "frames of 128 MiB": vast_frame, "missing": remove(RADAR)}.items():
        yield Row(f"doctor's radar.yaml: {damage}", ["doctor", "--radar", RADAR, "--no-usb"], make, ("radar.yaml",))
    yield Row("emulated radar: no command", ["awr2243_emulator"], nothing, ("no command",))
    yield Row("emulated radar: no such program", ["awr2243_emulator", "--", "no_such_program"], nothing, ("no_such_program",))


ROWS = {"judged_sessions": judged_session_rows, "judged_bags": judged_bag_rows, "judged_options": judged_options_rows,
        "judged_outputs": judged_output_rows, "replayed_packets": replayed_rows, "emulators": emulated_rows,
        "bags": bag_rows, "captures": capture_rows, "yaml": yaml_rows, "poses": pose_rows, "packets": pcap_rows,
        "meshes": mesh_rows, "memory": memory_rows, "outputs": output_rows}


class Faults(FaultRows):
    """Of the offline programs."""


add_tests(Faults, ROWS)


if __name__ == "__main__":
    unittest.main()
