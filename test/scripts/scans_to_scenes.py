#!/usr/bin/env python3
"""Makes scenes of degraded scans of known rooms, and of real scans, and measures what came out.

Results stand in OUTPUT/results.jsonl, and a scan that is done does not run again. The table is printed at the end and written
to OUTPUT/table.md. Scans and scenes stay in OUTPUT. With --limits it measures how accuracy depends on the triangles of one
scan's scene, in place of all scans; the picture of that is OUTPUT/triangles.png.
"""
import argparse
import math
import os
import shutil
import subprocess
import sys
import time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "src"))

import numpy as np
import yaml

from mmradartwin_tests import office
from mmradartwin_tests.arguments import whole
from mmradartwin_tests.blind import table
from mmradartwin_tests.blind.trials import Results
from mmradartwin_tests.geometry import Actor
from mmradartwin_tests.installed_programs import find_program
from mmradartwin_tests.resumable_program import run_resumable
from mmradartwin_tests.scans import persistence, scan_files, scene_comparison, scene_materials, triangle_budget
from mmradartwin_tests.scans.degraded_scan import DEGRADATIONS, Scan, make_scan
from mmradartwin_tests.scans.drawn_room import SHAPES, draw_room
from mmradartwin_tests.scans.known_room import ROOMS, rectangles_of, third_world_room
from mmradartwin_tests.third_world.rooms import KINDS

CASES = (("phone", "office"), ("fused_fine", "office"),
         ("fused_mm_y_up", "l_shaped"), ("poisson", "meeting_97"), ("lidar_cloud", "office"),
         ("noisy_cloud", "l_shaped"), ("doubled_frames", "living_room"), ("far_coordinates", "laboratory"),
         ("three_million", "small_office"))
# Drawn scans take these in turn, so that each fault meets other rooms with each seed.
FAULTS = ("phone", "doubled_frames", "noisy_cloud", "fused_mm_y_up", "lidar_cloud", "poisson", "far_coordinates", "fused_fine")
REAL = ("hololens_room.ply", "kinect_office.pcd")
MOST_RAW = 800000      # triangles of a raw scan that is simulated beside its scene


def parse():
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", required=True, help="folder of scans, scenes, results and table")
    parser.add_argument("--seed", type=whole(0), default=1, help="of scans and poses (default: 1)")
    parser.add_argument("--draw", type=whole(0), default=0,
                        help="so many scans of drawn rooms in place of the known cases and the real scans (default: 0)")
    parser.add_argument("--cases", default="", help="only these, by names of scans or rooms, with commas (default: all)")
    parser.add_argument("--real", default=os.path.join(os.environ.get("MMRADARTWIN_DATA", ""), "rooms"),
                        help="folder of the real scans (default: rooms in MMRADARTWIN_DATA)")
    parser.add_argument("--pairs", type=whole(0), default=50, help="of poses 1 cm apart; 0: none (default: 50)")
    parser.add_argument("--limits", default="",
                        help="limits of triangles, with commas: things as meshes of so many against shapes, boxes, the raw and "
                        "the true mesh, of the first of --cases; --pairs poses")
    parser.add_argument("--table", action="store_true", help="run nothing, print the table of the results that exist")
    return parser.parse_args()


def peak_mib(process):
    """Most memory that a running process has had, MiB; 0 where it is gone."""
    try:
        with open(f"/proc/{process}/status", encoding="ascii") as text:
            return next((int(line.split()[1]) / 1024 for line in text if line.startswith("VmHWM:")), 0.0)
    except OSError:
        return 0.0


def make_scene(scan_file, folder, *options):
    """{status, seconds, mib, log's last line} of the program."""
    log = folder + ".log"
    # The child of a large process is as large itself for a moment: the peak is asked for while it runs.
    start, mib, limit_s = time.monotonic(), 0.0, 600
    with open(log, "wb") as out:
        child = subprocess.Popen([find_program("mmradartwin_sim", "make_scene"), scan_file, "--output", folder, "--force",
                                  *options], stdin=subprocess.DEVNULL, stdout=out, stderr=out)
    while child.poll() is None and time.monotonic() - start < limit_s:
        mib = max(mib, peak_mib(child.pid))
        time.sleep(0.02)
    child.kill()
    status, seconds = child.wait(), time.monotonic() - start
    with open(log, encoding="utf-8", errors="replace") as text:
        lines = text.read().strip().splitlines()
    return {"status": status, "seconds": round(seconds, 1), "mib": round(mib), "said": lines[-1] if lines else ""}


