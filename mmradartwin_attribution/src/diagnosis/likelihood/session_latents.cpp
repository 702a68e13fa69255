#include "diagnosis/likelihood/session_latents.h"

#include <limits>

namespace mmradartwin::diagnosis::likelihood {

double& SessionLatents::global(int j) {
  const auto at = [j](int first) { return static_cast<std::size_t>(j - first); };
  const int ranges = kActors + static_cast<int>(actor_gain.size());
  if (j >= ranges) return actor_range_m[at(ranges)];
  if (j >= kActors) return actor_gain[at(kActors)];
  if (j >= kShape) return floor_shape[at(kShape)];
  double* const first[] = {&log_gain, &log_floor, &log_relative, &log_pose_sensitive, &log_range, &log_spread};
  return *first[j];
}

Limits limitsOf(int global, int errors, const LatentSpread& spread) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  // What stands outside the scene has its place by parameters of its own, and not by the scene's error.
  if (global == kActors + 2 * errors - 1) return {0, 0, spread.actor_range_m};
  if (global >= kActors + errors) {
    return {-spread.most_range_error_m, spread.most_range_error_m, spread.actor_range_m};
  }
  if (global >= kActors) return {-spread.most_gain_error, spread.most_gain_error, 0.5};
  if (global >= kShape) return {-8, 8, 1};
  switch (global) {
    case kRelative:  // below -11.5 single precision would not keep every matrix definite
      return {-11.5, -2, 2};
    case kPoseSensitive:
      return {-6, 6, 2};
    case kRange:
      return {-6, 4, 2};
    case kSpread:  // 0.05 to 4.3 dB
      return {-9, 0, 1};
    default:
      return {-kAny, kAny, 2};
  }
}

}  // namespace mmradartwin::diagnosis::likelihood
