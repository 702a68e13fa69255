"""Rows of faults: what is done to files, a program that is run, and what has to hold of it."""
import collections
import os
import random
import re
import shutil
import signal
import struct
import subprocess
import time

from chosen_sessions import RUN
from test_program_outputs import PROGRAMS, Programs, digest_of

ROUNDS = 20 if RUN else 1
LONGEST_S = 60
LARGEST_MB = 1500
MOST_LINES = 12

# name: what is done. call: the program and its words. make(test, chance): does it. says: words of the error; status: those
# allowed. A row whose damage may be harmless allows 0. within_s: how long it may take.
Row = collections.namedtuple("Row", "name call make says status within_s", defaults=[None, (), (2,), LONGEST_S])

OUT = ["--output", "out"]
POSES_HEAD = "pose,location,stamp,x,y,z,qx,qy,qz,qw\n"
POSES = "session/poses.csv"
RADAR = "session/radar.yaml"
CAPTURE = "session/captures/001.bin"


# ---- damage

def cut(name, share=None):
    def damage(test, chance):
        size = os.path.getsize(test.at(name))
        os.truncate(test.at(name), int(size * (chance.uniform(0.02, 0.98) if share is None else share)))
    return damage


def scatter(name, bytes_=12):
    """Some bytes changed anywhere."""
    def damage(test, chance):
        with open(test.at(name), "r+b") as file:
            for _ in range(bytes_):
                file.seek(chance.randrange(os.path.getsize(test.at(name))))
                file.write(bytes([chance.randrange(256)]))
    return damage


def zero(name, share=0.2):
    """A stretch of zeros, as a disk leaves them."""
    def damage(test, chance):
        size = os.path.getsize(test.at(name))
        with open(test.at(name), "r+b") as file:
            file.seek(int(chance.uniform(0, 1 - share) * size))
            file.write(bytes(int(share * size)))
    return damage


