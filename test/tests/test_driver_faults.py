#!/usr/bin/env python3
"""Data packets with faults drawn by seed through the real driver_node: what it calls whole is what was sent.

A card of this test's own, which answers commands and sends one long recording: packets lost one by one and in bursts, sent
twice, late, cut short; headers of which one of the ten bytes is another; packets of an earlier recording, right after arming
and later; foreign datagrams. Each run sends some million samples; MMRADARTWIN_LONG a thousand million, or what ten minutes
allow. MMRADARTWIN_DRIVER_SEED repeats a run.
"""
import heapq
import multiprocessing
import os
import random
import signal
import socket
import struct
import subprocess
import threading
import time
import unittest

import numpy as np
import rospkg
import rospy
from diagnostic_msgs.msg import DiagnosticArray

from chosen_sessions import RUN
from in_folder import InFolder
from mmradartwin_tests.installed_programs import find_program
from test_launch_files import end, free_port, start_master
from wait_for import wait_for

SEED = int(os.environ.get("MMRADARTWIN_DRIVER_SEED", "1"))
SAMPLES = int(1e9) if RUN else int(4e6)     # complex ones, of all receivers
LONGEST_S = 600 if RUN else 60
CARD, HOST = "127.78.1.2", "127.78.1.1"
PAYLOAD, CHIRP, CHIRPS = 1456, 64 * 4 * 4, 32
FRAME = CHIRP * CHIRPS
PACKETS_PER_S = 8000
# Shares of packets.
LOST, BURST, TWICE, LATE, CUT, FLIPPED, STALE, FOREIGN = 0.01, 0.0005, 0.01, 0.01, 0.002, 0.005, 0.001, 0.001


def content(recording):
    """Bytes of a recording, again and again; a packet may begin at any of them."""
    data = np.random.default_rng([SEED, recording]).bytes(16_777_213)
    return data + data[:FRAME + PAYLOAD]


def part(data, begin, size):
    begin %= len(data) - FRAME - PAYLOAD
    return data[begin:begin + size]


def header(sequence, count):
    return struct.pack("<I", sequence & 0xffffffff) + struct.pack("<Q", count % 2**48)[:6]


class Card:
    """Answers every command with success; says when recording is to begin."""

    def __init__(self, config_port):
        self.commands = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.commands.bind((CARD, config_port))
        self.out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.out.bind((CARD, 1024))
        self.recording = threading.Event()
        threading.Thread(target=self.answer, daemon=True).start()

    def answer(self):
        while True:
            request, sender = self.commands.recvfrom(2048)
            code = struct.unpack_from("<H", request, 2)[0]
            version = 2 | 8 << 7    # FPGA 2.8
            self.out.sendto(struct.pack("<HHHH", 0xa55a, code, version if code == 0x0e else 0, 0xeeaa), sender)
            if code == 5:
                self.recording.set()


def send(config_port, data_port, told):
    """Sends the recording; `told` gets the numbers of packets and faults in the end."""
    chance, card = random.Random(SEED), Card(config_port)
    this, earlier = content(1), content(0)
    to = (HOST, data_port)
    number = SAMPLES * 4 // PAYLOAD
    count = {name: 0 for name in ("packets", "lost", "twice", "late", "cut", "flipped", "stale", "foreign")}
    card.recording.wait()
    time.sleep(1)

    def stale(at):
        count["stale"] += 1
        card.out.sendto(header(at + 1, at * PAYLOAD) + part(earlier, at * PAYLOAD, PAYLOAD), to)

    def send_packet(i):
        payload, head = part(this, i * PAYLOAD, PAYLOAD), header(i + 1, i * PAYLOAD)
        if chance.random() < CUT:
            count["cut"] += 1
            payload = payload[:chance.randrange(1, PAYLOAD)]
        if chance.random() < FLIPPED:
            count["flipped"] += 1
            byte = chance.randrange(10)
            head = head[:byte] + bytes([head[byte] ^ chance.randrange(1, 256)]) + head[byte + 1:]
        card.out.sendto(head + payload, to)

    for at in (720, 721, 45000):    # the rest of an earlier recording, right after arming
        stale(at)
    late, burst, begin = [], 0, time.monotonic()
    for i in range(number):
        while late and late[0][0] <= i:
            send_packet(heapq.heappop(late)[1])
        if burst > 0 or chance.random() < LOST:
            burst -= 1
            count["lost"] += 1
            continue
        if chance.random() < BURST:
            burst = chance.randrange(2, 200)
        if chance.random() < LATE:
            count["late"] += 1
            heapq.heappush(late, (i + chance.randrange(2, 40), i))
            continue
        send_packet(i)
        if chance.random() < TWICE:
            count["twice"] += 1
            send_packet(i)
        if chance.random() < STALE:
            stale(max(0, i + chance.choice((-1, 1)) * chance.randrange(1000, 40000)))
        if chance.random() < FOREIGN:
            count["foreign"] += 1
            card.out.sendto(chance.randbytes(chance.randrange(1, 1500)), to)
        count["packets"] = i + 1
        if i % 16 == 0:
            elapsed = time.monotonic() - begin
            if elapsed > LONGEST_S:
                break
            if i / PACKETS_PER_S > elapsed:
                time.sleep(i / PACKETS_PER_S - elapsed)
    count["seconds"] = time.monotonic() - begin
    told.put(count)


