"""Hidden effects: what a measured session may hold that its description does not say.

Those of the table EFFECTS bear the binding names, parameters and units of the catalogue of causes.
"""
# Importing a module enters its effects into the tables.
from mmradartwin_tests.effects import array, frames, mounting, objects  # noqa: F401
from mmradartwin_tests.effects import propagation, receiver, surfaces, uncatalogued  # noqa: F401
from mmradartwin_tests.effects.effect import BASE, EFFECTS, UNCATALOGUED, Effect, make_effect

__all__ = ["BASE", "Effect", "EFFECTS", "UNCATALOGUED", "make_effect"]
