#include "fan_geometry.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

FanPoint polar(double range_m, double azimuth_rad) {
  return {range_m * std::cos(azimuth_rad), range_m * std::sin(azimuth_rad)};
}

double arcsine(double sine) { return std::asin(std::clamp(sine, -1.0, 1.0)); }

void requireAscending(const std::vector<double>& values, const char* name, bool gaps) {
  double last = -HUGE_VAL;
  std::size_t count = 0;
  for (double v : values) {
    if (gaps && std::isnan(v)) continue;
    if (!std::isfinite(v) || v <= last) throw InputError(std::string("map: ") + name + " does not ascend");
    last = v;
    ++count;
  }
  if (count < 2) throw InputError(std::string("map: ") + name + " has fewer than two bins");
}

}  // namespace

FanGeometry::FanGeometry(const std::vector<double>& range_m, const std::vector<double>& azimuth_rad) {
  requireAscending(range_m, "range_m", false);
  requireAscending(azimuth_rad, "azimuth_rad", true);
  range_edges_m_.push_back(std::max(0.0, range_m[0] - (range_m[1] - range_m[0]) / 2));
  for (std::size_t r = 1; r < range_m.size(); ++r) range_edges_m_.push_back((range_m[r - 1] + range_m[r]) / 2);
  range_edges_m_.push_back(range_m.back() + (range_m.back() - range_m[range_m.size() - 2]) / 2);

  std::vector<std::size_t> bins;
  for (std::size_t a = 0; a < azimuth_rad.size(); ++a) {
    if (!std::isnan(azimuth_rad[a])) bins.push_back(a);
  }
  sectors_.assign(azimuth_rad.size(), {NAN, NAN});
  const auto sine = [&](std::size_t i) { return std::sin(azimuth_rad[bins[i]]); };
  const std::size_t last = bins.size() - 1;
  for (std::size_t i = 0; i <= last; ++i) {
    const double from = i > 0 ? (sine(i - 1) + sine(i)) / 2 : sine(0) - (sine(1) - sine(0)) / 2;
    const double to = i < last ? (sine(i) + sine(i + 1)) / 2 : sine(last) + (sine(last) - sine(last - 1)) / 2;
    sectors_[bins[i]] = {arcsine(from), arcsine(to)};
  }
}

std::array<FanPoint, 4> FanGeometry::corners(std::size_t range_bin, std::size_t angle_bin) const {
  const double near_m = range_edges_m_[range_bin], far_m = range_edges_m_[range_bin + 1];
  const Sector& s = sectors_[angle_bin];
  return {polar(near_m, s.from_rad), polar(far_m, s.from_rad), polar(far_m, s.to_rad), polar(near_m, s.to_rad)};
}

int FanGeometry::cellAt(FanPoint place) const {
  const double range_m = std::hypot(place.x_m, place.y_m);
  if (range_edges_m_.empty() || place.x_m < 0 || range_m < range_edges_m_.front() || range_m >= farthest_m()) return -1;
  const auto ring = std::upper_bound(range_edges_m_.begin(), range_edges_m_.end(), range_m) - range_edges_m_.begin();
  const double azimuth = std::atan2(place.y_m, place.x_m);
  // Bins without an angle stand at both ends.
  const auto beyond = std::partition_point(sectors_.begin(), sectors_.end(), [&](const Sector& s) {
    return std::isnan(s.to_rad) ? &s < &sectors_[sectors_.size() / 2] : s.to_rad <= azimuth;
  });
  if (beyond == sectors_.end() || !(beyond->from_rad <= azimuth)) return -1;
  return static_cast<int>((ring - 1) * static_cast<std::ptrdiff_t>(sectors_.size()) + (beyond - sectors_.begin()));
}

FanMesh FanGeometry::mesh(double step_rad, double up_to_m) const {
  FanMesh mesh;
  // On a straight edge of constant angle the texture's row grows with range, as far as bins are as wide as each other.
  const double rows = static_cast<double>(ranges()), columns = static_cast<double>(angles());
  std::vector<std::size_t> rings = {0};
  const double width_m = (range_edges_m_.back() - range_edges_m_[1]) / (rows - 1);
  for (std::size_t r = 1; r < range_edges_m_.size(); ++r) {
    const bool uniform =
        std::abs(range_edges_m_[r] - range_edges_m_[1] - width_m * static_cast<double>(r - 1)) < 1e-6 * width_m;
    const bool last = range_edges_m_[r] >= up_to_m || r + 1 == range_edges_m_.size();
    if (!uniform || last || r == 1) rings.push_back(r);
    if (last) break;
  }
  for (std::size_t a = 0; a < sectors_.size(); ++a) {
    const Sector& s = sectors_[a];
    if (std::isnan(s.from_rad)) continue;
    const int steps = std::max(1, static_cast<int>(std::ceil((s.to_rad - s.from_rad) / step_rad)));
    for (int i = 0; i < steps; ++i) {
      const double share[2] = {static_cast<double>(i) / steps, static_cast<double>(i + 1) / steps};
      for (std::size_t k = 0; k + 1 < rings.size(); ++k) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (int side = 0; side < 2; ++side) {
          const double azimuth = s.from_rad + (s.to_rad - s.from_rad) * share[side];
          for (std::size_t ring : {rings[k], rings[k + 1]}) {
            mesh.vertices.push_back({polar(range_edges_m_[ring], azimuth),
                                     (static_cast<double>(a) + share[side]) / columns,
                                     static_cast<double>(ring) / rows});
          }
        }
        for (std::uint32_t corner : {0, 1, 3, 0, 3, 2}) mesh.triangles.push_back(first + corner);
      }
    }
  }
  return mesh;
}

}  // namespace mmradartwin
