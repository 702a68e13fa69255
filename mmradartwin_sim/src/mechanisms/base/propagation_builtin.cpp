#include "mechanisms/base/propagation_builtin.h"

#include <set>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

void addPropagationMechanisms(MechanismRegistry& registry) {
  registry.add("actor_unmodelled", makeActorUnmodelled);
  registry.add("carrier_scale", makeCarrierScale);
  registry.add("corner_reflection", makeCornerReflection);
  registry.add("diffuse_scattering", makeDiffuseScattering);
  registry.add("edge_diffraction", makeEdgeDiffraction);
  registry.add("empirical_law", makeEmpiricalLaw);
  registry.add("empirical_echo", makeEmpiricalEcho);
  registry.add("echo_replica", makeEchoReplica);
  registry.add("excess_attenuation", makeExcessAttenuation);
  registry.add("floor_ceiling_multipath", makeFloorCeilingMultipath);
  registry.add("pose_time_lag", makePoseTimeLag);
  registry.add("radar_pitch_offset", makeRadarPitchOffset);
  registry.add("scene_registration", makeSceneRegistration);
  registry.add("surface_roughness", makeSurfaceRoughness);
  registry.add("transmission", makeTransmission);
  registry.add("wall_ghost", makeWallGhost);
}

std::vector<bool> requireMaterial(const Scene& scene, const std::string& mechanism, const std::string& material) {
  std::vector<bool> of(scene.actors.size(), false);
  bool any = false;
  std::set<std::string> tags;
  for (std::size_t i = 0; i < scene.actors.size(); ++i) {
    of[i] = scene.actors[i].material_tag == material;
    any = any || of[i];
    tags.insert(scene.actors[i].material_tag);
  }
  if (any) return of;
  std::string known;
  for (const std::string& tag : tags) known += (known.empty() ? "" : ", ") + tag;
  throw InputError("mechanism " + mechanism + ": key material: no actor of " + scene.file + " is of " + material +
                   "; its materials: " + known);
}

}  // namespace mmradartwin
