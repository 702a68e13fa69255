"""Writes scans as PLY (binary, mesh or points), PCD and plain rows of coordinates."""
import json

import numpy as np

from mmradartwin_tests.scans.known_room import rectangles_of


def write_ply(path, scan):
    """Binary PLY; double where the coordinates are too large for float."""
    kind, name = ("<f8", "double") if np.abs(scan.points).max() > 1e5 else ("<f4", "float")
    fields = [("x", kind), ("y", kind), ("z", kind)]
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(scan.points)}"]
    header += [f"property {name} {axis}" for axis in "xyz"]
    if scan.colors is not None:
        fields += [(c, "u1") for c in ("red", "green", "blue")]
        header += [f"property uchar {c}" for c in ("red", "green", "blue")]
    rows = np.zeros(len(scan.points), fields)
    for k, axis in enumerate("xyz"):
        rows[axis] = scan.points[:, k]
    if scan.colors is not None:
        for k, c in enumerate(("red", "green", "blue")):
            rows[c] = scan.colors[:, k]
    if scan.faces is not None:
        header += [f"element face {len(scan.faces)}", "property list uchar int vertex_indices"]
    with open(path, "wb") as out:
        out.write(("\n".join(header + ["end_header"]) + "\n").encode("ascii"))
        rows.tofile(out)
        if scan.faces is not None:
            faces = np.zeros(len(scan.faces), [("n", "u1"), ("i", "<i4", 3)])
            faces["n"], faces["i"] = 3, scan.faces
            faces.tofile(out)


def write_pcd(path, scan):
    """Binary PCD of the points alone."""
    count = len(scan.points)
    header = ("# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
              f"WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n")
    with open(path, "wb") as out:
        out.write(header.encode("ascii"))
        scan.points.astype("<f4").tofile(out)


def write_xyz(path, scan):
    """A row of three coordinates for each point."""
    np.savetxt(path, scan.points, fmt="%.5f")


def write_truth(path, room, scan):
    """JSON of what the scan hides: T_scan_map, walls as planes in map, furniture with its bounds in map."""
    bounds = lambda actor: np.array([r.origin + a * r.s1 * r.e1 + b * r.s2 * r.e2 for part in actor.parts
                                     for r in rectangles_of(part) for a in (0, 1) for b in (0, 1)])
    furniture = []
    for actor in room.furniture:
        corners = bounds(actor)
        furniture.append({"name": actor.name, "tag": actor.tag, "low_m": corners.min(axis=0).tolist(),
                          "high_m": corners.max(axis=0).tolist()})
    with open(path, "w", encoding="utf-8") as out:
        json.dump({"room": room.name, "height_m": room.height_m, "T_scan_map": scan.T_scan_map.tolist(),
                   "walls": [{"name": w.name, "normal": w.normal.tolist(), "offset_m": w.offset_m,
                              "length_m": w.length_m} for w in room.walls()],
                   "furniture": furniture}, out, indent=1)
