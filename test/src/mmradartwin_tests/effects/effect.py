"""The interface of hidden effects and their table."""
import math

import numpy as np

BASE = {"specular": {"max_bounces": 3}, "corner": {}, "diffuse": {}}   # mechanisms of a twin without a twin.yaml
EFFECTS = {}        # of the catalogue, by the binding name
UNCATALOGUED = {}   # everything else


def effect(cls):
    """Class decorator: enters an effect into the table under its name."""
    EFFECTS[cls.name] = cls
    return cls


def uncatalogued(cls):
    """Class decorator of effects that the catalogue does not name."""
    UNCATALOGUED[cls.name] = cls
    return cls


class Effect:
    """One hidden effect. `defaults`: parameters with typical values; `main`: the one that a strength scales;
    `plain`: parameters for a session of few poses, where typical values do not show plainly.

    A session calls the stages in the order below; each returns its input unless the effect acts there. Effects of lower
    rank act first: 0 adds echoes, 1 is a law on all echoes, 2 acts on the received grid.
    """
    name = ""
    defaults = {}
    plain = {}
    main = None
    rank = 1

    def __init__(self, **parameters):
        unknown = set(parameters) - set(self.defaults)
        if unknown:
            raise ValueError(f"effect {self.name} has no parameter {', '.join(sorted(unknown))}; "
                             f"it has {', '.join(self.defaults)}")
        self.p = {**self.defaults, **parameters}

    def scale(self, strength):
        """Multiplies the main parameter; where that is a level in dB, the amplitude that it stands for."""
        if self.main is None:
            raise ValueError(f"effect {self.name} has no strength; it is there or not")
        value = self.p[self.main]
        if self.main in ("level_db", "image_db"):
            by_db = 20 * math.log10(strength) if strength > 0 else -math.inf
            self.p[self.main] = [v + by_db for v in value] if isinstance(value, list) else value + by_db
            return
        self.p[self.main] = [strength * v for v in value] if isinstance(value, list) else strength * value

    def radar(self, radar):
        """The radar as it truly is (what is described stays)."""
        return radar

    def described_mechanisms(self, measurement, mechanisms):
        """Mechanisms of the session's twin.yaml; None where it has no twin.yaml."""
        return mechanisms

    def prepare(self, measurement):
        """Draws what was not given, once per session, before anything is traced."""

    def room(self, measurement, actors, materials):
        """The true room's actors and materials."""
        return actors, materials

    def pose(self, measurement, station):
        """The radar's true pose."""
        return station.true

    def echoes(self, measurement, station, echoes):
        """Changes the echoes of one pose in place."""

    def auxiliary(self, measurement, station, echoes):
        """Whatever receive() needs of the finished echoes; found in measurement.auxiliary[name][index]."""
        return None

    def if_response(self, measurement, beat_hz):
        """Complex amplitude response of the IF chain at a beat frequency."""
        return np.ones_like(np.asarray(beat_hz, float))

    def receive(self, measurement, index, station, x):
        """The received grid [M, N] of one pose, in amplitude units."""
        return x

    def after_gain(self, measurement, grids):
        """Changes measurement.gain or noise_rms once all poses are known."""

    def frames(self, measurement, index, station, frames, rng):
        """Grids of all frames [F, M, N] before noise; read only, return a new array."""
        return frames

    def payload(self, measurement, index, station, payload, rng):
        """Bytes of the capture."""
        return payload

    def truth(self, measurement):
        """Parameters as a finding should name them."""
        return dict(self.p)

    def beside(self):
        """What simulating it needs beside these."""
        return {}


def make_effect(name, parameters=None, strength=None):
    """An effect by its name. ValueError with the known names for an unknown one."""
    table = {**EFFECTS, **UNCATALOGUED}
    if name not in table:
        raise ValueError(f"unknown effect '{name}'; known: {', '.join(sorted(table))}")
    made = table[name](**(parameters or {}))
    if strength is not None:
        made.scale(strength)
    return made
