"""Hidden effects: what a measured session may hold that its description does not say. Names and units follow causes.md."""
from mmradartwin_tests.effects import array, frames, mounting, objects, propagation, receiver, surfaces, uncatalogued  # noqa: F401
from mmradartwin_tests.effects.effect import EFFECTS, UNCATALOGUED, Effect, make_effect

__all__ = ["Effect", "EFFECTS", "UNCATALOGUED", "make_effect"]
