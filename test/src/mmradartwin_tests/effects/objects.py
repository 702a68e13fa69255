"""Effects of what stands in the room."""
import math

import numpy as np

from mmradartwin_tests.campaign import rotation_from_vector
from mmradartwin_tests.coefficients import aperture_axis, fresnel
from mmradartwin_tests.effects.effect import Effect, effect
from mmradartwin_tests.geometry import Actor, Cylinder, box
from mmradartwin_tests.tracing import Path

FURNITURE = ["cabinet_north", "cabinet_east", "wardrobe", "bookshelf", "pillar"]
MOVABLE = FURNITURE + ["tv", "whiteboard", "monitor_east"]


def free_spot(measurement, margin_m, stream, taken=()):
    """A place on the floor clear of furniture, of all radars and by 1 m of `taken`, and faced by many poses."""
    rng = measurement.rng(stream)
    best, best_count = None, -1
    for _ in range(4000):
        p = np.array([rng.uniform(0.8, 7.2), rng.uniform(0.8, 5.2), 1.0])
        distance = [np.hypot(*(s.true.position - p)[:2]) for s in measurement.stations]
        room = measurement.described_room
        if min(distance) < margin_m + 0.3 or room.inside(p) or room.clearance(p) < margin_m:
            continue
        if any(math.dist(p[:2], other) < 1 for other in taken):
            continue
        seen = 0
        for s in measurement.stations:
            ray = p - s.true.position
            level = np.array([ray[0], ray[1], 0.0]) / np.hypot(ray[0], ray[1])
            seen += bool(s.true.sees(level)[0]) and bool(room.visible(s.true.position, p)[0])
        if seen > best_count:
            best, best_count = p, seen
        if best_count > 0.35 * len(measurement.stations):
            break
    if best is None:
        raise ValueError("no free place for another object; choose x_m and y_m")
    return float(best[0]), float(best[1])


def cylinder_path(measurement, station, actor_index, cylinder, material, event):
    """First-order echo of an upright cylinder, or None.

    Image level times sqrt(r / (r + R)) for the curvature across and the Fresnel aperture of its height.
    """
    p, wavelength = station.true.position, measurement.radar.wavelength_m
    ray = cylinder.center[:2] - p[:2]
    axis = np.hypot(*ray)
    distance = axis - cylinder.radius
    top, bottom = cylinder.center[2] + cylinder.height / 2, cylinder.center[2] - cylinder.height / 2
    height = min(max(p[2], bottom + 0.01), top - 0.01)
    point = np.array([*(p[:2] + ray / axis * distance), height])
    direction = (point - p) / np.linalg.norm(point - p)
    if distance <= 0 or not station.true.sees(direction)[0]:
        return None
    if not measurement.room.visible(p, point - 1e-3 * direction)[0]:
        return None
    factor = aperture_axis(bottom - p[2], top - p[2], distance, distance, wavelength)
    if abs(factor) < 0.01:
        return None
    te, _ = fresnel(material, 1.0, measurement.radar.center_hz)
    curvature = math.sqrt(cylinder.radius / (cylinder.radius + distance))
    level = te * factor * curvature * wavelength / (8 * math.pi * distance)
    lengths = measurement.tracer.point_lengths(station.true, point[None])[0]
    return Path(event, (-1,), (actor_index,), point[None], direction, direction, float(2 * np.linalg.norm(point - p)),
                complex(level), lengths, (1.0,))


