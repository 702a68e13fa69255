#include "level_colors.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

std::uint32_t opaque(Rgb c) { return 0xff000000U | (std::uint32_t{c.r} << 16) | (std::uint32_t{c.g} << 8) | c.b; }

}  // namespace

LevelColors::LevelColors(const ColorScale& scale) : none_(opaque(kNoData)), low_(static_cast<float>(scale.low_db)) {
  for (Rgb c : colorsOf(scale.map)) colors_.push_back(opaque(c));
  last_ = static_cast<float>(colors_.size() - 1);
  step_ = last_ / static_cast<float>(scale.high_db - scale.low_db);
}

std::uint32_t LevelColors::argb(float level_db) const {
  if (std::isnan(level_db)) return none_;
  return colors_[static_cast<std::size_t>(std::clamp((level_db - low_) * step_ + 0.5F, 0.0F, last_))];
}

}  // namespace mmradartwin