def put(name, content):
    """A file of that text or of those bytes."""
    def damage(test, _chance):
        os.makedirs(os.path.dirname(test.at(name)), exist_ok=True)
        with open(test.at(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
    return damage


def noise(name, size=4096):
    return lambda test, chance: put(name, chance.randbytes(size))(test, chance)


def remove(name):
    return lambda test, _chance: os.remove(test.at(name))


def folder_instead(name):
    def damage(test, _chance):
        os.remove(test.at(name))
        os.mkdir(test.at(name))
    return damage


def change(name, old, new):
    """A text in place of another."""
    def damage(test, _chance):
        with open(test.at(name), "rb") as file:
            text = file.read()
        assert old.encode() in text, (name, old)
        put(name, text.replace(old.encode(), new if isinstance(new, bytes) else new.encode()))(test, None)
    return damage


def append(name, text):
    def damage(test, _chance):
        with open(test.at(name), "ab") as file:
            file.write(text if isinstance(text, bytes) else text.encode())
    return damage


def nothing(_test, _chance):
    """No damage: the call itself is the fault."""


def tail_noise(test, chance, name):
    size = os.path.getsize(test.at(name))
    with open(test.at(name), "r+b") as file:
        file.seek(int(size * 0.97))
        file.write(chance.randbytes(64))


def misled_index(name, message_too=False):
    """The first entry of a bag's index leads far out of its chunk; or the message does, at which it leads."""
    def damage(test, _chance):
        with open(test.at(name), "r+b") as file:
            data, at, chunk = file.read(), len(b"#ROSBAG V2.0\n"), None
            number = lambda place: struct.unpack_from("<I", data, place)[0]
            while True:
                header = data[at + 4:at + 4 + number(at)]
                begin = at + 8 + len(header)
                if b"op=\x05" in header:
                    chunk = begin
                if b"op=\x04" in header:
                    break
                at = begin + number(begin - 4)
            message = chunk + number(begin + 8)
            file.seek(message + 4 + number(message) if message_too else begin + 8)
            file.write(struct.pack("<I", 0x7ffffff0))
    return damage


def all_of(*damages):
    return lambda test, chance: [damage(test, chance) for damage in damages]


def vast_frame(test, chance):
    change(RADAR, "loops_per_frame: 1", "loops_per_frame: 32768")(test, chance)
    change(RADAR, "samples_per_chirp: 64", "samples_per_chirp: 128")(test, chance)
    change(RADAR, "sample_rate_hz: ", "sample_rate_hz: 1.0e+7 #")(test, chance)
    change(RADAR, "frame_period_s: ", "frame_period_s: 2 #")(test, chance)


def in_millimetres(test, _chance):
    found = [os.path.join(place, name) for place, _, names in os.walk(test.at("session")) for name in names
             if name.endswith(".obj")]
    assert found
    for file in found:
        with open(file, encoding="utf-8") as text:
            lines = text.read().splitlines()
        with open(file, "w", encoding="utf-8") as out:
            for line in lines:
                if line.startswith("v "):
                    line = "v " + " ".join(str(1000 * float(value)) for value in line.split()[1:4])
                out.write(line + "\n")


def laughs():
    text = "a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]\n"
    for i in range(1, 9):
        text += f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n"
    return text


def peak_mb(process):
    """The most memory that a process has had until now; 0 where it has just ended."""
    try:
        with open(f"/proc/{process}/status", encoding="ascii") as status:
            return max((int(line.split()[1]) / 1024 for line in status if line.startswith("VmHWM:")), default=0)
    except (FileNotFoundError, ProcessLookupError):
        return 0


class FaultRows(Programs):
    """Rows that damage files and run a program once."""
    programs = PROGRAMS
    # Programs whose findings are their result, and those that say all on standard output, as nodes do.
    findings, nodes = ("validate",), ()
    of_node = re.compile(r"\[(FATAL|ERROR)\]")

    def run_measured(self, call, within_s):
        """(status, stdout, stderr, seconds, MB)."""
        with open(self.temporary + ".out", "w+", encoding="utf-8", errors="replace") as out, \
                open(self.temporary + ".err", "w+", encoding="utf-8", errors="replace") as err:
            begin = time.monotonic()
            run = subprocess.Popen([self.programs[call[0]], *call[1:]], cwd=self.folder, stdout=out, stderr=err,
                                   stdin=subprocess.DEVNULL, env=self.environment, start_new_session=True)
            megabytes = 0
            while run.poll() is None:
                megabytes = max(megabytes, peak_mb(run.pid))
                if time.monotonic() - begin > within_s or megabytes > LARGEST_MB:
                    os.killpg(run.pid, signal.SIGKILL)     # what it started, too
                time.sleep(0.01)
            out.seek(0), err.seek(0)
            said = run.returncode, out.read(), err.read(), time.monotonic() - begin, megabytes
        os.remove(self.temporary + ".out"), os.remove(self.temporary + ".err")
        return said

    def check(self, row, chance):
        row.make(self, chance)
        before = digest_of(self.folder)
        program = row.call[0]
        status, out, err, seconds, megabytes = self.run_measured(row.call, row.within_s)
        if program in self.findings or program in self.nodes:
            err += out
        if os.environ.get("FAULT_LOG"):
            with open(os.environ["FAULT_LOG"], "a", encoding="utf-8") as log:
                log.write(f"{row.name} | {program} | {status} | {seconds:.1f} s | {megabytes:.0f} MB | {err[:600]!r}\n")
        self.assertIn(status, row.status, msg=err[:2000])
        if status:
            if program in self.nodes:
                self.assertRegex(err, self.of_node)
            elif program not in self.findings:
                self.assertIn("error: ", err)
            for word in row.says:
                self.assertIn(word, err[:4000])
        for word in ("std::", "Traceback", "mmradartwin_tmp_"):
            self.assertNotIn(word, err)
        if program not in self.findings and "--help" not in row.call:
            self.assertLessEqual(err.count("\n"), MOST_LINES, msg=err[:2000])
        self.assertLess(seconds, row.within_s)
        self.assertLess(megabytes, LARGEST_MB)
        self.assertEqual({k: v for k, v in digest_of(self.folder).items() if k != "out" and not k.startswith("out/")}, before)
        self.assertEqual(os.listdir(self.temporary), [])

    def again(self):
        """All files as at first, and the environment."""
        self.environment = {**os.environ, "TMPDIR": self.temporary}
        for name in os.listdir(self.folder):
            path = self.at(name)
            shutil.rmtree(path) if os.path.isdir(path) and not os.path.islink(path) else os.remove(path)
        shutil.copytree(self.made, self.folder, dirs_exist_ok=True)

    def take(self, rows):
        for round_ in range(ROUNDS):
            for number, row in enumerate(rows):
                with self.subTest(fault=row.name, program=row.call[0], round=round_):
                    self.check(row, random.Random(1000 * round_ + number))
                self.again()


def add_tests(case, rows):
    """A test of the case for each {subject: function that yields rows}."""
    for subject, of_subject in rows.items():
        setattr(case, f"test_{subject}", lambda self, of_subject=of_subject: self.take(list(of_subject())))
