"""Effects of what surfaces are made of."""
import dataclasses

import numpy as np

from mmradartwin_tests.effects.effect import Effect, effect


def check_material(name, materials):
    """ValueError for a tag that is not in the table."""
    if name not in materials:
        raise ValueError(f"no material '{name}'; materials: {', '.join(materials)}")


@effect
class MaterialReflectivity(Effect):
    """A material's or an actor's echo stronger or weaker at all ranges, once per interaction."""
    name, main, rank = "material_reflectivity", "delta_db", 0
    defaults = {"material": None, "actor": None, "delta_db": -6.0}
    plain = {"material": "Concrete", "delta_db": -12.0}

    def prepare(self, measurement):
        if self.p["material"] is None and self.p["actor"] is None:
            self.p["material"] = str(measurement.rng(120).choice(["Concrete", "Metal", "Glass", "Wood"]))
        if self.p["material"] is not None:
            check_material(self.p["material"], measurement.described_materials)
        else:
            measurement.described_room.actor_index(self.p["actor"])

    def echoes(self, measurement, station, echoes):
        hit = np.array([a.tag == self.p["material"] or a.name == self.p["actor"] for a in measurement.room.actors])
        step = 10**(self.p["delta_db"] / 20)
        if len(echoes.paths):
            gain = np.array([step**sum(hit[a] for a in p.actors) for p in echoes.paths])
            echoes.coefficients = echoes.coefficients * gain
        echoes.scatter_coefficients = echoes.scatter_coefficients * np.where(hit[echoes.scatter.actor], step, 1.0)

    def truth(self, measurement):
        return {key: value for key, value in self.p.items() if value is not None}


@effect
class SurfaceRoughness(Effect):
    """Specular loss by roughness."""
    name, main = "surface_roughness", "roughness_rms_m"
    defaults = {"material": "Concrete", "roughness_rms_m": 3e-4}

    def room(self, measurement, actors, materials):
        check_material(self.p["material"], materials)
        rough = dataclasses.replace(materials[self.p["material"]], roughness_rms_m=self.p["roughness_rms_m"])
        return actors, {**materials, self.p["material"]: rough}


@effect
class DiffuseScattering(Effect):
    """Surfaces scatter though the twin has them smooth."""
    name, main = "diffuse_scattering", "scattering_coefficient"
    defaults = {"material": "Wood", "scattering_coefficient": 0.5}

    def room(self, measurement, actors, materials):
        check_material(self.p["material"], materials)
        rough = dataclasses.replace(materials[self.p["material"]], scattering=self.p["scattering_coefficient"])
        return actors, {**materials, self.p["material"]: rough}
