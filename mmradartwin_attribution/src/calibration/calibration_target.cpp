#include "mmradartwin_attribution/calibration_target.h"

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

CalibrationTarget wallTarget(const Scene& scene, const std::string& actor) {
  const int index = scene.actorIndex(actor);
  if (index < 0) {
    std::string known;
    for (const Actor& a : scene.actors) known += (known.empty() ? "" : ", ") + a.name;
    throw InputError(scene.file + ": has no actor '" + actor + "'; it has " + known);
  }
  CalibrationTarget target;
  target.name = actor;
  for (int id : scene.actors[static_cast<std::size_t>(index)].facets) {
    if (scene.facets[static_cast<std::size_t>(id)].reflects)
      target.wall.push_back(scene.facets[static_cast<std::size_t>(id)]);
  }
  if (target.wall.empty())
    throw InputError(scene.file + ": actor '" + actor + "' has no upright surface to calibrate on");
  return target;
}

}  // namespace mmradartwin
