#include "color_scale.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace mmradartwin {
namespace {

double linear(std::uint8_t value) {
  const double v = value / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

std::vector<Rgb> sequential(int opencv_map) {
  cv::Mat ramp(1, 256, CV_8U), mapped;
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(ramp, mapped, opencv_map);
  std::vector<Rgb> colors;
  for (int i = 0; i < 256; ++i) {
    const cv::Vec3b bgr = mapped.at<cv::Vec3b>(0, i);
    colors.push_back({bgr[2], bgr[1], bgr[0]});
  }
  return colors;
}

std::vector<Rgb> diverging() {
  constexpr int kMiddle = 127;
  constexpr std::array<double, 3> kBlue = {33, 102, 172}, kRed = {178, 24, 43};
  std::vector<Rgb> colors;
  for (int i = 0; i <= 2 * kMiddle; ++i) {
    const std::array<double, 3>& end = i < kMiddle ? kBlue : kRed;
    const double share = std::abs(i - kMiddle) / static_cast<double>(kMiddle);
    const auto part = [&](int k) { return static_cast<std::uint8_t>(std::lround(255 + (end[k] - 255) * share)); };
    colors.push_back({part(0), part(1), part(2)});
  }
  return colors;
}

}  // namespace

double luminance(Rgb color) { return 0.2126 * linear(color.r) + 0.7152 * linear(color.g) + 0.0722 * linear(color.b); }

double contrast(Rgb a, Rgb b) {
  const auto [darker, lighter] = std::minmax({luminance(a), luminance(b)});
  return (lighter + 0.05) / (darker + 0.05);
}

const std::vector<Rgb>& colorsOf(ColorMap map) {
  static const std::vector<Rgb> kViridis = sequential(cv::COLORMAP_VIRIDIS),
                                kCividis = sequential(cv::COLORMAP_CIVIDIS), kMagma = sequential(cv::COLORMAP_MAGMA),
                                kBlueWhiteRed = diverging();
  switch (map) {
    case ColorMap::kViridis:
      return kViridis;
    case ColorMap::kCividis:
      return kCividis;
    case ColorMap::kMagma:
      return kMagma;
    case ColorMap::kBlueWhiteRed:
      break;
  }
  return kBlueWhiteRed;
}

Rgb ColorScale::color(double level_db) const {
  const std::vector<Rgb>& colors = colorsOf(map);
  const double share = std::clamp((level_db - low_db) / (high_db - low_db), 0.0, 1.0);
  return colors[static_cast<std::size_t>(std::lround(share * static_cast<double>(colors.size() - 1)))];
}

}  // namespace mmradartwin
