"""Hidden effects: what a measured session may hold that its description does not say. Names and units follow causes.md."""
from mmradartwin_tests.effects.effect import Effect, EFFECTS, make_effect

__all__ = ["Effect", "EFFECTS", "make_effect"]
