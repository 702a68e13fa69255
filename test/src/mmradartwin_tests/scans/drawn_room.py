"""Rooms drawn by a seed, of shapes and sizes that `make_scene` was not written against: small, large, long, skewed, with
a cut corner, in an L, below a roof. Furniture is that of the third world, and chairs."""
import math

import numpy as np

from mmradartwin_tests.geometry import Actor, Box
from mmradartwin_tests.scans.known_room import SIDES, KnownRoom, chair, furniture_of, outline_distance, rectangle_outline
from mmradartwin_tests.third_world import rooms, surfaces

# Width, depth and height in metres, from and to; pieces that are tried; how many chairs.
SHAPES = {
    "small": ((2.5, 3.4), (2.5, 3.4), (2.4, 2.7), ("desk", "cabinet", "window", "door"), 1),
    "corridor": ((7.0, 14.0), (1.7, 2.4), (2.4, 3.0), ("locker", "door", "door", "radiator", "cabinet"), 0),
    "office_like": ((4.0, 7.0), (3.5, 5.5), (2.5, 3.2),
                    ("desk", "desk", "cabinet", "bookshelf", "whiteboard", "window", "table"), 3),
    "large": ((10.0, 15.0), (7.0, 10.0), (3.0, 4.0),
              ("pillar", "pillar", "partition", "table", "rack", "cabinet", "locker", "window", "door", "desk"), 4),
    "skewed": ((4.5, 7.0), (3.8, 5.5), (2.5, 3.0), ("table", "cabinet", "bookshelf", "sofa", "door"), 2),
    "cut_corner": ((4.5, 7.0), (4.0, 6.0), (2.5, 3.0), ("table", "wardrobe", "desk", "fridge", "whiteboard"), 2),
    "angle": ((6.0, 9.0), (5.0, 8.0), (2.4, 3.0), ("sofa", "table", "wardrobe", "fridge", "cabinet", "window"), 3),
    "attic": ((4.0, 6.5), (4.0, 5.5), (2.5, 2.9), ("desk", "cabinet", "bookshelf", "sofa"), 1),
}


def outline_of(shape, width_m, depth_m, rng):
    """(corners [n, 2], names of the walls) of a shape within a rectangle."""
    outline, names = rectangle_outline(width_m, depth_m), list(SIDES)
    if shape == "skewed":       # two corners go inwards along the south and the north wall
        outline[1, 0] -= rng.uniform(0.1, 0.2) * width_m
        outline[3, 0] += rng.uniform(0.0, 0.1) * width_m
    if shape == "cut_corner":
        along, across = rng.uniform(0.8, 1.8, 2)
        outline = np.array([[0, 0], [width_m, 0], [width_m, depth_m - across], [width_m - along, depth_m], [0, depth_m]])
        names = ["wall_south", "wall_east", "wall_cut", "wall_north", "wall_west"]
    if shape == "angle":
        x, y = rng.uniform(0.45, 0.65) * width_m, rng.uniform(0.45, 0.6) * depth_m
        outline = np.array([[0, 0], [width_m, 0], [width_m, y], [x, y], [x, depth_m], [0, depth_m]])
        names = ["wall_south", "wall_east", "wall_inner_north", "wall_inner_east", "wall_north", "wall_west"]
    return outline, names


def roof_over(width_m, height_m, rng):
    """A roof that rises from a low south wall to the ceiling: a solid of which its lower face is seen."""
    knee_m, rise = rng.uniform(0.9, 1.3), math.radians(rng.uniform(35, 50))
    along, out = np.array([0, math.cos(rise), math.sin(rise)]), np.array([0, -math.sin(rise), math.cos(rise)])
    length_m, thick_m = (height_m - knee_m) / math.sin(rise) + 0.4, 1.5
    middle = np.array([width_m / 2, 0, knee_m]) + (length_m / 2 - 0.2) * along + thick_m / 2 * out
    turn = np.stack([np.array([1.0, 0, 0]), along, out], axis=1)
    return Actor("roof", "Plaster", [Box(middle, np.array([width_m + 0.4, length_m, thick_m]), turn)])


def fits(solid, outline, slants):
    """Whether an upright box stands within the outline and below the roof."""
    turn = solid.axes().T
    corners = np.array([solid.center + turn @ (np.array([a, b, c]) * solid.size / 2)
                        for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    below = all(part.distance(p) > 0.08 for slant in slants for part in slant.parts for p in corners)
    # Walls may be skewed: what is thin shall stand at its wall, and what is deep may stand off.
    return below and (outline_distance(outline, corners[:, :2]) > 0.005).all()


def draw_room(shape, seed):
    """KnownRoom of a shape; the same for the same seed."""
    widths, depths, heights, wanted, chairs = SHAPES[shape]
    rng = np.random.default_rng([seed, 77, list(SHAPES).index(shape)])
    width_m, depth_m, height_m = rng.uniform(*widths), rng.uniform(*depths), rng.uniform(*heights)
    outline, names = outline_of(shape, width_m, depth_m, rng)
    slants = [roof_over(width_m, height_m, rng)] if shape == "attic" else []
    pieces, numbers = [], {}

    def add(name, tag, solid, legs):
        numbers[name] = numbers.get(name, 0) + 1
        pieces.append(rooms.Piece(f"{name}_{numbers[name]}", tag, solid, legs))

    for name in wanted:
        kind = rooms.PIECES[name]
        for _ in range(30):
            solid = rooms.place(rng, kind, np.array([width_m, depth_m, height_m]), [p.box for p in pieces])
            if solid is None:
                break
            if name == "pillar":
                solid = surfaces.Box(np.array([*solid.center[:2], height_m / 2]), np.array([*solid.size[:2], height_m - 0.02]),
                                     solid.yaw_rad)
            if fits(solid, outline, slants):
                add(name, kind.tag, solid, kind.legs)
                break
    furniture = furniture_of(pieces)
    for number in range(chairs):
        for _ in range(300):
            yaw = rng.uniform(-math.pi, math.pi)
            solid = surfaces.Box(np.array([*rng.uniform(0.4, [width_m - 0.4, depth_m - 0.4]), 0.47]),
                                 np.array([0.5, 0.55, 0.93]), yaw)
            if fits(solid, outline, slants) and not any(rooms.collide(solid, p.box, 0.12) for p in pieces):
                pieces.append(rooms.Piece(f"chair_{number + 1}", "Wood", solid, False))
                furniture.append(chair(f"chair_{number + 1}", *solid.center[:2], math.degrees(yaw)))
                break
    return KnownRoom(f"{shape}_{seed}", outline, height_m, names, ["Plaster"] * len(names), furniture, slants)