def raw_scene(folder, scan, quality):
    """scene.yaml of the raw mesh in the map of its scene, as one concrete actor with wide facets."""
    os.makedirs(folder, exist_ok=True)
    T = scene_comparison.map_from_truth(quality, scan) @ np.linalg.inv(scan.T_scan_map)
    upright = Scan(scan.points @ T[:3, :3].T + T[:3, 3], scan.faces, None, scan.T_scan_map, scan.step_m)
    scan_files.write_ply(os.path.join(folder, "raw.ply"), upright)
    with open(os.path.join(folder, "scene.yaml"), "w", encoding="ascii") as out:
        out.write("meshes:\n  - {file: raw.ply}\nfacets: {angle_deg: 35, offset_m: 0.05}\nmaterials: materials.yaml\n"
                  "actors: {raw: {material: Concrete}}\n")
    with open(os.path.join(folder, "materials.yaml"), "w", encoding="ascii") as out:
        out.write("materials:\n  Concrete: {model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38, "
                  "scattering_coefficient: 0.5}\n")
    return os.path.join(folder, "scene.yaml")


def true_scene(folder, room, T_map_room):
    """scene.yaml of the known room in the map of its scene."""
    os.makedirs(folder, exist_ok=True)
    actors = []
    for a in room.actors():
        flat = [r for part in a.parts for r in rectangles_of(part)]
        tag = a.tag if a.tag in office.MATERIALS else "Concrete"
        actors.append(Actor(a.name, tag, flat).moved(T_map_room[:3, :3], T_map_room[:3, 3]))
    office.write_scene(folder, actors)
    return os.path.join(folder, "scene.yaml")


def steady(scene_yaml, room, T, arguments, place):
    """persistence.measure() of a scene; what went wrong as a text."""
    pairs = persistence.draw_pairs(room, T, np.random.default_rng([arguments.seed, 50]), arguments.pairs)
    persistence.write_session(place, scene_yaml, pairs)
    try:
        persistence.simulate(find_program("mmradartwin_sim", "simulate"), place, place + "_simulated")
    except (ValueError, OSError) as error:
        return {"failed": str(error)}
    return persistence.measure(place + "_simulated", pairs)


