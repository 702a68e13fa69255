#include "mmradartwin_dsp/detection_agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

namespace mmradartwin {
namespace {

std::vector<Eigen::Vector2d> positions(const std::vector<Detection>& detections) {
  std::vector<Eigen::Vector2d> places;
  for (const Detection& detection : detections) places.push_back(position_m(detection));
  return places;
}

double share(int part, int whole) {
  return whole > 0 ? static_cast<double>(part) / whole : std::numeric_limits<double>::quiet_NaN();
}

/// Mean distance from each of `from` to the nearest of `to`; none may be empty.
double meanNearest_m(const std::vector<Eigen::Vector2d>& from, const std::vector<Eigen::Vector2d>& to) {
  double sum_m = 0;
  for (const Eigen::Vector2d& place : from) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector2d& other : to) nearest_m = std::min(nearest_m, (place - other).norm());
    sum_m += nearest_m;
  }
  return sum_m / static_cast<double>(from.size());
}

int pairsWithin(double radius_m, const std::vector<Eigen::Vector2d>& some, const std::vector<Eigen::Vector2d>& others) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < some.size(); ++i) {
    for (std::size_t j = 0; j < others.size(); ++j) {
      const double distance_m = (some[i] - others[j]).norm();
      if (distance_m <= radius_m) candidates.emplace_back(distance_m, i, j);
    }
  }
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> taken(some.size()), other_taken(others.size());
  int pairs = 0;
  for (const auto& [distance_m, i, j] : candidates) {
    if (taken[i] || other_taken[j]) continue;
    taken[i] = other_taken[j] = true;
    ++pairs;
  }
  return pairs;
}

}  // namespace

Eigen::Vector2d position_m(const Detection& detection) {
  return detection.range_m * Eigen::Vector2d(std::cos(detection.azimuth_rad), std::sin(detection.azimuth_rad));
}

DetectionAgreement agreement(const std::vector<Detection>& measured, const std::vector<Detection>& simulated,
                             double radius_m) {
  const std::vector<Eigen::Vector2d> real = positions(measured), twin = positions(simulated);
  DetectionAgreement result;
  result.measured = static_cast<int>(real.size());
  result.simulated = static_cast<int>(twin.size());
  result.matched = pairsWithin(radius_m, real, twin);
  result.precision = share(result.matched, result.simulated);
  result.recall = share(result.matched, result.measured);
  result.chamfer_m = real.empty() || twin.empty() ? std::numeric_limits<double>::quiet_NaN()
                                                  : (meanNearest_m(real, twin) + meanNearest_m(twin, real)) / 2;
  return result;
}

}  // namespace mmradartwin
