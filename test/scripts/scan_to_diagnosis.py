#!/usr/bin/env python3
"""The whole way: measured sessions of the office, whose twin is a scene made of a scan, evaluated and diagnosed.

Each session is evaluated with the true mesh and with the scene made of a degraded scan, and diagnosed with the latter. Rows:
`clean` hides nothing, `single` one effect. Results stand in OUTPUT/results.jsonl, and a session that is done does not run
again. The table is printed at the end and written to OUTPUT/table.md.
"""
import argparse
import json
import os
import shutil
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

import numpy as np

from mmradartwin_tests import effects
from mmradartwin_tests.arguments import whole
from mmradartwin_tests.blind import scoring, table
from mmradartwin_tests.blind.trials import Results, answer, run_measured
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.resumable_program import run_resumable
from mmradartwin_tests.scans import scan_files, scene_comparison
from mmradartwin_tests.scans.degraded_scan import DEGRADATIONS, make_scan
from mmradartwin_tests.scans.known_room import office_room
from mmradartwin_tests.session import Measurement, Settings

SCANS = ("phone", "fused_fine", "lidar_cloud", "poisson")
HIDDEN = ("radar_yaw_offset", "range_bias", "element_pattern", "tx_imbalance", "iq_imbalance", "excess_attenuation",
          "second_harmonic", "radar_position_offset", "mutual_coupling", "carrier_scale")


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", required=True, help="folder of scans, scenes, results and table")
    parser.add_argument("--what", default="clean,single", help="rows, in turn: clean, single (default: both)")
    parser.add_argument("--sessions", type=whole(1), default=20, help="of each row (default: 20)")
    parser.add_argument("--poses", type=whole(1), default=24, help="of each session (default: 24)")
    parser.add_argument("--frames", type=whole(1), default=8, help="of each pose (default: 8)")
    parser.add_argument("--jobs", type=whole(1), default=1, help="threads of one diagnosis")
    parser.add_argument("--budget", type=float, metavar="MINUTES", help="start no session after this time")
    parser.add_argument("--table", action="store_true", help="run nothing, print the table of the results that exist")
    return parser.parse_args()


def made_scene(kind, output):
    """(folder, Measured, T_map_office) of the scene that make_scene makes of the office's scan of a kind."""
    room, place = office_room(), os.path.join(output, kind)
    scan = make_scan(room, DEGRADATIONS[kind], 1)
    if not os.path.exists(os.path.join(place, "quality.yaml")):
        scan_files.write_ply(place + ".ply", scan)
        status, *_ = run_measured([find_program("mmradartwin_sim", "make_scene"), place + ".ply", "--output", place, "--force"],
                                  600, place + ".log")
        if status != 0:
            raise ValueError(f"{place}.ply: make_scene ended with status {status}; see {place}.log")
    found = scene_comparison.compare(place, room, scan)
    return place, found, scene_comparison.map_from_truth(found.quality, scan)


def put_scene(session, scene, T_map_office, accuracy_m):
    """Puts a made scene into a session in place of its own, moved into the session's map, and states its accuracy."""
    for name in os.listdir(session):
        if name in ("scene.yaml", "materials.yaml") or name.endswith(".obj"):
            os.remove(os.path.join(session, name))
    for name in ("scene.yaml", "materials.yaml"):
        shutil.copy(os.path.join(scene, name), session)
    back = np.linalg.inv(T_map_office)
    with open(os.path.join(scene, "room.obj"), encoding="utf-8") as text, \
            open(os.path.join(session, "room.obj"), "w", encoding="utf-8") as out:
        for line in text:
            if line.startswith("v "):
                p = back[:3, :3] @ [float(w) for w in line.split()[1:4]] + back[:3, 3]
                line = f"v {p[0]:.6f} {p[1]:.6f} {p[2]:.6f}\n"
            out.write(line)
    with open(os.path.join(session, "session.yaml"), "a", encoding="ascii") as out:
        out.write(f"accuracy: {{scene_m: {accuracy_m:.4f}}}\n")


