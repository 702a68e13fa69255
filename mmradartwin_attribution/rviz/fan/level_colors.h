#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "color_scale.h"

namespace mmradartwin {

/// A ColorScale as a table, 0xAARRGGBB of alpha 255.
class LevelColors {
 public:
  explicit LevelColors(const ColorScale& scale);
  /// kNoData where there is no level (NaN).
  std::uint32_t argb(float level_db) const;

 private:
  std::vector<std::uint32_t> colors_;
  std::uint32_t none_;
  float low_, step_, last_;
};

}  // namespace mmradartwin
