#include "mmradartwin_dsp/map_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

namespace mmradartwin {
namespace {

const cv::Scalar kPaper(255, 255, 255), kInk(40, 40, 40), kGrid(150, 150, 150), kNoData(214, 214, 214);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kFieldOfView_rad = M_PI / 3;
constexpr double kNearRange_m = 0.16;

/// Where things stand on the picture. The radar is at (x, y) of `origin`, boresight up, left of the radar left.
struct Layout {
  explicit Layout(const FanStyle& style) {
    scale = style.height_px / 600.0 * style.letters;
    line = style.height_px / 600.0;
    top = static_cast<int>((style.title.empty() ? 26 : 50) * scale);
    bottom = static_cast<int>(34 * scale);
    radius = style.height_px - top - bottom;
    side = static_cast<int>(34 * scale);
    bar = static_cast<int>(96 * scale);
    origin = cv::Point(side + radius, top + radius);
    size = cv::Size(2 * (side + radius) + bar, style.height_px);
    px_per_m = radius / style.max_range_m;
  }

  cv::Point2d at(double range_m, double azimuth_rad) const {
    return {origin.x - range_m * px_per_m * std::sin(azimuth_rad),
            origin.y - range_m * px_per_m * std::cos(azimuth_rad)};
  }

  double scale;  ///< of letters and margins
  double line;   ///< of lines
  double px_per_m;
  int top, bottom, side, bar, radius;
  cv::Point origin;
  cv::Size size;
};

/// 256 colours: viridis, or blue - white - red (BGR).
cv::Mat palette(bool diverging) {
  cv::Mat ramp(1, 256, CV_8U), colors;
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(0, i) = static_cast<std::uint8_t>(i);
  if (!diverging) {
    cv::applyColorMap(ramp, colors, cv::COLORMAP_VIRIDIS);
    return colors;
  }
  colors.create(1, 256, CV_8UC3);
  const cv::Vec3d blue(172, 102, 33), white(247, 247, 247), red(43, 24, 178);
  for (int i = 0; i < 256; ++i) {
    const double t = (i - 127.5) / 127.5;
    const cv::Vec3d color = white + (t < 0 ? blue - white : red - white) * std::abs(t);
    colors.at<cv::Vec3b>(0, i) =
        cv::Vec3b(cv::saturate_cast<std::uint8_t>(color[0]), cv::saturate_cast<std::uint8_t>(color[1]),
                  cv::saturate_cast<std::uint8_t>(color[2]));
  }
  return colors;
}

double peakInView(const RangeAngleAxes& axes, const RealGrid& power_db) {
  double peak = -std::numeric_limits<double>::infinity();
  for (Eigen::Index r = 0; r < power_db.rows(); ++r) {
    if (axes.range_m[static_cast<std::size_t>(r)] <= kNearRange_m) continue;
    for (Eigen::Index a = 0; a < power_db.cols(); ++a) {
      const bool inside = std::abs(axes.azimuth_rad[static_cast<std::size_t>(a)]) <= kFieldOfView_rad;
      if (inside && power_db(r, a) > peak) peak = power_db(r, a);
    }
  }
  return peak;
}

void drawText(cv::Mat& picture, const std::string& words, cv::Point2d at, double size, const cv::Scalar& color,
              bool centred = false, int thickness = 1) {
  int baseline = 0;
  const cv::Size extent = cv::getTextSize(words, kFont, size, thickness, &baseline);
  if (centred) at.x -= extent.width / 2.0;
  at.x = std::max(2.0, std::min(at.x, picture.cols - extent.width - 2.0));
  at.y = std::max(extent.height + 2.0, std::min(at.y, picture.rows - baseline - 2.0));
  cv::putText(picture, words, cv::Point(cvRound(at.x), cvRound(at.y)), kFont, size, color, thickness, cv::LINE_AA);
}

/// Index of the nearest azimuth bin, -1 beyond half a bin outside of the axis. Bins are uniform in the sine.
struct AzimuthIndex {
  explicit AzimuthIndex(const std::vector<double>& azimuth_rad) {
    for (std::size_t a = 0; a < azimuth_rad.size(); ++a) {
      if (std::isnan(azimuth_rad[a])) continue;
      if (sines.empty()) first = static_cast<int>(a);
      sines.push_back(std::sin(azimuth_rad[a]));
    }
  }
  int operator()(double sine) const {
    if (sines.size() < 2) return -1;
    const double position = (sine - sines.front()) / (sines.back() - sines.front()) * (sines.size() - 1.0);
    const int index = static_cast<int>(std::lround(position));
    return index < 0 || index >= static_cast<int>(sines.size()) ? -1 : first + index;
  }
  std::vector<double> sines;
  int first = 0;
};

void drawCells(cv::Mat& picture, const Layout& layout, const RangeAngleAxes& axes, const RealGrid& power_db,
               const FanStyle& style, double reference_db, const cv::Mat& colors) {
  const AzimuthIndex azimuth_index(axes.azimuth_rad);
  const double range_bin_m = axes.range_m.size() > 1 ? axes.range_m[1] - axes.range_m[0] : 1;
  for (int y = layout.top; y <= layout.origin.y; ++y) {
    for (int x = layout.side; x <= layout.side + 2 * layout.radius; ++x) {
      const double ahead = layout.origin.y - y, left = layout.origin.x - x;
      const double distance = std::hypot(ahead, left);
      if (distance > layout.radius) continue;
      const int r = static_cast<int>(std::lround(distance / layout.px_per_m / range_bin_m));
      const int a = distance > 0 ? azimuth_index(left / distance) : azimuth_index(0);
      double value = std::numeric_limits<double>::quiet_NaN();
      if (r < power_db.rows() && a >= 0) value = power_db(r, a) - reference_db;
      cv::Vec3b& pixel = picture.at<cv::Vec3b>(y, x);
      if (std::isnan(value)) {
        pixel = cv::Vec3b(static_cast<std::uint8_t>(kNoData[0]), static_cast<std::uint8_t>(kNoData[1]),
                          static_cast<std::uint8_t>(kNoData[2]));
        continue;
      }
      const double share = (value - style.min_db) / (style.max_db - style.min_db);
      pixel = colors.at<cv::Vec3b>(0, static_cast<int>(std::lround(255 * std::clamp(share, 0.0, 1.0))));
    }
  }
}

void drawGraticule(cv::Mat& picture, const Layout& layout, const FanStyle& style) {
  const double step_m = style.max_range_m <= 7 ? 1 : style.max_range_m <= 14 ? 2 : style.max_range_m <= 40 ? 5 : 10;
  const auto radius_px = [&](double range_m) { return cvRound(range_m * layout.px_per_m); };
  const double label = 0.42 * layout.scale;
  // Lines cross dark and light cells alike: drawn half-transparent.
  cv::Mat lines = picture.clone();
  for (double range_m = step_m; range_m < style.max_range_m + 1e-9; range_m += step_m) {
    cv::ellipse(lines, layout.origin, cv::Size(radius_px(range_m), radius_px(range_m)), 0, 180, 360, kGrid, 1,
                cv::LINE_AA);
  }
  for (int spoke_deg = -90; spoke_deg <= 90; spoke_deg += 30) {
    cv::line(lines, layout.origin, layout.at(style.max_range_m, spoke_deg * M_PI / 180), kGrid, 1, cv::LINE_AA);
  }
  cv::addWeighted(lines, 0.6, picture, 0.4, 0, picture);
  cv::ellipse(picture, layout.origin, cv::Size(layout.radius, layout.radius), 0, 180, 360, kInk, 1, cv::LINE_AA);
  cv::line(picture, layout.at(style.max_range_m, -M_PI / 2), layout.at(style.max_range_m, M_PI / 2), kInk, 1,
           cv::LINE_AA);
  for (double range_m = 0; range_m < style.max_range_m + 1e-9; range_m += step_m) {
    const std::string words = std::to_string(static_cast<int>(range_m)) + (range_m > 0 ? "" : " m");
    const double below = layout.origin.y + 17 * layout.scale;
    drawText(picture, words, {layout.at(range_m, -M_PI / 2).x, below}, label, kInk, true);
    if (range_m > 0) drawText(picture, words, {layout.at(range_m, M_PI / 2).x, below}, label, kInk, true);
  }
  for (int spoke_deg = -60; spoke_deg <= 60; spoke_deg += 30) {
    const cv::Point2d end = layout.at(style.max_range_m + 13 * layout.scale / layout.px_per_m, spoke_deg * M_PI / 180);
    const std::string sign = spoke_deg > 0 ? "+" : "";
    drawText(picture, sign + std::to_string(spoke_deg) + (spoke_deg == 0 ? " deg" : ""),
             {end.x, end.y + 4 * layout.scale}, label, kInk, true);
  }
}

void drawColorBar(cv::Mat& picture, const Layout& layout, const FanStyle& style, const cv::Mat& colors) {
  const int width = cvRound(16 * layout.scale), height = layout.radius * 3 / 4;
  const int x = layout.size.width - layout.bar + cvRound(14 * layout.scale), y = layout.top + layout.radius / 8;
  for (int row = 0; row < height; ++row) {
    const cv::Vec3b color = colors.at<cv::Vec3b>(0, 255 - row * 255 / std::max(1, height - 1));
    cv::line(picture, {x, y + row}, {x + width, y + row}, cv::Scalar(color[0], color[1], color[2]));
  }
  cv::rectangle(picture, {x, y}, {x + width, y + height}, kInk);
  const double label = 0.42 * layout.scale;
  const double span = style.max_db - style.min_db;
  const double step = span > 60 ? 20 : span > 25 ? 10 : span > 12 ? 5 : 2;
  for (double level = std::ceil(style.min_db / step) * step; level <= style.max_db + 1e-9; level += step) {
    const int at = y + cvRound((style.max_db - level) / span * height);
    cv::line(picture, {x + width, at}, {x + width + cvRound(4 * layout.scale), at}, kInk);
    const std::string sign = style.diverging && level > 0 ? "+" : "";
    drawText(picture, sign + std::to_string(static_cast<int>(std::lround(level))),
             {x + width + 7 * layout.scale, at + 5 * layout.scale}, label, kInk);
  }
  const std::string unit = style.diverging ? "dB" : style.normalise ? "dB re peak" : "dBFS";
  drawText(picture, unit, {x + width / 2.0 + 14 * layout.scale, y - 9 * layout.scale}, label, kInk, true);
}

void drawBox(cv::Mat& picture, const Layout& layout, const FanStyle& style, const FanBox& box) {
  const double near_m = std::max(0.0, box.range_m - box.half_range_m);
  const double far_m = std::min(style.max_range_m, box.range_m + box.half_range_m);
  if (near_m >= style.max_range_m) return;
  std::vector<cv::Point> outline;
  constexpr int kSteps = 16;
  for (int i = 0; i <= kSteps; ++i) {
    outline.emplace_back(layout.at(far_m, box.azimuth_rad + box.half_azimuth_rad * (2.0 * i / kSteps - 1)));
  }
  for (int i = kSteps; i >= 0; --i) {
    outline.emplace_back(layout.at(near_m, box.azimuth_rad + box.half_azimuth_rad * (2.0 * i / kSteps - 1)));
  }
  const bool large = style.letters > 1;  // shown small: boxes and labels have to stay visible then
  const int width = std::max(1, cvRound((large ? 3 : 1) * layout.line));
  // A dark rim keeps a white box visible on yellow cells and a magenta one on red.
  cv::polylines(picture, outline, true, cv::Scalar(30, 30, 30), width + 2, cv::LINE_AA);
  cv::polylines(picture, outline, true, box.color_bgr, width, cv::LINE_AA);
  if (box.label.empty()) return;
  const cv::Point2d at = layout.at(far_m, box.azimuth_rad) - cv::Point2d(0, 5 * layout.scale);
  if (large) {
    drawText(picture, box.label, at, 0.4 * layout.scale, cv::Scalar(20, 20, 20), true, 6);
    drawText(picture, box.label, at, 0.4 * layout.scale, kPaper, true, 2);
    return;
  }
  for (const cv::Point2d shift : {cv::Point2d(1, 1), cv::Point2d(-1, 1), cv::Point2d(1, -1), cv::Point2d(-1, -1)}) {
    drawText(picture, box.label, at + shift, 0.4 * layout.scale, cv::Scalar(20, 20, 20), true);
  }
  drawText(picture, box.label, at, 0.4 * layout.scale, box.color_bgr, true);
}

}  // namespace

cv::Mat drawFan(const RangeAngleAxes& axes, const RealGrid& power_db, const FanStyle& asked,
                const std::vector<FanBox>& boxes) {
  FanStyle style = asked;
  if (style.diverging) {  // white stands for 0 dB only where the limits are symmetric
    style.max_db = std::max(std::abs(asked.min_db), std::abs(asked.max_db));
    style.min_db = -style.max_db;
  }
  const Layout layout(style);
  cv::Mat picture(layout.size, CV_8UC3, kPaper);
  const double reference_db = style.normalise && !style.diverging ? peakInView(axes, power_db) : 0;
  const cv::Mat colors = palette(style.diverging);
  drawCells(picture, layout, axes, power_db, style, std::isfinite(reference_db) ? reference_db : 0, colors);
  drawGraticule(picture, layout, style);
  drawColorBar(picture, layout, style, colors);
  for (const FanBox& box : boxes) drawBox(picture, layout, style, box);
  if (!style.title.empty()) {
    drawText(picture, style.title, {layout.side * 0.5, 20 * layout.scale}, 0.55 * layout.scale, kInk);
  }
  return picture;
}

void writeMapCsv(const RangeAngleMap& map, const std::string& file) {
  std::ofstream out(file, std::ios::trunc);
  out << "range_m,azimuth_deg,power_db\n";
  char line[96];
  for (Eigen::Index r = 0; r < map.power_db.rows(); ++r) {
    for (Eigen::Index a = 0; a < map.power_db.cols(); ++a) {
      std::snprintf(line, sizeof line, "%.6f,%.6f,%.6f\n", map.axes.range_m[static_cast<std::size_t>(r)],
                    map.axes.azimuth_rad[static_cast<std::size_t>(a)] * 180 / M_PI, map.power_db(r, a));
      out << line;
    }
  }
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

void writePicture(const cv::Mat& picture, const std::string& file) {
  // Encoded in memory: OpenCV's writers print lines of their own where a disk is full.
  std::vector<unsigned char> bytes;
  bool written = false;
  try {
    if (cv::imencode(std::filesystem::path(file).extension().string(), picture, bytes)) {
      std::ofstream out(file, std::ios::trunc | std::ios::binary);
      out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      out.close();
      written = static_cast<bool>(out);
    }
  } catch (const cv::Exception&) {  // an unknown extension
  }
  if (!written) throw std::runtime_error(file + ": picture cannot be written; check folder, rights and free space");
}

}  // namespace mmradartwin
