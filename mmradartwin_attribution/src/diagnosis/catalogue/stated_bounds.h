#pragma once

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/stated_accuracy.h"

namespace mmradartwin::diagnosis::catalogue {

/// Bounds that follow from the accuracy of the scene, which the user states.
class StatedBounds {
 public:
  explicit StatedBounds(const StatedAccuracy& accuracy = {}) : scene_m_(accuracy.scene_m) {}

  /// Largest range error of an actor that is still an error and no move: of some twenty actors none is farther off than
  /// four standard deviations.
  double mostRangeError_m() const { return 4 * scene_m_; }
  /// A smaller move is no likely cause and adapts to much that is another's; see
  /// docs/verification/calibration_of_bounds.md#least-move.
  double leastMove_m() const { return 3 * scene_m_; }
  /// A move beyond this is far away: no actor's error explains it; see
  /// docs/verification/calibration_of_bounds.md#far-away.
  double farAway_m() const { return 6 * scene_m_; }
  /// Offset that the errors of sixteen actors make together.
  double commonOffset_m() const { return scene_m_ / 4; }
  /// An offset of radar or scene beyond this is no sum of the actors' errors; see
  /// docs/verification/calibration_of_bounds.md#sure-offset.
  double sureOffset_m() const { return 1.75 * scene_m_; }

 private:
  double scene_m_;
};

}  // namespace mmradartwin::diagnosis::catalogue
