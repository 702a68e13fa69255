"""The furnished office of the tests: 8 x 6 x 2.8 m, every object a named actor with one of the seven tags.

Boxes stand at least 1 cm apart from each other and from the walls, so no two actors share a face. The walls share their
vertical edges (concave corners), and so do the two sheets of the partition, which is seen from both sides.
"""
import dataclasses
import math

import numpy as np

from mmradartwin_tests.geometry import Actor, Room, box, sheet

LENGTH_M, WIDTH_M, HEIGHT_M = 8.0, 6.0, 2.8
EPSILON_0 = 8.8541878128e-12


@dataclasses.dataclass
class Material:
    """Surface constants at 77 GHz. conductor: perfect, the other constants mean nothing."""
    permittivity: float = 1.0
    conductivity: float = 0.0
    scattering: float = 0.0
    conductor: bool = False
    roughness_rms_m: float = 0.0
    extrapolated: bool = False
    color: tuple = (0.6, 0.6, 0.6)

    def complex_permittivity(self, frequency_hz):
        """eps' - j sigma/(omega eps0), for exp(+j omega t)."""
        return self.permittivity - 1j * self.conductivity / (2 * math.pi * frequency_hz * EPSILON_0)


# ITU-R P.2040 (concrete, wood, glass, chipboard, acrylic, carpet) evaluated at 77 GHz.
MATERIALS = {
    "Metal": Material(conductor=True, color=(0.55, 0.60, 0.68)),
    "Concrete": Material(5.24, 1.38, scattering=0.5, color=(0.70, 0.69, 0.66)),
    "Wood": Material(1.99, 0.494, color=(0.62, 0.43, 0.24)),
    "TableTop": Material(2.58, 0.643, color=(0.80, 0.68, 0.50)),
    "Carpet": Material(2.08, 0.0317, scattering=0.4, extrapolated=True, color=(0.38, 0.42, 0.55)),
    "Glass": Material(6.31, 1.211, color=(0.55, 0.80, 0.88)),
    "Plastic": Material(2.57, 0.490, color=(0.85, 0.85, 0.80)),
}


def build_actors():
    """All actors of the office, in map."""
    lx, ly, lz = LENGTH_M, WIDTH_M, HEIGHT_M
    actors = [
        Actor("floor", "Concrete", [sheet((0, 0, 0), (lx, 0, 0), (0, ly, 0))], shell=True),
        Actor("ceiling", "Concrete", [sheet((0, 0, lz), (0, ly, 0), (lx, 0, 0))], shell=True),
        Actor("wall_south", "Concrete", [sheet((0, 0, 0), (0, 0, lz), (lx, 0, 0))], shell=True),
        Actor("wall_north", "Concrete", [sheet((0, ly, 0), (lx, 0, 0), (0, 0, lz))], shell=True),
        Actor("wall_west", "Concrete", [sheet((0, 0, 0), (0, ly, 0), (0, 0, lz))], shell=True),
        Actor("wall_east", "Wood", [sheet((lx, 0, 0), (0, 0, lz), (0, ly, 0))], shell=True),
    ]

    def add(name, tag, *parts):
        actors.append(Actor(name, tag, list(parts)))

    add("window", "Glass", box((3.75, 0.035, 1.55), (2.5, 0.03, 1.3)))
    add("radiator", "Metal", box((3.75, 0.10, 0.42), (1.6, 0.12, 0.60)))
    add("door", "Wood", box((0.045, 4.75, 1.06), (0.05, 0.95, 2.10)))
    add("whiteboard", "Metal", box((2.4, 5.965, 1.5), (2.0, 0.03, 1.2)))
    add("tv", "Glass", box((0.10, 2.95, 1.35), (0.06, 1.25, 0.72), 2.0))
    add("cabinet_north", "Metal", box((5.55, 5.74, 0.96), (0.92, 0.44, 1.90)))
    add("cabinet_east", "Metal", box((7.28, 0.92, 0.66), (0.80, 0.45, 1.30), 117.0))
    add("wardrobe", "Wood", box((0.50, 1.35, 0.92), (0.42, 0.98, 1.80), 4.0))
    add("bookshelf", "Wood", box((7.80, 3.95, 1.01), (0.32, 1.20, 2.00)))
    add("shelf", "Wood", box((7.84, 2.30, 1.515), (0.28, 1.10, 0.03)))
    add("pillar", "Concrete", box((4.35, 3.55, 1.40), (0.40, 0.40, 2.76), 12.0))
    add("sofa", "Carpet",
        box((1.90, 0.82, 0.23), (1.70, 0.75, 0.42), 6.0),
        box((1.95, 0.33, 0.53), (1.70, 0.18, 0.98), 6.0))
    add("carpet", "Carpet", box((4.6, 2.2, 0.015), (3.0, 1.8, 0.01), 3.0))
    add("partition", "Carpet",
        sheet((2.35, 3.15, 0.02), (1.2, 0, 0), (0, 0, 1.5)),
        sheet((2.35, 3.15, 0.02), (0, 1.4, 0), (0, 0, 1.5)))
    add("bin", "Plastic", box((6.35, 2.55, 0.32), (0.32, 0.30, 0.60), 33.0))

    def desk(name, x, y, yaw_deg):
        turn = box((0, 0, 0), (1, 1, 1), yaw_deg).rotation
        place = lambda dx, dy, z: np.array([x, y, z]) + turn @ np.array([dx, dy, 0.0])
        add(f"{name}_top", "TableTop", box(place(0, 0, 0.735), (1.6, 0.8, 0.03), yaw_deg))
        add(f"{name}_legs", "Metal",
            box(place(-0.74, 0, 0.355), (0.04, 0.66, 0.69), yaw_deg),
            box(place(0.74, 0, 0.355), (0.04, 0.66, 0.69), yaw_deg))
        add(f"{name}_panel", "Wood", box(place(0, 0.34, 0.44), (1.40, 0.02, 0.50), yaw_deg))
        return place

    place = desk("desk_west", 1.35, 4.65, 8.0)
    add("monitor_west", "Glass", box(place(-0.1, 0.15, 1.00), (0.60, 0.05, 0.36), 23.0))
    place = desk("desk_east", 6.60, 4.05, -76.0)
    add("monitor_east", "Glass", box(place(0.25, 0.12, 0.99), (0.55, 0.05, 0.34), -67.0))
    add("printer", "Plastic", box(place(-0.45, 0.0, 0.93), (0.44, 0.42, 0.34), -81.0))
    return actors