def recalled(session, output):
    """[recalled, active] regions of all ranges, by evaluate."""
    status, *_ = run_measured([find_program("mmradartwin_attribution", "evaluate"), session, "--output", output, "--force",
                               "--no-pictures", "--no-bag"], 900, output + ".log")
    if status not in (0, 2):
        raise ValueError(f"{session}: evaluate ended with status {status}; see {output}.log")
    with open(os.path.join(output, "summary.json"), encoding="utf-8") as text:
        bands = json.load(text)["central"]["recall_by_band"].values()
    return [sum(b["recalled"] for b in bands), sum(b["active"] for b in bands)]


def run_session(seed, row, arguments):
    """One record."""
    kind = SCANS[seed % len(SCANS)]
    place = os.path.join(arguments.output, f"{row}_{seed}")
    shutil.rmtree(place, ignore_errors=True)
    os.makedirs(place)
    chosen = [] if row == "clean" else [effects.make_effect(HIDDEN[seed % len(HIDDEN)], {}, None)]
    session = os.path.join(place, "session")
    measurement = Measurement(Settings(output=session, seed=1000 * (row == "single") + seed, poses=arguments.poses,
                                       frames=arguments.frames, headings=2, duplicates=0, effects=chosen, jobs=1))
    measurement.run()
    true_recall = recalled(session, os.path.join(place, "true"))
    scene, found, T = made_scene(kind, arguments.output)
    put_scene(session, scene, T, found.quality["accuracy"]["scene_m"])
    recall = recalled(session, os.path.join(place, "made"))
    record = answer(find_program("mmradartwin_attribution", "diagnose"), session, place, 1800, arguments.jobs)
    record.update(key=f"{row}-{seed}", row=row, seed=seed, scan=kind, truths=measurement.hidden(), recall=recall,
                  true_recall=true_recall)
    return record


def text_of(record):
    """One line."""
    said = ", ".join(f["cause"] for f in record["findings"]) or record["verdict"] or str(record.get("log"))
    return (f"{record['key']} {record['scan']} {record['seconds']:.0f} s | hidden: "
            f"{', '.join(t['cause'] for t in record['truths']) or 'nothing'} | said: {said} | recall "
            f"{record['recall'][0]}/{record['recall'][1]}, true mesh {record['true_recall'][0]}/{record['true_recall'][1]}")


def table_of(records):
    """Rows: figure, required, measured, sessions."""
    done = [r for r in records if r["status"] == "ok"]
    clean, single = ([r for r in done if r["row"] == row] for row in ("clean", "single"))
    recall = lambda rows, key: sum(r[key][0] for r in rows) / max(sum(r[key][1] for r in rows), 1)
    named = [bool(r["findings"]) and scoring.same_cause(r["truths"][0], r["findings"][0]["cause"]) for r in single]
    anywhere = [any(scoring.same_cause(r["truths"][0], f["cause"]) for f in r["findings"]) for r in single]
    rows = [("recall with the made scene, nothing hidden", "within 0.03 of the next", f"{recall(clean, 'recall'):.3f}", len(clean)),
            ("recall with the true mesh, nothing hidden", "", f"{recall(clean, 'true_recall'):.3f}", len(clean)),
            ("nothing hidden: a finding", "none", *table.share([bool(r["findings"]) for r in clean])),
            ("one effect hidden: named first", "≥ 85 %", *table.share(named)),
            ("one effect hidden: named at all", "", *table.share(anywhere)),
            ("no answer", "none", str(len(records) - len(done)), len(records))]
    return table.markdown(table.HEAD, [(a, b, c, str(d)) for a, b, c, d in rows])


def run(arguments):
    """Runs what is missing."""
    results = Results(os.path.join(arguments.output, "results.jsonl"), ("row", "status", "recall"))
    rows = arguments.what.split(",")
    if not set(rows) <= {"clean", "single"}:
        raise ValueError(f"--what {arguments.what}: wants clean, single or both")
    start = time.monotonic()
    for seed in range(0 if not arguments.table else arguments.sessions, arguments.sessions):
        for row in rows:
            late = arguments.budget is not None and time.monotonic() - start > 60 * arguments.budget
            if f"{row}-{seed}" in results.records or late:
                continue
            record = run_session(seed, row, arguments)
            results.add(record)
            print(text_of(record), flush=True)
    text = table_of(list(results.records.values()))
    with open(os.path.join(arguments.output, "table.md"), "w", encoding="utf-8") as out:
        out.write(text + "\n")
    print(text)


if __name__ == "__main__":
    sys.exit(run_resumable(parse, run))