def drawn_cases(count, seed):
    """[(name of a fault, name of a room)] of drawn scans: each shape and each known room in turn, each with a fault."""
    rng = np.random.default_rng([seed, 4949])
    shapes, rooms = rng.permutation(list(SHAPES)), rng.permutation(["office", "laboratory", "living_room", "l_shaped"])
    faults = rng.permutation(FAULTS)
    order = [*shapes, *rooms]
    chosen = []
    for i in range(count):
        # The second round of faults begins one later, so that no fault meets the same room again.
        fault = faults[(i + i // len(order)) % len(faults)]
        room = order[i % len(order)]
        chosen.append((str(fault), f"{room}:{seed + i // len(order)}" if room in SHAPES or room in KINDS else str(room)))
    return chosen


def room_of(name):
    """A room of ROOMS by its name, or a drawn one: SHAPE:SEED, or KIND:SEED of the third world."""
    kind, _, seed = name.partition(":")
    if not seed:
        return ROOMS[name]()
    return draw_room(kind, int(seed)) if kind in SHAPES else third_world_room(kind, int(seed))


def run_known(name, room_name, arguments):
    """Record of a degraded scan of a known or drawn room."""
    room = room_of(room_name)
    room_name = room_name.replace(":", "_")
    place = os.path.join(arguments.output, f"{name}_{room_name}")
    scan = make_scan(room, DEGRADATIONS[name], arguments.seed)
    file = place + ".ply"
    scan_files.write_ply(file, scan)
    scan_files.write_truth(place + ".json", room, scan)
    record = {"key": f"{name}_{room_name}", "size": len(scan.points if scan.faces is None else scan.faces),
              "cloud": scan.faces is None, **make_scene(file, place)}
    if record["status"] != 0:
        return record
    found = scene_comparison.compare(place, room, scan)
    record.update(floor_m=found.floor_m, tilt_deg=found.tilt_deg, walls=found.walls, wall_share=found.wall_share,
                  furniture=found.furniture, flat=found.flat, extra=found.extra, unscanned=found.unscanned,
                  checks=found.quality["checks"],
                  accuracy_m=found.quality["accuracy"]["scene_m"])
    if arguments.pairs:
        T = scene_comparison.map_from_truth(found.quality, scan)
        record["steady"] = steady(os.path.join(place, "scene.yaml"), room, T, arguments, place + "_pairs")
        record["steady_true"] = steady(true_scene(place + "_true", room, T), room, T, arguments, place + "_true_pairs")
        if scan.faces is not None and len(scan.faces) <= MOST_RAW:
            raw = raw_scene(place + "_raw", scan, found.quality)
            record["steady_raw"] = steady(raw, room, T, arguments, place + "_raw_pairs")
    return record


def run_real(name, arguments):
    """Record of a real scan, of which no truth is known."""
    place = os.path.join(arguments.output, name.split(".")[0])
    record = {"key": name, "cloud": name.endswith(".pcd"), "size": 0, **make_scene(os.path.join(arguments.real, name), place)}
    if record["status"] == 0:
        quality = scene_comparison.read_summary(place)
        areas = quality["areas"]
        record.update(wall_share=areas["wall_on_planes_m2"] / max(areas["wall_m2"], 1e-9), checks=quality["checks"],
                      accuracy_m=quality["accuracy"]["scene_m"], things=len(quality["things"] or []),
                      planes=len(quality["planes"]))
    return record


def give_true_materials(folder, room, T, true_folder):
    """Gives the actors of a made scene the room's own materials, so that levels differ by the mesh alone."""
    tags = scene_materials.true_tags(room, scene_comparison.read_obj(os.path.join(folder, "room.obj")), T)
    file = os.path.join(folder, "scene.yaml")
    with open(file, encoding="utf-8") as text:
        scene = yaml.safe_load(text)
    for actor, entry in scene["actors"].items():
        tag = tags.get(actor, entry["material"])
        entry["material"] = tag if tag in office.MATERIALS else "Concrete"
    with open(file, "w", encoding="utf-8") as out:
        yaml.safe_dump(scene, out)
    shutil.copy(os.path.join(true_folder, "materials.yaml"), folder)


def triangles_of(folder):
    """Triangles of a folder's OBJ or, of a raw scan, of its PLY."""
    for name in os.listdir(folder):
        with open(os.path.join(folder, name), "rb") as file:
            if name.endswith(".obj"):
                # An OBJ of the generator has faces of four corners.
                return sum(len(line.split()) - 3 for line in file if line.startswith(b"f "))
            if name.endswith(".ply"):
                return next(int(line.split()[2]) for line in file if line.startswith(b"element face"))
    raise ValueError(f"{folder}: holds no mesh")


def run_limits(name, room_name, arguments, results):
    """Rows of one scan: its things as shapes, as boxes and as meshes of so many triangles; the true and the raw mesh."""
    room = room_of(room_name)
    place = os.path.join(arguments.output, f"{name}_{room_name.replace(':', '_')}")
    scan = make_scan(room, DEGRADATIONS[name], arguments.seed)
    scan_files.write_ply(place + ".ply", scan)
    options = {"shapes": ("--things", "shapes"), "boxes": ("--things", "boxes")}
    options.update({f"meshes, at most {n}": ("--things", "meshes", "--triangles", n) for n in arguments.limits.split(",")})
    folders = {label: place + "_" + label.replace(",", "").replace(" ", "_") for label in [*options, "true mesh", "raw mesh"]}
    for label, more in options.items():
        made = make_scene(place + ".ply", folders[label], *more)
        if made["status"] != 0:
            raise ValueError(f"{place}.ply: make_scene {' '.join(more)}: {made['said']}")
    # All scenes of one scan have the same map: the option concerns things alone.
    quality = scene_comparison.read_summary(folders["shapes"])
    T = scene_comparison.map_from_truth(quality, scan)
    true_scene(folders["true mesh"], room, T)
    for label in options:
        give_true_materials(folders[label], room, T, folders["true mesh"])
    if scan.faces is None or len(scan.faces) > MOST_RAW:
        del folders["raw mesh"]
    else:
        raw_scene(folders["raw mesh"], scan, quality)
    poses = [a for a, _ in persistence.draw_pairs(room, T, np.random.default_rng([arguments.seed, 51]), arguments.pairs)]
    true_paths = f"{folders['true mesh']}_paths_{len(poses)}_simulated"
    for label in sorted(folders, key=lambda label: label != "true mesh"):
        folder, record = folders[label], {"key": f"{name}_{room_name}: {label}", "label": label}
        if record["key"] in results.records:
            continue
        simulated, record["pose_s"] = triangle_budget.simulate(os.path.join(folder, "scene.yaml"), poses, folder + "_paths")
        record.update(triangles=triangles_of(folder), **triangle_budget.agree(true_paths, simulated, len(poses)))
        if label in options:
            record["things"] = len(scene_comparison.read_summary(folder)["things"])
        results.add(record)
        print(" | ".join(limit_row(record)), flush=True)


def limit_row(record):
    """Cells of a record of run_limits()."""
    return [record["label"], str(record["triangles"]), str(record.get("things", "")), f"{1e3 * record['pose_s']:.1f} ms",
            f"{100 * record['found']:.0f} % of {record['paths']}", f"{100 * record['true']:.0f} % of {record['own']}",
            "" if record["label"] == "raw mesh" else f"{record['level_db']:.1f} dB, {record['level_90_db']:.1f} dB",
            str(record["refused"])]


LIMIT_HEAD = ("scene", "triangles", "things", "processor time of a pose", "of the room's strong paths, the scene has",
              "of the scene's strong paths, the room has", "levels: half, nine in ten within", "poses refused")


def worst(walls, index):
    """Largest error of the walls that were found."""
    return max((w[index] for w in walls if not math.isnan(w[index])), default=math.nan)


def row(record):
    """Cells of a record."""
    cells = [record["key"],
             f"{record['size'] / 1e6:.2f} M {'points' if record['cloud'] else 'triangles'}" if record["size"] else "",
             f"{record['seconds']:.0f} s", f"{record['mib']} MiB"]
    if record["status"] != 0:
        return [*cells, record["said"]] + [""] * 10
    cells.append(f"{100 * record['wall_share']:.0f} %")
    if "walls" in record:
        absent = sum(math.isnan(w[1]) for w in record["walls"])
        right = sum(r for _, _, r in record["furniture"])
        cells += [f"{1e3 * record['floor_m']:+.1f} mm", f"{record['tilt_deg']:.3f}°", f"{1e3 * worst(record['walls'], 1):.1f} mm",
                  f"{worst(record['walls'], 2):.2f}°" + (f", {absent} absent" if absent else ""),
                  f"{right} of {len(record['furniture'])}",
                  f"{sum(r for _, _, r in record['flat'])} of {len(record['flat'])}"]
    else:
        cells += ["", "", "", "", "", ""]
    checks = record["checks"]
    cells.append(f"{checks['through_gaps']} / {sum(checks['places_in_bodies'].values())} / "
                 f"{sum(checks['coincident_m2'].values()):.2f} m² / {sum(checks['slivers'].values())}")
    for key in ("steady", "steady_raw", "steady_true"):
        s = record.get(key)
        cells.append("" if not s else s["failed"] if "failed" in s else "no path" if not s["paths"] else
                     f"{100 * s['persist']:.0f} % of {s['paths']}, {100 * s['within_1_db']:.0f} % within 1 dB" +
                     (f", {s['refused']} pairs refused" if s.get("refused") else ""))
    return cells


HEAD = ("scan", "size", "time", "memory", "wall area on planes", "floor", "tilt", "walls' offset", "walls' angle",
        "furniture", "flat things", "gaps / bodies / coincident / slivers", "paths that persist over 1 cm", "on the raw mesh",
        "with the true mesh")


def write_table(arguments, head, rows):
    """Writes table.md and prints it."""
    text = table.markdown(head, rows)
    with open(os.path.join(arguments.output, "table.md"), "w", encoding="utf-8") as out:
        out.write(text + "\n")
    print(text)


def run_all_limits(arguments, wanted):
    """Runs what is missing of --limits, then table and picture."""
    results = Results(os.path.join(arguments.output, "limits.jsonl"), ("label", "triangles", "pose_s", "found", "true"))
    if not arguments.table:
        name, room = next((c for c in CASES if not wanted or any(w in "_".join(c) for w in wanted)), (None, None))
        if name is None:
            raise ValueError(f"--cases {arguments.cases}: names no scan of a known room")
        if arguments.pairs < 2:
            raise ValueError("--pairs: --limits wants two poses at least")
        run_limits(name, room, arguments, results)
    records = list(results.records.values())
    write_table(arguments, LIMIT_HEAD, [limit_row(r) for r in records])
    triangle_budget.draw_picture(records, os.path.join(arguments.output, "triangles.png"))


def run(arguments):
    """Runs what is missing."""
    results = Results(os.path.join(arguments.output, "results.jsonl"), ("status", "seconds"))
    wanted = [c for c in arguments.cases.split(",") if c]
    if arguments.limits:
        run_all_limits(arguments, wanted)
        return
    cases = drawn_cases(arguments.draw, arguments.seed) if arguments.draw else CASES
    todo = [(f"{name}_{room.replace(':', '_')}", lambda n=name, r=room: run_known(n, r, arguments)) for name, room in cases]
    if not arguments.draw:
        todo += [(name, lambda n=name: run_real(n, arguments))
                 for name in REAL if os.path.exists(os.path.join(arguments.real, name))]
    if not arguments.table:
        if find_program("mmradartwin_sim", "make_scene") is None:
            raise ValueError("mmradartwin_sim make_scene is not in the sourced workspace; build it first")
        for key, measure in todo:
            if key in results.records or (wanted and not any(w in key for w in wanted)):
                continue
            results.add(measure())
            print(" | ".join(row(results.records[key])), flush=True)
    write_table(arguments, HEAD, [row(r) for r in results.records.values()])


if __name__ == "__main__":
    sys.exit(run_resumable(parse, run))
