"""The office: free gaps, tags, and the shipped scene."""
import os
import tempfile
import unittest

import numpy as np

from mmradartwin_tests import office
from mmradartwin_tests.geometry import Box

TAGS = {"Metal", "Concrete", "Wood", "TableTop", "Carpet", "Glass", "Plastic"}
SHIPPED = os.path.join(os.path.dirname(os.path.realpath(__file__)), "..", "..", "config", "office")


def surface_points(part, count=9):
    """Points all over a part's faces, [P, 3]."""
    u, v = (g.reshape(-1, 1) for g in np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count)))
    return np.concatenate([r.origin + u * r.s1 * r.e1 + v * r.s2 * r.e2 for r in part.rectangles()])


class Office(unittest.TestCase):
    def test_tags_and_names(self):
        actors = office.build_actors()
        self.assertEqual({a.tag for a in actors}, TAGS)
        self.assertEqual(len({a.name for a in actors}), len(actors))
        self.assertTrue(any(not np.allclose(np.abs(p.rotation), np.eye(3)) for a in actors for p in a.parts
                            if isinstance(p, Box)))

    def test_things_stand_a_centimetre_apart(self):
        parts = [(a.name, p) for a in office.build_actors() for p in a.parts if not a.shell]
        low, high = np.zeros(3), np.array([office.LENGTH_M, office.WIDTH_M, office.HEIGHT_M])
        for i, (name, part) in enumerate(parts):
            points = surface_points(part)
            self.assertGreaterEqual(min((points - low).min(), (high - points).min()), 0.0099, msg=name)
            for j, (other_name, other) in enumerate(parts):
                if i != j and {name, other_name} != {"partition"}:
                    nearest = min(other.distance(p) for p in points)
                    self.assertGreaterEqual(nearest, 0.0099, msg=f"{name}, {other_name}")

    @unittest.skipUnless(os.path.isdir(SHIPPED), "config/office is not beside this package")
    def test_shipped_scene_is_this_office(self):
        with tempfile.TemporaryDirectory() as directory:
            office.write_scene(directory)
            for name in ("office.obj", "scene.yaml", "materials.yaml"):
                with open(os.path.join(directory, name), encoding="ascii") as ours, \
                        open(os.path.join(SHIPPED, name), encoding="ascii") as shipped:
                    self.assertEqual(ours.read(), shipped.read(),
                                     msg=f"{name}: run make_office.py --output config/office")

    def test_obj_holds_every_actor_with_its_tag(self):
        with tempfile.TemporaryDirectory() as directory:
            office.write_scene(directory)
            with open(os.path.join(directory, "office.obj"), encoding="ascii") as file:
                lines = file.read().split("\n")
        found = [(a[2:], b[7:]) for a, b in zip(lines, lines[1:]) if a.startswith("o ")]
        self.assertEqual(found, [(a.name, a.tag) for a in office.build_actors()])
        vertices = np.array([[float(v) for v in line[2:].split()] for line in lines if line.startswith("v ")])
        np.testing.assert_allclose(vertices.min(axis=0), [0, 0, 0], atol=1e-9)
        np.testing.assert_allclose(vertices.max(axis=0), [8, 6, 2.8], atol=1e-9)
        count = sum(line.startswith("f ") for line in lines)
        self.assertEqual(count, 2 * len(office.build_room().s1))


if __name__ == "__main__":
    unittest.main()
