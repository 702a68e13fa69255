#include "mmradartwin_sim/cell_records.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "mmradartwin_dsp/input_error.h"
#include "records/record_group.h"

namespace mmradartwin {
namespace {

constexpr double kCell_rad = 4 * M_PI / 180;
constexpr double kAccuracy = 1e-8;  // of a tone's samples
constexpr int kMostPoints = 64;

/// Chebyshev points of the first kind on [-1, 1] and their Lagrange polynomials.
class Interpolation {
 public:
  explicit Interpolation(int points) : points_(static_cast<std::size_t>(points)), scale_(points_.size(), 1) {
    for (int p = 0; p < points; ++p) points_[static_cast<std::size_t>(p)] = std::cos((2 * p + 1) * M_PI / (2 * points));
    for (std::size_t p = 0; p < points_.size(); ++p) {
      for (std::size_t q = 0; q < points_.size(); ++q) {
        if (q != p) scale_[p] /= points_[p] - points_[q];
      }
    }
  }
  /// How many points follow exp(j phase x) on [-1, 1] within kAccuracy: its Chebyshev coefficients are Bessel functions
  /// of the phase, below (phase/2)^n / n!.
  static int pointsFor(double phase_rad) {
    double bound = 4;
    for (int n = 1; n < kMostPoints; ++n) {
      bound *= 0.5 * phase_rad / n;
      if (n > phase_rad && bound < kAccuracy) return n;
    }
    return kMostPoints;
  }
  double point(std::size_t p) const { return points_[p]; }
  /// The polynomials' values at x.
  void at(double x, std::vector<double>& values) const {
    values.assign(points_.size(), 1);
    double before = 1, behind = 1;
    for (std::size_t p = 0; p < points_.size(); ++p) {
      values[p] = before * scale_[p];
      before *= x - points_[p];
    }
    for (std::size_t p = points_.size(); p-- > 0;) {
      values[p] *= behind;
      behind *= x - points_[p];
    }
  }

 private:
  std::vector<double> points_, scale_;
};

/// Adds what stands for a cell's records; the records themselves where there are too few of them to gain by it.
void addCell(const RadarConfig& radar, const std::vector<PathRecord>& records, const std::vector<std::size_t>& cell,
             std::vector<PathRecord>& sums) {
  const std::size_t channels = static_cast<std::size_t>(radar.channels());
  // Lengths differ from channel to channel by about the same for all points of a cell.
  std::vector<double> offset(channels, 0);
  for (std::size_t i : cell) {
    for (std::size_t k = 0; k < channels; ++k) offset[k] += records[i].length_m[k] - records[i].length_m[0];
  }
  for (double& o : offset) o /= static_cast<double>(cell.size());
  double low = records[cell.front()].length_m[0], high = low;
  for (std::size_t i : cell) {
    for (std::size_t k = 0; k < channels; ++k) {
      const double length = records[i].length_m[k] - offset[k];
      low = std::min(low, length);
      high = std::max(high, length);
    }
  }
  const double middle = 0.5 * (low + high), half = std::max(0.5 * (high - low), 1e-9);
  const double farthest_s =
      std::max(std::abs(radar.sample_time_s(0) - radar.window_center_s()),
               std::abs(radar.sample_time_s(radar.samples_per_chirp - 1) - radar.window_center_s()));
  const int count =
      Interpolation::pointsFor(2 * M_PI * radar.slope_hz_per_s / kSpeedOfLight_m_per_s * half * farthest_s);
  if (count >= kMostPoints || count >= static_cast<int>(cell.size())) {
    for (std::size_t i : cell) sums.push_back(records[i]);
    return;
  }
  const Interpolation interpolation(count);
  const std::size_t first = sums.size(), points = static_cast<std::size_t>(count);
  const PathRecord& any = records[cell.front()];
  for (std::size_t p = 0; p < points; ++p) {
    sums.push_back(standIn(any));
    PathRecord& sum = sums.back();
    sum.c.assign(channels, 0);
    sum.length_m.assign(offset.begin(), offset.end());
    for (double& length : sum.length_m) length += middle + half * interpolation.point(p);
    sum.vertices.assign(any.vertices.size(), Eigen::Vector3d::Zero());
    sum.departure.setZero();
  }
  std::vector<double> value, power(points, 0);
  for (std::size_t i : cell) {
    const PathRecord& r = records[i];
    for (std::size_t k = 0; k < channels; ++k) {
      interpolation.at((r.length_m[k] - offset[k] - middle) / half, value);
      for (std::size_t p = 0; p < points; ++p) sums[first + p].c[k] += value[p] * r.c[k];
      if (k > 0) continue;
      for (std::size_t p = 0; p < points; ++p) {
        const double weight = std::pow(value[p] * r.amplitude, 2);
        power[p] += weight;
        sums[first + p].departure += weight * r.departure;
        for (std::size_t v = 0; v < r.vertices.size(); ++v) sums[first + p].vertices[v] += weight * r.vertices[v];
      }
    }
  }
  for (std::size_t p = 0; p < points; ++p) {
    PathRecord& sum = sums[first + p];
    sum.departure = power[p] > 0 ? Eigen::Vector3d(sum.departure.normalized()) : any.departure;
    sum.arrival = sum.departure;
    for (std::size_t v = 0; v < sum.vertices.size(); ++v) {
      sum.vertices[v] = power[p] > 0 ? Eigen::Vector3d(sum.vertices[v] / power[p]) : any.vertices[v];
    }
    double norm = 0;
    for (const auto& c : sum.c) norm += std::norm(c);
    sum.amplitude = std::sqrt(norm / static_cast<double>(channels));
    sum.phase_rad = std::arg(sum.c[0]);
    sum.range_bin = rangeBin(radar, sum.length_m[0]);
  }
}

}  // namespace

DiffuseRecords diffuseRecordsFrom(const std::string& text, const std::string& key) {
  if (text == "cells") return DiffuseRecords::kCells;
  if (text == "points") return DiffuseRecords::kPoints;
  throw InputError(key + ": '" + text + "' is unknown; allowed: cells, points");
}

std::vector<PathRecord> sumPerCell(const RadarConfig& radar, std::vector<PathRecord> records) {
  constexpr int kFewest = 16;  // fewer never gain
  std::vector<char> replaced(records.size(), 0);
  std::vector<PathRecord> sums, result;
  for (const std::vector<std::size_t>& group : groupByFacet(records, kFewest)) {
    std::map<int, std::vector<std::size_t>> cells;
    for (std::size_t i : group) {
      const Eigen::Vector3d& d = records[i].departure;
      cells[static_cast<int>(std::floor(std::atan2(d.y(), d.x()) / kCell_rad))].push_back(i);
    }
    sums.clear();
    for (const auto& [place, cell] : cells) addCell(radar, records, cell, sums);
    if (sums.size() >= group.size()) continue;
    for (std::size_t i : group) replaced[i] = 1;
    std::move(sums.begin(), sums.end(), std::back_inserter(result));
  }
  std::vector<PathRecord> kept;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!replaced[i]) kept.push_back(std::move(records[i]));
  }
  std::move(result.begin(), result.end(), std::back_inserter(kept));
  return kept;
}

std::vector<PathRecord> exportedRecords(const RadarConfig& radar, std::vector<PathRecord> records, DiffuseRecords as) {
  return as == DiffuseRecords::kPoints ? std::move(records) : sumPerCell(radar, std::move(records));
}

}  // namespace mmradartwin
