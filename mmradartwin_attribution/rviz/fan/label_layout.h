#pragma once

#include <vector>

namespace mmradartwin {

/// In pixels.
struct LabelBox {
  double x = 0, y = 0, width = 0, height = 0;  ///< upper left corner and size
  bool overlaps(const LabelBox& other) const;
  bool within(const LabelBox& other) const;
};

/// A label of a size for a place, which it stands at the lower edge of if it can.
struct LabelWish {
  double x = 0, y = 0;
  double width = 0, height = 0;
};

/// A box for each label, in their order: the one nearest to its place that lies within `bounds` and leaves `gap` pixels
/// to all before it and to `taken`. Where there is none the label has no size.
std::vector<LabelBox> placeLabels(const std::vector<LabelWish>& wishes, const LabelBox& bounds, double gap,
                                  const std::vector<LabelBox>& taken = {});

}  // namespace mmradartwin
