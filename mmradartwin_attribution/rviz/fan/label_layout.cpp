#include "label_layout.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {

bool LabelBox::overlaps(const LabelBox& other) const {
  return x < other.x + other.width && other.x < x + width && y < other.y + other.height && other.y < y + height;
}

bool LabelBox::within(const LabelBox& other) const {
  return x >= other.x && y >= other.y && x + width <= other.x + other.width && y + height <= other.y + other.height;
}

std::vector<LabelBox> placeLabels(const std::vector<LabelWish>& wishes, const LabelBox& bounds, double gap,
                                  const std::vector<LabelBox>& taken) {
  constexpr int kDirections = 16;
  std::vector<LabelBox> placed = taken;
  std::vector<LabelBox> result;
  for (const LabelWish& wish : wishes) {
    const auto free = [&](const LabelBox& box) {
      const LabelBox wide{box.x - gap, box.y - gap, box.width + 2 * gap, box.height + 2 * gap};
      return box.within(bounds) &&
             std::none_of(placed.begin(), placed.end(), [&](const LabelBox& p) { return wide.overlaps(p); });
    };
    LabelBox found;
    const double reach = std::hypot(bounds.width, bounds.height), step = std::max(wish.height / 2, 1.0);
    for (double away = wish.height; away < reach && found.width == 0; away += step) {
      for (int i = 0; i < kDirections; ++i) {
        // Above, then more and more to either side.
        const double angle = M_PI / 2 + (i % 2 ? 1 : -1) * ((i + 1) / 2) * 2 * M_PI / kDirections;
        const LabelBox box{wish.x + away * std::cos(angle) - wish.width / 2,
                           wish.y - away * std::sin(angle) - wish.height / 2, wish.width, wish.height};
        if (!free(box)) continue;
        found = box;
        break;
      }
    }
    if (found.width > 0) placed.push_back(found);
    result.push_back(found);
  }
  return result;
}

}  // namespace mmradartwin