@effect
class ActorUnmodelled(Effect):
    """An object in the room that the scene lacks: an upright cylinder (size_m: diameter) or a turned box (side)."""
    name, rank = "actor_unmodelled", 0
    main = "size_m"
    defaults = {"x_m": None, "y_m": None, "size_m": 0.3, "shape": "cylinder", "material": "Metal", "height_m": 1.7,
                "yaw_deg": None}

    def prepare(self, measurement):
        if self.p["shape"] not in ("cylinder", "box"):
            raise ValueError(f"actor_unmodelled: shape {self.p['shape']}; cylinder or box")
        objects = [e for e in measurement.settings.effects if e.name == self.name]
        before = objects[:objects.index(self)]
        self.actor = f"object_{len(before)}"
        if self.p["x_m"] is None or self.p["y_m"] is None:
            taken = [(e.p["x_m"], e.p["y_m"]) for e in before]
            self.p["x_m"], self.p["y_m"] = free_spot(measurement, 0.25 + self.p["size_m"] / 2, 130, taken)
        if self.p["yaw_deg"] is None:
            self.p["yaw_deg"] = (360 * measurement.rng(131).random() + 31 * len(before)) % 360

    def room(self, measurement, actors, materials):
        center = (self.p["x_m"], self.p["y_m"], 0.01 + self.p["height_m"] / 2)
        if self.p["shape"] == "box":
            part = box(center, (self.p["size_m"], self.p["size_m"], self.p["height_m"]), self.p["yaw_deg"])
        else:
            part = Cylinder(np.array(center), self.p["size_m"] / 2, self.p["height_m"])
        return actors + [Actor(self.actor, self.p["material"], [part])], materials

    def echoes(self, measurement, station, echoes):
        if self.p["shape"] == "cylinder":
            index = measurement.room.actor_index(self.actor)
            part = measurement.room.actors[index].parts[0]
            path = cylinder_path(measurement, station, index, part, measurement.room.material[index], "specular")
            echoes.add([path] if path else [])

    def truth(self, measurement):
        told = ("x_m", "y_m", "size_m") + (("shape", "yaw_deg") if self.p["shape"] == "box" else ())
        return {key: self.p[key] for key in told}


@effect
class ActorAbsent(Effect):
    """In the twin, not in the room."""
    name = "actor_absent"
    defaults = {"actor": None}

    def prepare(self, measurement):
        self.p["actor"] = self.p["actor"] or str(measurement.rng(132).choice(MOVABLE))
        measurement.described_room.actor_index(self.p["actor"])

    def room(self, measurement, actors, materials):
        return [a for a in actors if a.name != self.p["actor"]], materials


@effect
class ActorMoved(Effect):
    """In both, elsewhere: true minus twin, turned about its centroid: roll about x, then pitch about y, then yaw."""
    name = "actor_moved"
    defaults = {"actor": None, "dx_m": None, "dy_m": None, "dyaw_deg": 0.0, "dz_m": 0.0,
                "dpitch_deg": 0.0, "droll_deg": 0.0, "distance_m": 0.15}
    plain = {"distance_m": 0.4}
    main = "distance_m"

    def prepare(self, measurement):
        rng = measurement.rng(133)
        self.p["actor"] = self.p["actor"] or str(rng.choice(FURNITURE))
        actor = measurement.described_actors[measurement.described_room.actor_index(self.p["actor"])]
        if self.p["dx_m"] is None or self.p["dy_m"] is None:
            # Into the room, so that it does not run into its wall.
            inward = np.array([4.0, 3.0]) - actor.centroid()[:2]
            angle = math.atan2(inward[1], inward[0]) + rng.uniform(-0.3, 0.3)
            self.p["dx_m"] = self.p["distance_m"] * math.cos(angle)
            self.p["dy_m"] = self.p["distance_m"] * math.sin(angle)

    def room(self, measurement, actors, materials):
        shift = np.array([self.p["dx_m"], self.p["dy_m"], self.p["dz_m"]])
        about = lambda key, axis: rotation_from_vector(math.radians(self.p[key]) * np.eye(3)[axis])
        turn = about("dyaw_deg", 2) @ about("dpitch_deg", 1) @ about("droll_deg", 0)
        return [a.moved(turn, shift, a.centroid()) if a.name == self.p["actor"] else a for a in actors], materials

    def truth(self, measurement):
        return {key: self.p[key] for key in ("actor", "dx_m", "dy_m", "dyaw_deg", "dz_m", "dpitch_deg", "droll_deg")}
