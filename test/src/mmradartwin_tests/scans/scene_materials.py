"""Materials that a person who knows the room would give the actors of a scene made of a scan."""
import numpy as np

from mmradartwin_tests.scans.known_room import rectangles_of

NEAR_M = 0.10        # a point stands for the surface that is so near
POINTS = 400         # of each made actor, spread over its area


def spread_points(triangles, rng):
    """[POINTS, 3] places on triangles [T, 3, 3], even over their area."""
    a, ab, ac = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    area = np.linalg.norm(np.cross(ab, ac), axis=1)
    which = rng.choice(len(triangles), POINTS, p=area / area.sum())
    u, v = rng.random((2, POINTS))
    over = u + v > 1
    u[over], v[over] = 1 - u[over], 1 - v[over]
    return a[which] + u[:, None] * ab[which] + v[:, None] * ac[which]


def distances(actor, points):
    """[P] distance of places to the surface of a known actor, m."""
    best = np.full(len(points), np.inf)
    for r in (r for part in actor.parts for r in rectangles_of(part)):
        d = points - r.origin
        a, b = np.clip(d @ r.e1, 0, r.s1), np.clip(d @ r.e2, 0, r.s2)
        best = np.minimum(best, np.linalg.norm(d - a[:, None] * r.e1 - b[:, None] * r.e2, axis=1))
    return best


def true_tags(room, objects, T_map_room):
    """{made actor: material of the known actor that most of its surface lies at}; an actor of which less than half lies at
    any is left out. objects: {made actor: [T, 3, 3] triangles in map}."""
    rng, back, known, tags = np.random.default_rng(0), np.linalg.inv(T_map_room), room.actors(), {}
    for name, triangles in objects.items():
        points = spread_points(triangles, rng) @ back[:3, :3].T + back[:3, 3]
        distance = np.array([distances(actor, points) for actor in known])
        nearest = np.where(distance.min(axis=0) < NEAR_M, distance.argmin(axis=0), -1)
        counts = np.bincount(nearest + 1, minlength=len(known) + 1)[1:]
        if 2 * counts.max() > POINTS:
            tags[name] = known[int(counts.argmax())].tag
    return tags