class Frames:
    """Holds each frame against what was sent."""

    def __init__(self):
        self.data = content(1)
        self.frames = self.whole = self.flagged = 0
        self.wrong = []

    def take(self, message):
        buffer = message._buff
        name_size = struct.unpack_from("<I", buffer, 12)[0]
        sequence, chirps, samples, receivers, words = struct.unpack_from("<IIIII", buffer, 16 + name_size + 8)
        at = 16 + name_size + 28
        assert chirps * samples * receivers * 2 == words and words * 2 == FRAME, (chirps, samples, receivers, words)
        got = np.frombuffer(buffer, "<i2", words, at).reshape(CHIRPS, -1)
        valid = np.frombuffer(buffer, np.uint8, CHIRPS, at + 2 * words + 4) != 0
        sent = np.frombuffer(part(self.data, sequence * FRAME, FRAME), "<i2").reshape(CHIRPS, 64, 2, 4).transpose(0, 1, 3, 2)
        wrong = valid & (got != sent.reshape(CHIRPS, -1)).any(axis=1)
        self.wrong += [(sequence, int(chirp)) for chirp in np.flatnonzero(wrong)]
        self.frames += 1
        self.whole += int(valid.sum())
        self.flagged += int((~valid).sum())


class DriverFaults(InFolder):
    def test_what_is_called_whole_is_what_was_sent(self):
        port, config_port, data_port = free_port(), free_port(), free_port()
        os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1", ROS_LOG_DIR=self.folder)
        self.addCleanup(end, start_master(os.environ))
        with open(os.path.join(rospkg.RosPack().get_path("mmradartwin_config"), "radar.yaml"), encoding="utf-8") as text:
            radar = text.read()
        self.assertIn("loops_per_frame: 1\n", radar)
        with open(self.at("radar.yaml"), "w", encoding="utf-8") as out:
            out.write(radar.replace("loops_per_frame: 1\n", "loops_per_frame: 16\n"))
        rospy.init_node("driver_faults_test", disable_signals=True)
        frames, told = Frames(), multiprocessing.Queue()
        rospy.Subscriber("radar/adc", rospy.AnyMsg, frames.take, queue_size=None, buff_size=1 << 24, tcp_nodelay=True)
        reports = []
        rospy.Subscriber("/diagnostics", DiagnosticArray, reports.append, queue_size=10)
        sender = multiprocessing.Process(target=send, args=(config_port, data_port, told), daemon=True)
        sender.start()
        self.addCleanup(sender.kill)
        with open(self.at("driver.log"), "w", encoding="utf-8") as log:
            driver = subprocess.Popen([find_program("mmradartwin_driver", "driver_node"), "_radar:=" + self.at("radar.yaml"),
                                       "_card_ip:=" + CARD, "_host_ip:=" + HOST, f"_config_port:={config_port}",
                                       f"_data_port:={data_port}"], stdout=log, stderr=log)
        self.addCleanup(end, driver)

        def log():
            with open(self.at("driver.log"), encoding="utf-8") as text:
                return text.read()[-3000:]

        count = told.get(timeout=LONGEST_S + 300)
        last = -1
        while frames.frames != last:
            last = frames.frames
            time.sleep(2)
        print(f"seed {SEED}, {count}: {frames.frames} frames, {frames.whole} chirps whole, {frames.flagged} flagged, "
              f"{len(frames.wrong)} wrong", flush=True)
        self.assertIsNone(driver.poll(), log())
        self.assertEqual(frames.wrong, [], log())
        sent = count["packets"] * PAYLOAD // CHIRP
        self.assertGreater(frames.whole, 0.5 * sent, log())
        self.assertGreater(frames.flagged, 0)
        wait_for(lambda: reports, "diagnostics of the driver", 30)
        driver.send_signal(signal.SIGINT)
        self.assertEqual(driver.wait(60), 0, log())


if __name__ == "__main__":
    unittest.main()
