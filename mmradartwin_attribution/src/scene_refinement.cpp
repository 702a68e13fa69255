#include "mmradartwin_attribution/scene_refinement.h"

#include <sstream>

#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {

std::string SceneRefinement::toYaml(const std::string& recording) const {
  std::ostringstream out;
  out << "# How much farther by the radar each actor's echoes come from than the scene has it (range_m, one way, with "
         "its\n"
      << "# standard deviation). Actors are left out of which the session says no more than the stated error does.\n"
      << "format: mmradartwin_refinement/1\n"
      << "recording: " << yamlText(recording) << "\n"
      << "scene_m: " << significantNumber(scene_m, 6) << "\n"
      << "poses: " << poses << "\n"
      << "locations: " << locations << "\n";
  const GainMetric& gain = held_out_nats_per_pose;
  if (gain.difference_ci95) {
    out << "# On locations that have no part in the ranges, with the interval of the difference over locations.\n"
        << "held_out_nats_per_pose: {before: " << fixedNumber(gain.before, 2)
        << ", after: " << fixedNumber(gain.after, 2) << ", difference_ci95: ["
        << fixedNumber((*gain.difference_ci95)[0], 2) << ", " << fixedNumber((*gain.difference_ci95)[1], 2) << "]}\n";
  }
  out << "actors:" << (actors.empty() ? " {}" : "") << "\n";
  for (const RefinedActor& actor : actors) {
    out << "  " << yamlText(actor.actor) << ": {range_m: " << fixedNumber(actor.range_m, 5)
        << ", std_m: " << fixedNumber(actor.std_m, 5);
    if (actor.shift) {
      const LevelShift& s = *actor.shift;
      out << ", shift_m: [" << fixedNumber(s.mean_m.x(), 5) << ", " << fixedNumber(s.mean_m.y(), 5)
          << "], shift_covariance_m2: [" << significantNumber(s.covariance_m2(0, 0), 4) << ", "
          << significantNumber(s.covariance_m2(0, 1), 4) << ", " << significantNumber(s.covariance_m2(1, 1), 4) << "]";
    }
    out << "}\n";
  }
  return out.str();
}

}  // namespace mmradartwin
