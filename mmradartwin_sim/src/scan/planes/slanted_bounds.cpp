#include "scan/planes/slanted_bounds.h"

#include <algorithm>
#include <cmath>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kLeastSlant_m2 = 1;                    // slanted faces of furniture are smaller
constexpr double kFlattest = 0.966, kSteepest = 0.174;  // |cosine| between normal and up: 15 and 80 deg
constexpr double kSamePlane = 0.9998;                   // cosine of 1 deg

double topOf(const ScanSamples& samples, const PlaneRegion& r) {
  double top = -1e9;
  for (int i : r.samples) top = std::max(top, static_cast<double>(samples.points[static_cast<std::size_t>(i)].z()));
  return top;
}

}  // namespace

bool boundsRoom(const ScanSamples& samples, const PlaneRegion& r) {
  std::size_t count = 0;
  for (const Eigen::Vector3f& p : samples.points) {
    const double d = r.distance(p.cast<double>());
    count += d < -bounds::kBehind_m[0] && d > -bounds::kBehind_m[1];
  }
  return static_cast<double>(count) < bounds::kSeenBehind * static_cast<double>(r.samples.size());
}

std::vector<PlaneRegion> slantedBounds(const ScanSamples& samples, const std::vector<PlaneRegion>& regions,
                                       double height_m) {
  std::vector<PlaneRegion> found;
  for (PlaneRegion r : regions) {  // largest first
    if (std::abs(r.normal.z()) > kFlattest || std::abs(r.normal.z()) < kSteepest) continue;
    if (r.normal.z() > 0 && !samples.oriented) r.normal *= -1, r.offset_m *= -1;  // its lower side is seen
    const auto same = std::find_if(found.begin(), found.end(), [&](const PlaneRegion& f) {
      return f.normal.dot(r.normal) > kSamePlane && std::abs(f.distance(r.middle)) < planeTolerance(samples, r);
    });
    if (same != found.end()) {
      same->samples.insert(same->samples.end(), r.samples.begin(), r.samples.end());
      std::sort(same->samples.begin(), same->samples.end());
      fitPlane(samples, 0, *same);
      continue;
    }
    if (r.normal.z() > 0 || r.area_m2 < kLeastSlant_m2 || topOf(samples, r) < height_m - bounds::kBelowTop_m) continue;
    if (boundsRoom(samples, r)) found.push_back(std::move(r));
  }
  return found;
}

PlaneLoops behindSlant(const PlaneRegion& slant, const PlaneAxes& axes, const Eigen::AlignedBox2d& box) {
  if (box.isEmpty()) return {};
  const std::vector<Eigen::Vector2d> corners = {
      box.min(), {box.max().x(), box.min().y()}, box.max(), {box.min().x(), box.max().y()}};
  const auto before_m = [&](const Eigen::Vector2d& q) {
    return slant.distance(axes.origin + q.x() * axes.u + q.y() * axes.v);
  };
  std::vector<Eigen::Vector2d> loop;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d &p = corners[i], &q = corners[(i + 1) % corners.size()];
    const double at_p = before_m(p), at_q = before_m(q);
    if (at_p < 0) loop.push_back(p);
    if ((at_p < 0) != (at_q < 0)) loop.emplace_back(p + at_p / (at_p - at_q) * (q - p));
  }
  if (loop.size() < 3) return {};
  return {loop};
}

}  // namespace mmradartwin
