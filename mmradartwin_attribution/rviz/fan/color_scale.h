#pragma once

#include <cstdint>
#include <vector>

namespace mmradartwin {

struct Rgb {
  std::uint8_t r = 0, g = 0, b = 0;
};

/// Relative luminance of WCAG 2, 0 (black) to 1 (white).
double luminance(Rgb color);
/// Contrast ratio of WCAG 2, 1 to 21.
double contrast(Rgb a, Rgb b);

/// The first three are for levels and grow lighter from end to end; the last is for differences, white in the middle.
/// People who confuse red with green, or blue with yellow, can read each of them.
enum class ColorMap { kViridis, kCividis, kMagma, kBlueWhiteRed };

/// From lowest to highest: 256 colours, or 255 where there is a middle.
const std::vector<Rgb>& colorsOf(ColorMap map);

/// Levels as colours. What lies beyond an end has its colour.
struct ColorScale {
  ColorMap map = ColorMap::kViridis;
  double low_db = -40, high_db = 0;
  Rgb color(double level_db) const;
};

// Boxes are a bright line in a dark rim, so that one of the two stands out on every colour.
constexpr Rgb kBoxRim{0, 0, 0};
constexpr Rgb kMatchedBox{255, 255, 255}, kMismatchBox{255, 140, 255};
constexpr Rgb kBackground{24, 26, 30};  ///< of rviz in the layouts, and of the panels
constexpr Rgb kNoData{56, 56, 56};
constexpr Rgb kLabel{240, 240, 240}, kGrid{158, 158, 158};

}  // namespace mmradartwin
