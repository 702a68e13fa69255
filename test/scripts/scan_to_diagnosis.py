#!/usr/bin/env python3
"""The whole way: measured sessions of the office, whose twin is a scene made of a scan, evaluated and diagnosed.

Each session is evaluated with the true mesh, with the scene that make_scene proposes of a degraded scan, and with that scene
once a person has corrected its materials: what an actor stands for in the room gives its material. Rows: `clean` hides
nothing, `single` one effect. Results stand in OUTPUT/results.jsonl, and a session that is done does not run again. The table
is printed at the end and written to OUTPUT/table.md.
"""
import argparse
import dataclasses
import json
import os
import shutil
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

import numpy as np
import yaml

from mmradartwin_tests import effects
from mmradartwin_tests.arguments import whole
from mmradartwin_tests.blind import scoring, table
from mmradartwin_tests.blind.trials import Results, answer, run_measured
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.resumable_program import run_resumable
from mmradartwin_tests.scans import scan_files, scene_comparison, scene_materials
from mmradartwin_tests.scans.degraded_scan import DEGRADATIONS, make_scan
from mmradartwin_tests.scans.known_room import office_room
from mmradartwin_tests.session import Measurement, Settings

SCENES = {"true": "the true mesh", "corrected": "the made scene, materials corrected", "proposed": "the made scene as it is"}
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
    parser.add_argument("--diagnose", choices=("corrected", "proposed", "none"), default="corrected",
                        help="scene that sessions are diagnosed with (default: corrected)")
    parser.add_argument("--budget", type=float, metavar="MINUTES", help="start no session after this time")
    parser.add_argument("--table", action="store_true", help="run nothing, print the table of the results that exist")
    return parser.parse_args()


@dataclasses.dataclass
class MadeScene:
    """Scene that make_scene made of a scan of the office: its folder, the map's frame, and the accuracy that it states."""
    folder: str
    T_map_office: np.ndarray
    accuracy: dict


def run_make_scene(scan_file, folder):
    """Makes a scene into a folder, or makes it anew."""
    status, *_ = run_measured([find_program("mmradartwin_sim", "make_scene"), scan_file, "--output", folder, "--force"], 600,
                              folder + ".log")
    if status != 0:
        raise ValueError(f"{scan_file}: make_scene ended with status {status}; see {folder}.log")


def correct(folder, tags):
    """Says of all actors what they are of, as a person does: tags, and what was proposed where tags have nothing."""
    file = os.path.join(folder, "scene.yaml")
    with open(file, encoding="utf-8") as text:
        scene = yaml.safe_load(text)
    for actor, entry in scene["actors"].items():
        entry["material"] = tags.get(actor, entry["material"])
    with open(file, "w", encoding="utf-8") as out:
        yaml.safe_dump(scene, out)


def made_scenes(kind, output):
    """(MadeScene as it was proposed, MadeScene with corrected materials) of the office's scan of a kind."""
    room = office_room()
    scan = make_scan(room, DEGRADATIONS[kind], 1)
    file = os.path.join(output, kind + ".ply")
    folders = [os.path.join(output, f"{kind}_{how}") for how in ("proposed", "corrected")]
    for folder in folders:
        if os.path.exists(os.path.join(folder, "whole")):
            continue
        if folder == folders[0]:
            scan_files.write_ply(file, scan)
            run_make_scene(file, folder)
        else:
            shutil.rmtree(folder, ignore_errors=True)
            shutil.copytree(folders[0], folder)
            os.remove(os.path.join(folder, "whole"))
            objects = scene_comparison.read_obj(os.path.join(folder, "room.obj"))
            correct(folder, scene_materials.true_tags(room, objects, read_made(folders[0], scan).T_map_office))
            run_make_scene(file, folder)
        with open(os.path.join(folder, "whole"), "w", encoding="ascii"):
            pass
    return tuple(read_made(folder, scan) for folder in folders)


def read_made(folder, scan):
    """MadeScene of a folder that make_scene wrote."""
    quality = scene_comparison.read_summary(folder)
    return MadeScene(folder, scene_comparison.map_from_truth(quality, scan), quality["accuracy"])


def with_scene(session, made, copy):
    """A copy of a session that has a made scene, moved into the session's map, in place of its own, and its accuracy."""
    shutil.rmtree(copy, ignore_errors=True)
    shutil.copytree(session, copy)
    for name in os.listdir(copy):
        if name.endswith(".obj"):
            os.remove(os.path.join(copy, name))
    for name in ("scene.yaml", "materials.yaml"):
        shutil.copy(os.path.join(made.folder, name), copy)
    back = np.linalg.inv(made.T_map_office)
    with open(os.path.join(made.folder, "room.obj"), encoding="utf-8") as text, \
            open(os.path.join(copy, "room.obj"), "w", encoding="utf-8") as out:
        for line in text:
            if line.startswith("v "):
                p = back[:3, :3] @ [float(w) for w in line.split()[1:4]] + back[:3, 3]
                line = f"v {p[0]:.6f} {p[1]:.6f} {p[2]:.6f}\n"
            out.write(line)
    with open(os.path.join(copy, "session.yaml"), "a", encoding="ascii") as out:
        out.write("accuracy: " + json.dumps(made.accuracy) + "\n")
    return copy


