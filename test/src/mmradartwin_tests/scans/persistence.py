"""How steady a scene's specular paths are: pairs of poses 1 cm apart, simulated, path by path."""
import math
import os
import subprocess

import numpy as np

from mmradartwin_tests.path_comparison import match, read_paths

APART_M = 0.01
WITHIN_DB = 20.0     # of the strongest path of the first pose
EVENTS = ("specular", "corner")


def draw_pairs(room, T_map_room, rng, count, clearance_m=0.5):
    """[count, 2] of (position [3], yaw) in map: free places of the known room, and 1 cm beside in any direction."""
    low, high = room.outline.min(axis=0), room.outline.max(axis=0)
    pairs = []
    while len(pairs) < count:
        p = np.array([*rng.uniform(low, high), rng.uniform(0.9, 1.5)])
        if not room.contains(p, clearance_m)[0] or room.clearance(p) < clearance_m:
            continue
        yaw = rng.uniform(-math.pi, math.pi)
        beside = rng.standard_normal(3)
        q = p + APART_M * beside / np.linalg.norm(beside)
        turn = math.atan2(T_map_room[1, 0], T_map_room[0, 0])
        pairs.append([(T_map_room[:3, :3] @ x + T_map_room[:3, 3], yaw + turn) for x in (p, q)])
    return pairs


def write_session(folder, scene_yaml, pairs, radar="package://mmradartwin_config/radar.yaml"):
    """A session without captures, poses a000, b000, a001 and so on."""
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, "session.yaml"), "w", encoding="utf-8") as out:
        out.write(f"format: mmradartwin_session/1\nradar: {radar}\nscene: {os.path.abspath(scene_yaml)}\n"
                  "poses: poses.csv\ncaptures: captures/{pose}.bin\ntwin: twin.yaml\n")
    with open(os.path.join(folder, "twin.yaml"), "w", encoding="ascii") as out:
        out.write("mechanisms: {specular: {max_bounces: 3}, corner: {}}\n")
    with open(os.path.join(folder, "poses.csv"), "w", encoding="ascii") as out:
        out.write("pose,location,stamp,x,y,z,qx,qy,qz,qw\n")
        for i, pair in enumerate(pairs):
            for k, (p, yaw) in enumerate(pair):
                # Places differ by more than a duplicate's 10 cm in name only; the stamps do not overlap.
                out.write(f"{'ab'[k]}{i:03d},{'ab'[k]}{i},{1.7e9 + 60 * (2 * i + k):.1f},{p[0]:.6f},{p[1]:.6f},{p[2]:.6f},"
                          f"0,0,{math.sin(yaw / 2):.9f},{math.cos(yaw / 2):.9f}\n")


def strong_paths(file):
    """Specular paths of a list within WITHIN_DB of its strongest."""
    rows = [r for r in read_paths(file) if r["event"].split(";")[0] in EVENTS]
    if not rows:
        return []
    top = max(r["amplitude_db"] for r in rows)
    return [r for r in rows if r["amplitude_db"] > top - WITHIN_DB]


def measure(folder, pairs):
    """{paths, persist, level_db: 90 % of the changes are smaller, within_1_db: share of those that persist, refused: pairs
    that the simulator did not take}.

    A path persists where the other pose has one of the same event and actors that is at most 2 cm longer or shorter and
    looks the same way within 3 degrees, however weak it is there.
    """
    paths = persist = refused = 0
    changes = []
    for i in range(len(pairs)):
        if not all(os.path.exists(os.path.join(folder, "paths", f"{k}{i:03d}.csv")) for k in "ab"):
            refused += 1      # a radar inside a body
            continue
        rows = strong_paths(os.path.join(folder, "paths", f"a{i:03d}.csv"))
        others = [r for r in read_paths(os.path.join(folder, "paths", f"b{i:03d}.csv"))
                  if r["event"].split(";")[0] in EVENTS]
        found, _, _ = match(rows, others, reach_m=0.0125, reach_deg=3.0)
        paths += len(rows)
        persist += len(found)
        changes += [abs(a["amplitude_db"] - b["amplitude_db"]) for a, b in found]
    changes = np.array(changes)
    return {"refused": refused, "paths": paths, "persist": persist / max(paths, 1),
            "level_db": float(np.quantile(changes, 0.9)) if len(changes) else math.nan,
            "within_1_db": float(np.mean(changes < 1)) if len(changes) else math.nan}


def simulate(program, session, output, limit_s=120):
    """Runs simulate of a session; ValueError with its last line where it fails."""
    try:
        done = subprocess.run([program, session, "--output", output, "--force"], capture_output=True, text=True, check=False,
                              timeout=limit_s)
    except subprocess.TimeoutExpired:
        raise ValueError(f"simulate took more than {limit_s} s") from None
    if done.returncode not in (0, 2) or not os.path.isdir(os.path.join(output, "paths")):
        raise ValueError((done.stderr.strip().splitlines() or ["simulate failed"])[-1])
