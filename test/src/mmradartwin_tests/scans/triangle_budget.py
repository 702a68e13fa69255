"""How the accuracy of a scan's scene depends on its triangles: its specular paths against those of the true mesh."""
import math
import os

import numpy as np

from mmradartwin_tests.blind.trials import run_measured
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.path_comparison import match, read_paths
from mmradartwin_tests.scans import persistence

REACH_M = 0.02       # of range: three times how far the faces of a phone's scan are known (7 mm)
REACH_DEG = 3.0


def simulate(scene_yaml, poses, place, limit_s=900):
    """(folder of path lists, processor seconds that one more pose takes) of a scene at poses [(position [3], yaw)].

    The seconds are the difference between all poses and one, so that loading the mesh has no part in them. ValueError where
    the simulator fails or takes more than limit_s.
    """
    seconds = []
    for count in (1, len(poses)):
        session, output = f"{place}_{count}", f"{place}_{count}_simulated"
        persistence.write_session(session, scene_yaml, [[pose] for pose in poses[:count]])
        command = [find_program("mmradartwin_sim", "simulate"), session, "--output", output, "--force", "--jobs", "1"]
        status, _, processor_s, _ = run_measured(command, limit_s, output + ".log")
        if status is None:
            raise ValueError(f"simulate takes more than {limit_s} s")
        if status not in (0, 2) or not os.path.isdir(os.path.join(output, "paths")):
            with open(output + ".log", encoding="utf-8", errors="replace") as text:
                raise ValueError((text.read().strip().splitlines() or ["simulate failed"])[-1])
        seconds.append(processor_s)
    return output, (seconds[1] - seconds[0]) / (len(poses) - 1)


def without_names(rows):
    """Paths that differ by their number of bounces alone: a scene's actors have other names than the room's."""
    return [{**row, "event": "", "actors": row["bounces"]} for row in rows]


def specular(file):
    """Specular paths and corners of a list, however weak."""
    return [r for r in read_paths(file) if r["event"].split(";")[0] in persistence.EVENTS]


def agree(true_folder, folder, count):
    """{paths, found, own, true: share of own, level_db, level_90_db, refused} of a scene's path lists of poses a000 and on.

    paths: of the true mesh, within 20 dB of a pose's strongest; found: the share of them that the scene has, however weak;
    own: strong paths of the scene; true: the share of them that the true mesh has; level_db, level_90_db: half and nine in
    ten of the found paths' levels differ by less; refused: poses that one of both did not take (a radar inside a body).
    """
    paths = found = own = true = refused = 0
    changes = []
    for i in range(count):
        files = [os.path.join(place, "paths", f"a{i:03d}.csv") for place in (true_folder, folder)]
        if not all(os.path.exists(file) for file in files):
            refused += 1
            continue
        truth, scene = (without_names(persistence.strong_paths(file)) for file in files)
        all_truth, all_scene = (without_names(specular(file)) for file in files)
        pairs, _, _ = match(truth, all_scene, REACH_M, REACH_DEG)
        back, _, _ = match(scene, all_truth, REACH_M, REACH_DEG)
        paths, found, own, true = paths + len(truth), found + len(pairs), own + len(scene), true + len(back)
        changes += [abs(a["amplitude_db"] - b["amplitude_db"]) for a, b in pairs]
    level, level_90 = (float(np.quantile(changes, q)) if changes else math.nan for q in (0.5, 0.9))
    return {"paths": paths, "found": found / max(paths, 1), "own": own, "true": true / max(own, 1), "level_db": level,
            "level_90_db": level_90, "refused": refused}


def draw_picture(records, file):
    """PNG of found and true shares and of the time over triangles. records: those of the rows, each with label, triangles,
    pose_s, found and true."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, (left, right) = pyplot.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
    meshes = sorted((r for r in records if r["label"].startswith("meshes")), key=lambda r: r["triangles"])
    others = [r for r in records if r not in meshes]
    for key, colour, text in (("found", "tab:blue", "of the room's paths, the scene has"),
                              ("true", "tab:orange", "of the scene's paths, the room has")):
        left.plot([r["triangles"] for r in meshes], [100 * r[key] for r in meshes], "o-", color=colour, label=text)
        left.plot([r["triangles"] for r in others], [100 * r[key] for r in others], "s", color=colour, mfc="none")
    right.plot([r["triangles"] for r in meshes], [r["pose_s"] for r in meshes], "o-", color="tab:green")
    right.plot([r["triangles"] for r in others], [r["pose_s"] for r in others], "s", color="tab:green", mfc="none")
    for axes, key in ((left, "found"), (right, "pose_s")):
        for r in others:
            y = 100 * r[key] if key == "found" else r[key]
            side = -1 if r["triangles"] > 1e5 or r["label"] == "boxes" else 1      # where free room is
            axes.annotate(r["label"], (r["triangles"], y), textcoords="offset points", fontsize=8, va="center",
                          xytext=(8 * side, 6), ha="left" if side > 0 else "right")
        axes.set_xscale("log")
        axes.set_xlabel("triangles of the scene")
        axes.grid(True, alpha=0.3)
    left.set_ylim(0, 109)
    left.set_ylabel("share of strong specular paths, %")
    left.legend(fontsize=8, loc="lower left")
    right.set_yscale("log")
    right.set_ylabel("processor time of a pose, s")
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
