"""Compares two path lists of the same poses: the generator's truth and a simulator's.

A path is known by its event and its actors in order; where several share both, by the nearest length and direction.
"""
import csv
import math
import os

import numpy as np

COLUMNS = ("length_m", "azimuth_dep_deg", "elevation_dep_deg", "azimuth_arr_deg", "elevation_arr_deg", "amplitude_db")
ISOLATION_M = 0.35      # in range: more than two bins' main lobe
STRONG_DB = 15.0        # below the strongest of the pose


def read_paths(file):
    """Rows of a path list as dictionaries; scatter points are left out."""
    with open(file, encoding="ascii") as lines:
        rows = [row for row in csv.DictReader(lines) if row["event"] != "diffuse"]
    for row in rows:
        for column in COLUMNS:
            row[column] = float(row[column])
    return rows


def match(ours, theirs, reach_m=0.1, reach_deg=3.0):
    """(pairs, ours alone, theirs alone); nearest first, each row once."""
    candidates = []
    for i, a in enumerate(ours):
        for j, b in enumerate(theirs):
            if a["event"] == b["event"] and a["actors"] == b["actors"]:
                length = abs(a["length_m"] - b["length_m"]) / 2
                angle = max(abs(a[c] - b[c]) for c in ("azimuth_dep_deg", "azimuth_arr_deg"))
                if length <= reach_m and angle <= reach_deg:
                    candidates.append((length / reach_m + angle / reach_deg, i, j))
    used_a, used_b, pairs = set(), set(), []
    for _, i, j in sorted(candidates):
        if i not in used_a and j not in used_b:
            used_a.add(i)
            used_b.add(j)
            pairs.append((ours[i], theirs[j]))
    return (pairs, [a for i, a in enumerate(ours) if i not in used_a],
            [b for j, b in enumerate(theirs) if j not in used_b])


def isolated(row, rows):
    """True for a strong path that no other comes near in range unless it is 20 dB weaker."""
    strongest = max(r["amplitude_db"] for r in rows)
    if row["amplitude_db"] < strongest - STRONG_DB:
        return False
    return not any(other is not row and abs(other["length_m"] - row["length_m"]) / 2 < ISOLATION_M and
                   other["amplitude_db"] > row["amplitude_db"] - 20 for other in rows)


def compare(true_directory, other_directory, floor_db=-140.0):
    """Differences over all poses of two directories of path lists.

    Returns a dictionary: poses, pairs (all matched), isolated (count), and for the isolated strong ones the medians of
    |level_db|, |range_m|, |azimuth_deg| and, as bias, of the signed differences; for all pairs the worst; missing and
    extra: (pose, row) above floor_db.
    """
    names = sorted(n for n in os.listdir(true_directory) if n.endswith(".csv"))
    everything, strong, missing, extra = [], [], [], []
    for name in names:
        ours, theirs = read_paths(os.path.join(true_directory, name)), read_paths(os.path.join(other_directory, name))
        pairs, alone, others = match(ours, theirs)
        for a, b in pairs:
            difference = (abs(a["amplitude_db"] - b["amplitude_db"]), abs(a["length_m"] - b["length_m"]) / 2,
                          abs(a["azimuth_arr_deg"] - b["azimuth_arr_deg"]))
            everything.append((*difference, name, a))
            if isolated(a, ours):
                strong.append((*difference, b["amplitude_db"] - a["amplitude_db"], (b["length_m"] - a["length_m"]) / 2,
                               b["azimuth_arr_deg"] - a["azimuth_arr_deg"]))
        missing += [(name, row) for row in alone if row["amplitude_db"] > floor_db]
        extra += [(name, row) for row in others if row["amplitude_db"] > floor_db]
    median = np.median(np.array(strong), axis=0) if strong else [math.nan] * 6
    worst = np.max(np.array([e[:3] for e in everything]), axis=0) if everything else [math.nan] * 3
    return {"poses": len(names), "pairs": everything, "isolated": len(strong), "missing": missing, "extra": extra,
            "median": dict(zip(("level_db", "range_m", "azimuth_deg"), map(float, median[:3]))),
            "bias": dict(zip(("level_db", "range_m", "azimuth_deg"), map(float, median[3:]))),
            "worst": dict(zip(("level_db", "range_m", "azimuth_deg"), map(float, worst)))}
