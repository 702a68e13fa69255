"""What a session of the third world may hide: one cause of the catalogue at a strength that plainly shows."""
import math

import numpy as np

from mmradartwin_tests.third_world.rooms import footprint_distance
from mmradartwin_tests.third_world.surfaces import Box, visible

UNMODELLED_HEIGHT_M = 1.7


def signed(rng, low, high):
    """Uniform in size, either sign."""
    return float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def bulky(plan):
    """Pieces that stand on the floor, high enough to face the radar."""
    return [p for p in plan.pieces if p.box.size[2] > 1.0 and p.box.size[1] > 0.2]


def free_spot(rng, plan, margin_m, spots, least=1.0):
    """A place on the floor away from walls, pieces and radars, and within sight of many radars."""
    boxes = [p.box for p in plan.pieces]
    best, most = None, -1
    for _ in range(600):
        p = rng.uniform([margin_m + 0.25] * 2, plan.size_m[:2] - margin_m - 0.25)
        if any(footprint_distance(b, p)[0] < margin_m for b in boxes):
            continue
        distance = np.hypot(*(spots[:, :2] - p).T)
        if distance.min() < margin_m + 0.25:
            continue
        ends = np.stack([np.full(len(spots), p[0]), np.full(len(spots), p[1]), spots[:, 2]], axis=1)
        seen = int(np.sum(visible(boxes, spots, ends) & (distance < 5)))
        if seen > most:
            best, most = p, seen
    if best is None:
        raise ValueError("this room has no free place for another object")
    return best


def move_piece(rng, plan, spots):
    """(piece, dx, dy, dyaw) of a bulky piece that has room to move into the room."""
    order = sorted(bulky(plan), key=lambda p: (p.tag != "Metal", rng.random()))
    for piece in order:
        others = [p.box for p in plan.pieces if p is not piece]
        for _ in range(60):
            inward = plan.size_m[:2] / 2 - piece.box.center[:2]
            angle = math.atan2(inward[1], inward[0]) + rng.uniform(-0.7, 0.7)
            size = rng.uniform(0.2, 0.35)
            step = size * np.array([math.cos(angle), math.sin(angle), 0.0])
            turn = signed(rng, 0, 3)
            moved = Box(piece.box.center + step, piece.box.size, piece.box.yaw_rad + math.radians(turn))
            if footprint_distance(moved, spots).min() < 0.3:
                continue
            corners = moved.center[:2] + np.array([[a, b] for a in (-1, 1) for b in (-1, 1)]) * moved.size[:2] / 2 @ \
                moved.axes()[:2, :2]
            if any(footprint_distance(b, corners).min() < 0.03 for b in others) or corners.min() < 0.01 or (
                    corners > plan.size_m[:2] - 0.01).any():
                continue
            return piece.name, float(step[0]), float(step[1]), turn
    raise ValueError("no piece of this room can move")


def channel_errors(rng):
    """Phases and gains of usual scatter, relative to channel 0."""
    phase, gain = rng.uniform(11, 17) * rng.standard_normal(8), rng.uniform(0.5, 1.0) * rng.standard_normal(8)
    return {"phase_deg": [float(v) for v in phase - phase[0]], "gain_db": [float(v) for v in gain - gain[0]]}


def offset(rng, low, high):
    """A step on the floor in any direction."""
    angle, size = rng.uniform(0, 2 * math.pi), rng.uniform(low, high)
    return float(size * math.cos(angle)), float(size * math.sin(angle))


def drift(rng):
    """A step, or a rate that changes the level over the session by decibels."""
    if rng.random() < 0.5:
        return {"steps_db": [signed(rng, 3.5, 5)]}
    return {"db_per_hour": signed(rng, 5, 8) / 0.31}


def material(rng, plan):
    """A material that several actors have, weaker or stronger."""
    tags = [tag for tag, count in plan.tags().items() if count >= 2 and tag in ("Concrete", "Plaster", "Metal")]
    tag = str(rng.choice(tags or [max(plan.tags(), key=plan.tags().get)]))
    up = rng.random() < 0.3 and tag != "Metal"
    return {"material": tag, "delta_db": float(rng.uniform(6, 8) if up else rng.uniform(-13, -9))}


def unmodelled(rng, plan, spots):
    """An upright metal box."""
    size = float(rng.uniform(0.35, 0.5))
    x, y = free_spot(rng, plan, 0.2 + size / 2, spots)
    return {"x_m": float(x), "y_m": float(y), "size_m": size, "shape": "box", "yaw_deg": float(rng.uniform(0, 90))}


def absent(rng, plan, spots):
    """A bulky piece, of metal where there is one."""
    pieces = [p for p in bulky(plan) if p.tag == "Metal"] or bulky(plan)
    return {"actor": str(rng.choice([p.name for p in pieces]))}


def moved(rng, plan, spots):
    """A bulky piece elsewhere."""
    name, dx, dy, turn = move_piece(rng, plan, spots)
    return {"actor": name, "dx_m": dx, "dy_m": dy, "dyaw_deg": turn}


# {cause: parameters by (rng, plan, radar spots)}
CAUSES = {
    "radar_yaw_offset": lambda rng, plan, spots: {"yaw_deg": signed(rng, 2, 4)},
    "range_bias": lambda rng, plan, spots: {"range_m": float(rng.uniform(0.05, 0.10))},
    "excess_attenuation": lambda rng, plan, spots: {"db_per_m": float(rng.uniform(1.5, 2.5))},
    "element_pattern": lambda rng, plan, spots: {"cos_exponent": float(rng.uniform(1.8, 3.5))},
    "actor_unmodelled": unmodelled,
    "actor_moved": moved,
    "material_reflectivity": lambda rng, plan, spots: material(rng, plan),
    "tx_rx_leakage": lambda rng, plan, spots: {"range_m": float(rng.uniform(0.04, 0.12)),
                                               "level_db": float(rng.uniform(-3, 8))},
    "tx_imbalance": lambda rng, plan, spots: {"phase_deg": signed(rng, 25, 45), "gain_db": signed(rng, 1.0, 2.0)},
    "scene_registration": lambda rng, plan, spots: dict(zip(("x_m", "y_m", "yaw_deg"),
                                                            (*offset(rng, 0.07, 0.12), signed(rng, 0.4, 0.9)))),
    "if_highpass": lambda rng, plan, spots: {"corner_hz": float(rng.uniform(1.2e6, 2.2e6))},
    "actor_absent": absent,
    "range_scale": lambda rng, plan, spots: {"scale": signed(rng, 0.012, 0.02)},
    "channel_phase_error": lambda rng, plan, spots: channel_errors(rng),
    "radar_position_offset": lambda rng, plan, spots: dict(zip(("forward_m", "left_m"), offset(rng, 0.05, 0.09))),
    "gain_drift": lambda rng, plan, spots: drift(rng),
    "iq_imbalance": lambda rng, plan, spots: {"image_db": float(rng.uniform(-22, -17))},
    "carrier_scale": lambda rng, plan, spots: {"scale": signed(rng, 0.025, 0.04)},
    "dc_offset": lambda rng, plan, spots: {"level_db": float(rng.uniform(-10, 3))},
}
