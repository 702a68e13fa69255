#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "mmradartwin_attribution/mount_calibration.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr int kWidth_px = 900, kPanel_px = 240, kLeft_px = 90, kRight_px = 20, kTop_px = 40, kBottom_px = 30;
const cv::Scalar kBefore_bgr(0, 94, 213), kAfter_bgr(178, 114, 0), kGrey_bgr(170, 170, 170), kBlack_bgr(0, 0, 0);

struct Panel {
  std::string title;
  std::vector<std::string> labels;          ///< one per column
  std::vector<std::vector<double>> before;  ///< [column] values
  std::vector<std::vector<double>> after;
};

void text(cv::Mat& image, const std::string& words, cv::Point at, const cv::Scalar& color, double size = 0.42) {
  cv::putText(image, words, at, cv::FONT_HERSHEY_SIMPLEX, size, color, 1, cv::LINE_AA);
}

std::string number(double value) {
  char line[32];
  std::snprintf(line, sizeof line, "%.3g", value);
  return line;
}

void draw(cv::Mat image, const Panel& panel) {
  double limit = 1e-6;
  for (const auto* side : {&panel.before, &panel.after}) {
    for (const auto& column : *side) {
      for (double v : column) limit = std::max(limit, std::abs(v));
    }
  }
  limit *= 1.1;
  const int height = kPanel_px - kTop_px - kBottom_px, width = kWidth_px - kLeft_px - kRight_px;
  const auto y = [&](double v) { return kTop_px + static_cast<int>((1 - v / limit) * height / 2); };
  text(image, panel.title, {kLeft_px, 24}, kBlack_bgr, 0.5);
  for (double v : {-limit, 0.0, limit}) {
    cv::line(image, {kLeft_px, y(v)}, {kWidth_px - kRight_px, y(v)}, kGrey_bgr, 1);
    text(image, number(v), {8, y(v) + 4}, kBlack_bgr);
  }
  const int columns = std::max(1, static_cast<int>(panel.labels.size()));
  const int every = (columns + 17) / 18;
  for (int c = 0; c < static_cast<int>(panel.labels.size()); ++c) {
    const int x = kLeft_px + (2 * c + 1) * width / (2 * columns);
    for (double v : panel.before[c]) cv::circle(image, {x - 4, y(v)}, 4, kBefore_bgr, 1, cv::LINE_AA);
    for (double v : panel.after[c]) cv::circle(image, {x + 4, y(v)}, 3, kAfter_bgr, cv::FILLED, cv::LINE_AA);
    if (c % every == 0) text(image, panel.labels[c], {x - 10, kPanel_px - 8}, kBlack_bgr);
  }
}

void write(std::ostringstream& out, const CalibratedValue& v) {
  out << "{value: " << yamlNumber(v.value) << ", unit: " << yamlText(v.unit);
  if (v.observable) {
    out << ", ci95: [" << yamlNumber(v.ci95[0]) << ", " << yamlNumber(v.ci95[1]) << "]";
  } else {
    out << ", ci95: null";
  }
  if (!v.note.empty()) out << ", note: " << yamlText(v.note);
  out << "}\n";
}

void writeList(std::ostringstream& out, const std::vector<CalibratedValue>& values) {
  for (const CalibratedValue& v : values) {
    out << "    - ";
    write(out, v);
  }
}

}  // namespace

cv::Mat drawCalibration(const MountCalibration& calibration) {
  Panel range, azimuth, phase;
  range.title = "range, measured minus expected [mm]";
  azimuth.title = "azimuth, measured minus expected [deg]";
  phase.title = "phase of each channel against the expected, all poses [deg]";
  for (const CalibratedPose& pose : calibration.poses) {
    if (!pose.used) continue;
    range.labels.push_back(pose.name);
    azimuth.labels.push_back(pose.name);
    range.before.push_back({1000 * pose.range_error_m[0]});
    range.after.push_back({1000 * pose.range_error_m[1]});
    azimuth.before.push_back({pose.azimuth_error_deg[0]});
    azimuth.after.push_back({pose.azimuth_error_deg[1]});
    phase.before.resize(pose.channel_error_deg[0].size());
    phase.after.resize(phase.before.size());
    for (std::size_t k = 0; k < phase.before.size(); ++k) {
      phase.before[k].push_back(pose.channel_error_deg[0][k]);
      phase.after[k].push_back(pose.channel_error_deg[1][k]);
    }
  }
  for (std::size_t k = 0; k < phase.before.size(); ++k) phase.labels.push_back(std::to_string(k));
  cv::Mat image(3 * kPanel_px, kWidth_px, CV_8UC3, cv::Scalar::all(255));
  int row = 0;
  for (const Panel* panel : {&range, &azimuth, &phase}) {
    draw(image(cv::Rect(0, kPanel_px * row++, kWidth_px, kPanel_px)), *panel);
  }
  text(image, "o before", {kWidth_px - 200, 24}, kBefore_bgr, 0.5);
  text(image, "* after", {kWidth_px - 100, 24}, kAfter_bgr, 0.5);
  return image;
}

std::string toYaml(const MountCalibration& c) {
  std::ostringstream out;
  out << "format: mmradartwin_calibration/1\nlasers: " << (c.lasers ? "true" : "false")
      << "\nradar_yaw_offset:\n  yaw_deg: ";
  write(out, c.yaw_deg);
  out << "radar_position_offset:\n  forward_m: ";
  write(out, c.forward_m);
  out << "  left_m: ";
  write(out, c.left_m);
  out << "range_bias:\n  range_m: ";
  write(out, c.range_m);
  out << "channel_phase_error:\n  phase_deg:\n";
  writeList(out, c.phase_deg);
  out << "  gain_db:\n";
  writeList(out, c.gain_db);
  out << "notes:\n";
  for (const std::string& note : c.notes) out << "  - " << yamlText(note) << "\n";
  out << "poses:\n";
  for (const CalibratedPose& p : c.poses) {
    out << "  - {pose: " << yamlText(p.name) << ", used: " << (p.used ? "true" : "false");
    if (p.used) {
      out << ", azimuth_deg: " << yamlNumber(p.azimuth_deg) << ", range_m: " << yamlNumber(p.range_m)
          << ", level_db: " << yamlNumber(p.level_db) << ", range_error_m: [" << yamlNumber(p.range_error_m[0]) << ", "
          << yamlNumber(p.range_error_m[1]) << "], azimuth_error_deg: [" << yamlNumber(p.azimuth_error_deg[0]) << ", "
          << yamlNumber(p.azimuth_error_deg[1]) << "]";
    } else {
      out << ", why_not: " << yamlText(p.why_not);
    }
    out << "}\n";
  }
  return out.str();
}

}  // namespace mmradartwin