def evaluated(session, output):
    """{"recall": [recalled, active] regions of all ranges, "level_db": interquartile range of matched levels}, by evaluate."""
    status, *_ = run_measured([find_program("mmradartwin_attribution", "evaluate"), session, "--output", output, "--force",
                               "--no-pictures", "--no-bag"], 900, output + ".log")
    if status not in (0, 2):
        raise ValueError(f"{session}: evaluate ended with status {status}; see {output}.log")
    with open(os.path.join(output, "summary.json"), encoding="utf-8") as text:
        central = json.load(text)["central"]
    bands = central["recall_by_band"].values()
    return {"recall": [sum(b["recalled"] for b in bands), sum(b["active"] for b in bands)],
            "level_db": central["q3_iqr_db"]}


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
    proposed, corrected = (with_scene(session, made, os.path.join(place, name)) for name, made in
                           zip(("proposed", "corrected"), made_scenes(kind, arguments.output)))
    maps = {name: evaluated(folder, os.path.join(place, "maps_" + name))
            for name, folder in (("true", session), ("corrected", corrected), ("proposed", proposed))}
    diagnosed = {"none": None, "corrected": corrected, "proposed": proposed}[arguments.diagnose]
    record = {"status": "ok", "seconds": 0, "verdict": None, "findings": []} if diagnosed is None else \
        answer(find_program("mmradartwin_attribution", "diagnose"), diagnosed, place, 3600, arguments.jobs)
    record.update(key=f"{row}-{seed}", row=row, seed=seed, scan=kind, truths=measurement.hidden(), maps=maps,
                  diagnosed=arguments.diagnose)
    return record


def text_of(record):
    """One line."""
    said = "; ".join(f["cause"] + " " + ", ".join(f"{k}={p['value']}" for k, p in f["parameters"].items())
                     for f in record["findings"]) or record["verdict"] or str(record.get("log"))
    maps = ", ".join(f"{name} {m['recall'][0]}/{m['recall'][1]} ({m['level_db']:.2f} dB)" for name, m in record["maps"].items())
    return (f"{record['key']} {record['scan']} {record['seconds']:.0f} s | hidden: "
            f"{', '.join(t['cause'] for t in record['truths']) or 'nothing'} | said: {said} | recall {maps}")


def table_of(records):
    """Rows: figure, required, measured, sessions."""
    done = [r for r in records if r["status"] == "ok"]
    rows = []
    for row, hidden in (("clean", "nothing hidden"), ("single", "one effect hidden")):
        mine = [r for r in done if r["row"] == row]
        recall = {name: [sum(r["maps"][name]["recall"][k] for r in mine) for k in (0, 1)] for name in SCENES}
        text = {name: f"{hit / max(all_of, 1):.3f} ({hit} of {all_of})" for name, (hit, all_of) in recall.items()}
        rows += [(f"{hidden}: recall with {SCENES[name]}", "within 0.03 of the true mesh's" if name == "corrected" else "",
                  text[name], len(mine)) for name in SCENES]
    clean, single = ([r for r in done if r["row"] == row and r["diagnosed"] != "none"] for row in ("clean", "single"))
    named = [bool(r["findings"]) and scoring.same_cause(r["truths"][0], r["findings"][0]["cause"]) for r in single]
    anywhere = [any(scoring.same_cause(r["truths"][0], f["cause"]) for f in r["findings"]) for r in single]
    rows += [("nothing hidden: a finding", "none", *table.share([bool(r["findings"]) for r in clean])),
             ("one effect hidden: named first", "≥ 85 %", *table.share(named)),
             ("one effect hidden: named at all", "", *table.share(anywhere)),
             ("no answer", "none", str(len(records) - len(done)), len(records))]
    return table.markdown(table.HEAD, [(a, b, c, str(d)) for a, b, c, d in rows])


def run(arguments):
    """Runs what is missing."""
    results = Results(os.path.join(arguments.output, "results.jsonl"), ("row", "status", "maps", "diagnosed"))
    rows = arguments.what.split(",")
    if not set(rows) <= {"clean", "single"}:
        raise ValueError(f"--what {arguments.what}: wants clean, single or both")
    start = time.monotonic()
    for seed in range(0 if not arguments.table else arguments.sessions, arguments.sessions):
        for row in rows:
            late = arguments.budget is not None and time.monotonic() - start > 60 * arguments.budget
            known = results.records.get(f"{row}-{seed}")
            if late or (known and arguments.diagnose in ("none", known["diagnosed"])):
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
