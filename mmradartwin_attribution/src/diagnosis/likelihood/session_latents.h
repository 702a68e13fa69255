#pragma once

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

/// Latent numbers of a session: levels and small errors that every hypothesis has beside its cause. They are fitted
/// along with each hypothesis. Powers are natural logarithms.
struct SessionLatents {
  double log_gain = 0;   ///< measured power over the twin's
  double log_floor = 0;  ///< clutter's power in a cell over PoseChannels::clutter
  /// Added to log_floor. A node per octave of range up to 1024 bins, as many as the samples need; linear between.
  std::array<double, 10> floor_shape{};
  double log_relative = -8;           ///< share of an echo's power that is independent between channels
  double log_pose_sensitive = 0;      ///< factor on the power of PoseEchoes::pose_sensitive
  double log_range = 0;               ///< factor on the variance of a path's own range
  double log_spread = -2.94;          ///< relative variance of the power of a path on its own, see CellLikelihood
  std::vector<double> actor_gain;     ///< [errors, see errorOf()] natural logarithm of power, per interaction
  std::vector<double> actor_range_m;  ///< [errors, see errorOf()] added one-way range, per interaction
  std::vector<double> yaw_rad;        ///< [poses] error of the heading

  /// Number j of those that all poses share ("globals"), in the order of Scores.
  double& global(int j);
  double global(int j) const { return const_cast<SessionLatents*>(this)->global(j); }
  int globals() const { return 6 + static_cast<int>(floor_shape.size() + actor_gain.size() + actor_range_m.size()); }
};

/// Prior standard deviations of the actors' latent errors.
struct LatentSpread {
  explicit LatentSpread(const StatedAccuracy& stated = {})
      : actor_gain(stated.level_db / 4.343),
        actor_range_m(stated.scene_m),
        most_gain_error(std::max(2.0, 4 * actor_gain)),
        most_range_error_m(StatedBounds(stated).mostRangeError_m()) {}

  double actor_gain;          ///< natural logarithm of power, per interaction
  double actor_range_m;       ///< one-way, per interaction
  double most_gain_error;     ///< limit of an actor's gain error
  double most_range_error_m;  ///< limit of an actor's range error
};

/// Indices of the globals in scores; kShape and kActors are the first of several.
enum Global {
  kGain,
  kFloor,
  kRelative,
  kPoseSensitive,
  kRange,
  kSpread,
  kShape,
  kActors = kShape + std::tuple_size_v<decltype(SessionLatents::floor_shape)>
};

/// Limits of a global, and the largest change in one step.
struct Limits {
  double low, high, step;
};
/// errors: see errorOf().
Limits limitsOf(int global, int errors, const LatentSpread& spread);

}  // namespace mmradartwin::diagnosis::likelihood
