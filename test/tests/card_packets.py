"""A pcap of a DCA1000's packets, written by the formats' descriptions alone."""
import struct

CARD, HOST = bytes([192, 168, 33, 180]), bytes([192, 168, 33, 30])
PORT = 4098
PAYLOAD_BYTES = 1024


def pcap(datagrams):
    """A pcap of (sequence, count of bytes before it, payload)."""
    data = bytearray(struct.pack("<IHHiIII", 0xa1b2c3d4, 2, 4, 0, 0, 65535, 1))
    for number, (sequence, count, payload) in enumerate(datagrams):
        datagram = struct.pack("<I", sequence) + struct.pack("<Q", count)[:6] + payload
        udp = struct.pack(">HHHH", PORT, PORT, 8 + len(datagram), 0) + datagram
        ip = struct.pack(">BBHHHBBH4s4s", 0x45, 0, 20 + len(udp), 0, 0, 64, 17, 0, CARD, HOST) + udp
        frame = bytes(12) + b"\x08\x00" + ip
        data += struct.pack("<IIII", 1_700_000_000 + number // 1000, number % 1000 * 1000, len(frame), len(frame)) + frame
    return bytes(data)


def packets(number):
    """That many packets of a recording, none lost."""
    return [(i + 1, i * PAYLOAD_BYTES, bytes([i % 251]) * PAYLOAD_BYTES) for i in range(number)]


def jumping(steps, step_bytes):
    """Packets, eight after each leap, so that all between seem to be lost."""
    first = [step * (step_bytes // PAYLOAD_BYTES) for step in range(steps)]
    return [(packet + 1, packet * PAYLOAD_BYTES, bytes(PAYLOAD_BYTES)) for begin in first for packet in range(begin, begin + 8)]
