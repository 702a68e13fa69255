#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_dsp/ros/transform_record.h"

namespace mmradartwin {

/// Something missing or odd in a bag.
struct BagFinding {
  std::string what;         ///< with its unit: "frame(s) with lost bytes"
  std::uint64_t count = 0;  ///< of it
  std::string first;        ///< where it shows first; empty for what is missing as a whole
};

/// From where on something is odd.
struct BagLimits {
  double stamp_tolerance_s = 1e-3;  ///< of the step between two frames against sequence and frame period
  TransformLimits tf;               ///< beyond them a frame between two transforms has no pose
  double tf_silence_s = 0.5;        ///< without transforms, also where the radar stood still meanwhile
};

/// Looks for everything that would trouble whoever works with the bag later: no or several radar configurations, frames
/// of another one, gaps in their sequence, lost bytes, invalid chirps, stamps off the frame period, saturated samples,
/// receivers that are all zero, frames without a transform, within a jump or a gap of tf that leaves them without a
/// pose or that the radar stood through, jumps and gaps in tf at whose ends the radar stands elsewhere, no pose,
/// several radars. Where the bag holds several radars, all are looked at (or that of `options.ns`), and findings begin
/// with the namespace. Empty where all is well. Throws InputError for a file that is no readable bag. `progress` is
/// called with messages read, of how many.
std::vector<BagFinding> validateBag(const std::string& file, const BagOptions& options = {},
                                    const BagLimits& limits = {}, const PoseProgress& progress = {});

}  // namespace mmradartwin
