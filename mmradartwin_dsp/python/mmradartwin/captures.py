"""Captures: the DCA1000's payload as recorded, int16 little endian."""
from dataclasses import dataclass
import os
import re
import struct

import numpy as np

from mmradartwin.grids import ReceiveGrid
from mmradartwin.input_error import InputError
from mmradartwin.radar import LANES

FULL_SCALE = 32768.0
# Files that are no captures, by their first bytes.
KINDS = ((b"\x93NUMPY", "a NumPy file"), (b"PK\x03\x04", "a zip archive"), (b"\x1f\x8b\x08", "packed by gzip"),
         (b"7z\xbc\xaf\x27\x1c", "a 7z archive"), (b"\x28\xb5\x2f\xfd", "packed by zstd"), (b"\xfd7zXZ\0", "packed by xz"),
         (b"BZh91AY&SY", "packed by bzip2"), (b"Rar!\x1a\x07", "a rar archive"), (b"\xd4\xc3\xb2\xa1", "a pcap"),
         (b"\xa1\xb2\xc3\xd4", "a pcap"), (b"\x4d\x3c\xb2\xa1", "a pcap"), (b"\x0a\x0d\x0d\x0a", "a pcapng"),
         (b"#ROSBAG", "a rosbag"), (b"\x89HDF\r\n\x1a\n", "an HDF5 or MATLAB 7.3 file"),
         (b"MATLAB 5.0 MAT-file", "a MATLAB file"), (b"\x80\x04\x95", "a Python pickle"), (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
         (b"%PDF-", "a PDF document"), (b"\x7fELF", "a program (ELF)"), (b"version https://git-lfs", "a pointer of Git LFS"))
# The words that TI's headers of the LVDS stream begin with.
LVDS_WORDS = ({0x0CDA, 0x0ADC}, {0x09CC, 0x0CC9})
LARGEST_PAYLOAD = 1500


@dataclass(frozen=True)
class AdcFrames:
    """Frames of one pose."""
    counts: np.ndarray         # int16 [F][C][N][R][I, Q], ADC counts
    stamp_ns: np.ndarray       # int64 [F], start of each frame
    chirp_valid: np.ndarray    # bool [F][C], False where bytes of the chirp were lost

    @property
    def x(self):
        """complex128 [F][C][N][R], x = I + jQ in ADC counts."""
        return self.counts[..., 0] + 1j * self.counts[..., 1]

    def grid(self, radar):
        """The coherent average over loops and frames, as the programs make it: ReceiveGrid in ADC counts."""
        shape = (-1, radar.loops_per_frame, radar.slots)
        valid = self.chirp_valid.reshape(shape)
        counts = self.counts.reshape(*shape[:1], *valid.shape[1:], *self.counts.shape[2:])
        sums = np.where(valid[..., None, None, None], counts, 0).sum(axis=(0, 1), dtype=np.int64)    # [slot][N][R][2]
        weight = valid.sum(axis=(0, 1))
        if not weight.all():
            raise InputError(f"no valid chirp of slot {int(np.argmin(weight))} in {len(counts)} frame(s): all were lost or "
                             "none came")
        mean = sums / weight[:, None, None, None]
        x = np.empty((radar.channels, radar.samples_per_chirp), complex)
        x.real, x.imag = (mean[..., part].transpose(0, 2, 1).reshape(x.shape) for part in (0, 1))
        return ReceiveGrid(x=x, full_scale=FULL_SCALE, frames=len(counts), stamp_ns=int(self.stamp_ns[-1]))


def read_capture(file, radar, first_stamp_ns=0, other_captures=()):
    """All frames of a capture, in the layout of the radar.

    X_Raw_0.bin is continued by X_Raw_1.bin, ..., and X_0.bin by X_1.bin, ... unless one of these is among
    other_captures. The bytes are taken for what radar.yaml says; `process` also asks whether they look so. Raises
    InputError.
    """
    parts = [_bytes_of(part) for part in capture_parts(file, other_captures)]
    data = parts[0] if len(parts) == 1 else b"".join(parts)
    _refuse_foreign(file, data)
    size = radar.bytes_per_frame
    frames, rest = divmod(len(data), size)
    if rest or not frames:
        raise InputError(f"{file}: capture is truncated or not from this radar: {len(data)} bytes are {frames} whole frames "
                         f"of {size} bytes and {rest} bytes over; cut it to whole frames, record it anew, or correct "
                         "radar.yaml")
    decode = _decode_real if radar.real_samples else _decode_complex
    counts = decode(np.frombuffer(data, "<i2").reshape(frames * radar.chirps_per_frame, -1), radar)
    return AdcFrames(counts=counts.reshape(frames, radar.chirps_per_frame, *counts.shape[1:]),
                     stamp_ns=np.array([first_stamp_ns + radar.frame_offset_ns(i) for i in range(frames)], np.int64),
                     chirp_valid=np.ones((frames, radar.chirps_per_frame), bool))


def capture_parts(file, other_captures=()):
    """The files that one capture was written to, in order."""
    folder, name = os.path.split(file)
    raw, plain = re.fullmatch(r"(?is)(.*_raw_)0(\.bin)", name), re.fullmatch(r"(?is)(.*_)0(\.bin)", name)
    match = raw or plain
    if not match or not os.path.exists(file):
        return [file]    # reading a file that is missing says so
    others = set() if raw else {os.path.normpath(other) for other in other_captures}
    head, tail = match.groups()
    numbers = sorted(int(found[1]) for found in (re.fullmatch(re.escape(head) + r"(\d{1,6})" + re.escape(tail), other)
                                                 for other in os.listdir(folder or ".")) if found)
    parts = {number: os.path.join(folder, f"{head}{number}{tail}") for number in numbers}
    if any(os.path.normpath(part) in others for number, part in parts.items() if number):
        return [file]
    for expected, number in enumerate(numbers):
        if number != expected and number:
            raise InputError(f"{file}: {head}{expected}{tail} is missing, and {head}{number}{tail} is there; put all parts "
                             "of the capture into one folder")
    return list(parts.values()) or [file]


def _bytes_of(file):
    try:
        with open(file, "rb") as stream:
            return stream.read()
    except OSError as error:
        raise InputError(f"{file}: capture cannot be opened ({error.strerror}); put the recorded file there or take its "
                         "pose out of poses.csv") from None


def _refuse_foreign(file, data):
    if not data:
        raise InputError(f"{file}: is an empty file of 0 whole frames; record it anew, or take its pose out of poses.csv")
    kind = next((what for begin, what in KINDS if data.startswith(begin)), None)
    if kind is None and _is_text(data[:4096]):
        kind = "a text"
    if kind:
        raise InputError(f"{file}: is {kind}; give the recorded .bin, with int16 samples")
    heads = _heads(data)
    if heads:
        raise InputError(f"{file}: holds {heads} between the samples; `process --npz --cubes` takes them out and writes the "
                         "samples, which read_npz() reads")


def _is_text(begin):
    printable = all(byte >= 0x20 and byte != 0x7F or byte in b"\t\n\r" for byte in begin)
    high = sum(byte >= 0x80 for byte in begin)
    return len(begin) >= 8 and printable and len(set(begin)) >= 5 and bool(set(begin) & set(b"\n ,\t")) and 4 * high < len(begin)


def _heads(data):
    """What heads stand between the samples, in words; None where there are none."""
    if len(data) >= 8 and set(struct.unpack_from("<4H", data)) in LVDS_WORDS:
        return "TI's headers of the LVDS stream"

    def head(at, length):
        if at + length > len(data):
            return None
        return struct.unpack_from("<I", data, at)[0], int.from_bytes(data[at + length - 6:at + length], "little")

    def counts_on(payload, length):
        """The next heads, three at most and one at least, follow the first."""
        found = [head(i * (length + payload), length) for i in range(4)]
        found = found[:found.index(None)] if None in found else found
        follow = [0 < b[0] - a[0] <= 1000000 and b[1] - a[1] == (b[0] - a[0]) * payload for a, b in zip(found, found[1:])]
        return len(found) > 1 and all(follow)

    if len(data) >= 14:
        size = struct.unpack_from("<I", data, 4)[0]
        if 16 <= size <= LARGEST_PAYLOAD and counts_on(size, 14):
            return "packet heads of 14 bytes (number, size, bytes before)"
    if any(counts_on(payload, 10) for payload in range(16, min(LARGEST_PAYLOAD, len(data) - 10) + 1)):
        return "packet heads of 10 bytes (number, bytes before)"
    return None


def _decode_complex(words, radar):
    """int16 [chirp][N][R][I, Q]."""
    samples, receivers = radar.samples_per_chirp, radar.receivers
    i_and_q = [0, 1] if radar.iq_order == "iq" else [1, 0]
    if radar.layout == "4lane":
        # Per sample one part of all receivers, then the other; four lanes always carry four.
        lanes = words.reshape(len(words), samples, 2, max(LANES, receivers))
        return np.ascontiguousarray(lanes[:, :, i_and_q, :receivers].transpose(0, 1, 3, 2))
    # Per receiver one part of two samples, then the other.
    pairs = words.reshape(len(words), receivers, samples // 2, 2, 2)[:, :, :, i_and_q]
    return np.ascontiguousarray(pairs.transpose(0, 2, 4, 1, 3).reshape(len(words), samples, receivers, 2))


def _decode_real(words, radar):
    """int16 [chirp][N][R][I, Q]: the analytic signal of 2 N real samples, at half their rate."""
    samples, receivers = radar.samples_per_chirp, radar.receivers
    if radar.layout == "4lane":
        real = words.reshape(len(words), 2 * samples, max(LANES, receivers))[:, :, :receivers]
    else:
        real = words.reshape(len(words), receivers, 2 * samples).transpose(0, 2, 1)
    spectrum = np.fft.fft(real, axis=1)[:, :samples] / (2 * samples)
    spectrum[:, 1:] *= 2    # A cos p becomes A exp(jp)
    quadrature = (np.fft.ifft(spectrum, axis=1) * samples).imag
    # Without the highest frequency, which has no partner: exactly, so that no rounding hangs on the transform's last bit.
    highest = (real[:, ::2].sum(axis=1, dtype=float) - real[:, 1::2].sum(axis=1, dtype=float)) / (2 * samples)
    parts = np.stack([real[:, ::2] - highest[:, None], quadrature], axis=-1)
    halves_away_from_zero = np.trunc(parts + np.copysign(0.5, parts))
    return np.clip(halves_away_from_zero, -32768, 32767).astype(np.int16)