def build_room(actors=None, materials=None):
    """The office as a Room."""
    return Room(build_actors() if actors is None else actors, dict(MATERIALS if materials is None else materials))


def write_obj(actors, path):
    """OBJ with one object per actor and its tag as material name; faces are triangles."""
    base = 1
    with open(path, "w", encoding="ascii") as out:
        out.write("# metres, z up, map frame; object = actor, material name = tag\n")
        for actor in actors:
            out.write(f"o {actor.name}\nusemtl {actor.tag}\n")
            vertices, index, faces = [], {}, []
            for part in actor.parts:
                for r in part.rectangles():
                    corners = [r.origin, r.origin + r.s1 * r.e1, r.origin + r.s1 * r.e1 + r.s2 * r.e2,
                               r.origin + r.s2 * r.e2]
                    ids = []
                    for c in corners:
                        key = tuple(f"{v + 0.0:.7f}" for v in c)
                        if key not in index:
                            index[key] = len(vertices)
                            vertices.append(key)
                        ids.append(index[key])
                    faces += [(ids[0], ids[1], ids[2]), (ids[0], ids[2], ids[3])]
            for v in vertices:
                out.write("v " + " ".join(v) + "\n")
            for f in faces:
                out.write("f " + " ".join(str(base + i) for i in f) + "\n")
            base += len(vertices)


def materials_yaml(materials=None):
    """Text of materials.yaml, physical constants at 77 GHz."""
    lines = ["# ITU-R P.2040 evaluated at 77 GHz; Carpet and Plastic lie outside the recommendation's range or list.",
             "materials:"]
    for tag, m in (materials or MATERIALS).items():
        color = "[" + ", ".join(f"{c:.2f}" for c in m.color) + "]"
        if m.conductor:
            lines.append(f"  {tag}: {{model: conductor, color: {color}}}")
            continue
        extra = f", scattering_coefficient: {m.scattering:g}" if m.scattering else ""
        extra += f", roughness_rms_m: {m.roughness_rms_m:g}" if m.roughness_rms_m else ""
        extra += ", extrapolated: true" if m.extrapolated else ""
        lines.append(f"  {tag}: {{model: dielectric, relative_permittivity: {m.permittivity:g}, "
                     f"conductivity_s_per_m: {m.conductivity:g}{extra}, color: {color}}}")
    return "\n".join(lines) + "\n"


SCENE_YAML = """meshes:
  - {file: office.obj, xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0], scale: 1.0}
materials: materials.yaml
"""


def write_scene(directory, actors=None, materials=None):
    """Writes office.obj, scene.yaml and materials.yaml into an existing directory."""
    write_obj(build_actors() if actors is None else actors, f"{directory}/office.obj")
    with open(f"{directory}/scene.yaml", "w", encoding="ascii") as out:
        out.write(SCENE_YAML)
    with open(f"{directory}/materials.yaml", "w", encoding="ascii") as out:
        out.write(materials_yaml(materials))
