#include "mmradartwin_dsp/point_detector.h"

#include <algorithm>
#include <cstdlib>
#include <limits>

namespace mmradartwin {
namespace {

constexpr double kLeastRate = 1e-12;  ///< that Cfar takes

CfarSettings forOneOf(CfarSettings settings, int bins) {
  settings.false_alarm_rate = std::max(kLeastRate, settings.false_alarm_rate / std::max(1, bins));
  return settings;
}

/// The strongest level of a map within a bin of range and so many of angle.
double strongestAround_db(const RealGrid& power_db, const Detection& cell, int angle_bins) {
  double strongest = -std::numeric_limits<double>::infinity();
  const int last_range = std::min<int>(cell.range_bin + 1, static_cast<int>(power_db.rows()) - 1);
  const int last_angle = std::min<int>(cell.angle_bin + angle_bins, static_cast<int>(power_db.cols()) - 1);
  for (int r = std::max(cell.range_bin - 1, 0); r <= last_range; ++r) {
    for (int a = std::max(cell.angle_bin - angle_bins, 0); a <= last_angle; ++a) {
      if (power_db(r, a) > strongest) strongest = power_db(r, a);  // no, where it is masked
    }
  }
  return strongest;
}

/// The strongest level of each cell of range and angle, over all maps; NaN where it is masked.
RealGrid strongestAtAnySpeed_db(const std::vector<RangeAngleMap>& maps) {
  RealGrid strongest = maps.front().power_db;
  for (const RangeAngleMap& map : maps) strongest = strongest.cwiseMax(map.power_db);
  return strongest;
}

}  // namespace

PointDetector::PointDetector(const CfarSettings& settings, const RadarConfig& radar)
    : still_(settings, radar), moving_(forOneOf(settings, radar.loops_per_frame), radar) {}

std::vector<Detection> PointDetector::moving(const SignalChain& chain, const DopplerGrids& frame) const {
  std::vector<RangeAngleMap> maps;
  maps.reserve(frame.grids.size());
  for (const ReceiveGrid& grid : frame.grids) maps.push_back(chain.map(grid));
  const RealGrid strongest_db = strongestAtAnySpeed_db(maps);
  const int half_beam_bins = std::max(1, moving_.beamBins() / 2);
  std::vector<Detection> detections;
  for (std::size_t d = 0; d < maps.size(); ++d) {
    if (frame.binsFromStill(d) <= kStillBins) continue;
    // Speeds repeat: the first bin lies next to the last.
    const RealGrid& slower = maps[(d + maps.size() - 1) % maps.size()].power_db;
    const RealGrid& faster = maps[(d + 1) % maps.size()].power_db;
    for (Detection& found : moving_.detect(maps[d])) {
      const double least_db = strongestAround_db(strongest_db, found, moving_.beamBins()) - kDopplerSidelobe_db;
      if (found.power_db < least_db || strongestAround_db(slower, found, half_beam_bins) >= found.power_db ||
          strongestAround_db(faster, found, half_beam_bins) > found.power_db) {
        continue;
      }
      found.radial_speed_m_per_s = frame.radial_speed_m_per_s[d];
      detections.push_back(found);
    }
  }
  return detections;
}

std::vector<Detection> PointDetector::all(const SignalChain& chain, const RangeAngleMap& average,
                                          const DopplerGrids& frame) const {
  const std::vector<Detection> movers = moving(chain, frame);
  std::vector<Detection> detections;
  for (Detection& found : still_.detect(average)) {
    const auto hides = [&](const Detection& mover) {
      return std::abs(mover.range_bin - found.range_bin) <= 1 &&
             std::abs(mover.angle_bin - found.angle_bin) <= still_.beamBins() && mover.power_db > found.power_db;
    };
    if (std::any_of(movers.begin(), movers.end(), hides)) continue;
    found.radial_speed_m_per_s = 0;
    detections.push_back(found);
  }
  detections.insert(detections.end(), movers.begin(), movers.end());
  return detections;
}

}  // namespace mmradartwin
