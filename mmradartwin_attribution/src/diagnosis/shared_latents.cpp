#include "shared_latents.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_attribution/ledger.h"

namespace mmradartwin {
namespace {

constexpr double kSharedLatent = 3;  // standard deviations from none at which a common error is tried as a cause

}  // namespace

std::vector<Screened> sharedLatents(const Scene& scene, const Nuisance& n, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all) {
  // An error that all poses or all actors share is no error of theirs. The score test cannot see it: the latents hold
  // it.
  std::vector<Screened> screened;
  const auto add = [&](const char* name, std::vector<double> latents, double deviation, double unit) {
    latents.erase(std::remove(latents.begin(), latents.end(), 0.0), latents.end());  // nothing shows these
    if (latents.size() < 4) return;
    const double middle = quantile(latents, 0.5);
    const double z = middle / deviation * std::sqrt(static_cast<double>(latents.size()) * 2 / M_PI);  // of a median
    if (std::abs(z) < kSharedLatent) return;
    for (const Hypothesis& h : all) {
      if (h.mechanism.mechanism != name) continue;
      screened.push_back({h, 0.5 * z * z, {h.coordinates.front().scaled(middle * unit)}});
    }
  };
  add("radar_yaw_offset", n.yaw_rad, accuracy.heading_rad, 180 / M_PI);
  add("range_bias", n.actor_range_m, spread.actor_range_m, 1);
  // Levels of one material's actors, or of one actor, further off than such errors are: the same for them.
  for (const Hypothesis& h : all) {
    if (h.mechanism.mechanism != "material_reflectivity" || h.coordinates.size() != 1) continue;
    double sum = 0, count = 0;
    for (std::size_t a = 0; a < n.actor_gain.size(); ++a) {
      const Actor& actor = scene.actors[a];
      if ((actor.name != h.subject && actor.material_tag != h.subject) || n.actor_gain[a] == 0) continue;
      sum += n.actor_gain[a];
      ++count;
    }
    const double z = count > 0 ? sum / (spread.actor_gain * std::sqrt(count)) : 0;
    if (std::abs(z) < kSharedLatent) continue;
    const double delta_db = 10 / std::log(10.0) * sum / count;
    screened.push_back({h, 0.5 * z * z, {h.coordinates.front().scaled(delta_db)}});
  }
  return screened;
}

}  // namespace mmradartwin
