#include "scan/planes/plane_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kBend_rad = bounds::kSameTurn_deg * bounds::kDegree;
constexpr double kWall_m2 = 1;       // drift shows on large planes alone
constexpr double kFarthest_m = 0.1;  // no piece of a wall is farther off; the tolerance decides
constexpr double kBendCell_m = 0.1;  // side of the cells by which two pieces overlap: some five voxels

/// Angle modulo 90 deg, -45 to 45.
double quarter(double angle_rad) { return angle_rad - M_PI / 2 * std::round(angle_rad / (M_PI / 2)); }

double yawOf(const PlaneRegion& r) { return std::atan2(r.normal.y(), r.normal.x()); }

/// The direction modulo 90 deg that most upright area has.
double mainDirection(const std::vector<PlaneRegion>& regions) {
  std::array<double, 180> area{};
  const auto bin = [](double angle) { return static_cast<int>(std::floor(angle / (M_PI / 2) * 180 + 360)) % 180; };
  for (const PlaneRegion& r : regions) {
    if (std::abs(r.normal.z()) < std::sin(5 * bounds::kDegree))
      area[static_cast<std::size_t>(bin(quarter(yawOf(r)) + M_PI / 4))] += r.area_m2;
  }
  double best = -1, direction = 0;
  for (int i = 0; i < 180; ++i) {
    double sum = 0;
    for (int k = -3; k <= 3; ++k) sum += area[static_cast<std::size_t>((i + k + 180) % 180)];
    if (sum > best) best = sum, direction = (i + 0.5) * M_PI / 360 - M_PI / 4;
  }
  for (double cone : {3.0, 1.0, 1.0}) {
    double sum = 0, weights = 0;
    for (const PlaneRegion& r : regions) {
      if (std::abs(r.normal.z()) > std::sin(5 * bounds::kDegree)) continue;
      const double off = quarter(yawOf(r) - direction);
      if (std::abs(off) > cone * bounds::kDegree) continue;
      const double weight = r.area_m2 / (std::pow(r.angle_std_rad, 2) + std::pow(0.05 * bounds::kDegree, 2));
      sum += weight * off, weights += weight;
    }
    if (weights > 0) direction += sum / weights;
  }
  return direction;
}

/// A cloud's planes face the side where most of the scan is.
void turnInwards(const ScanSamples& samples, std::vector<PlaneRegion>& regions) {
  const std::size_t step = std::max<std::size_t>(1, samples.size() / 20000);
  for (PlaneRegion& r : regions) {
    long front = 0;
    for (std::size_t i = 0; i < samples.size(); i += step) {
      const Eigen::Vector3d p = samples.points[i].cast<double>();
      const double d = r.distance(p);
      if (std::abs(d) > 0.1 && (p - r.middle).squaredNorm() < 9) front += d > 0 ? 1 : -1;
    }
    if (front < 0) r.normal *= -1, r.offset_m *= -1;
  }
}

/// Where an upright region has samples: cells of kBendCell_m along it and up.
std::set<std::pair<int, int>> cellsOf(const ScanSamples& samples, const PlaneRegion& r, const Eigen::Vector3d& u) {
  std::set<std::pair<int, int>> cells;
  for (int i : r.samples) {
    const Eigen::Vector3d p = samples.at(i) / kBendCell_m;
    cells.insert({static_cast<int>(std::floor(u.dot(p))), static_cast<int>(std::floor(p.z()))});
  }
  return cells;
}

/// Whether a piece goes on where a wall ends: it stands beside the wall's samples, and not before them.
bool goesOn(const ScanSamples& samples, const PlaneRegion& wall, const PlaneRegion& piece) {
  const Eigen::Vector3d u = Eigen::Vector3d::UnitZ().cross(wall.normal).normalized();
  const auto of_wall = cellsOf(samples, wall, u), of_piece = cellsOf(samples, piece, u);
  const auto shared = std::count_if(of_piece.begin(), of_piece.end(), [&](const auto& c) { return of_wall.count(c); });
  const double apart_m =
      std::max(of_piece.begin()->first - of_wall.rbegin()->first, of_wall.begin()->first - of_piece.rbegin()->first) *
      kBendCell_m;
  return apart_m < bounds::kWallGap_m && static_cast<double>(shared) < 0.3 * static_cast<double>(of_piece.size());
}

/// Nine in ten samples of a part lie on a plane.
bool holdsPart(const ScanSamples& samples, const PlaneRegion& plane, const std::vector<int>& part) {
  const auto near = std::count_if(part.begin(), part.end(), [&](int i) {
    return std::abs(plane.distance(samples.at(i))) < planeTolerance(samples, i, plane.normal);
  });
  return 10 * static_cast<std::size_t>(near) > 9 * part.size();
}

/// Two sheets of one wall, each seen from another place: so near that drift parts them, and one behind the other.
bool areCopies(const ScanSamples& samples, const PlaneRegion& a, const PlaneRegion& b) {
  if (a.normal.dot(b.normal) < std::cos(kBend_rad) || std::abs(a.normal.z()) > std::sin(kBend_rad)) return false;
  if (std::abs(a.distance(b.middle)) > bounds::kSameSurface_m) return false;
  const Eigen::Vector3d u = Eigen::Vector3d::UnitZ().cross(a.normal).normalized();
  const auto of_a = cellsOf(samples, a, u), of_b = cellsOf(samples, b, u);
  const auto shared = std::count_if(of_b.begin(), of_b.end(), [&](const auto& c) { return of_a.count(c); });
  return 2 * static_cast<std::size_t>(shared) > of_b.size();
}

/// How far frames are turned against each other, 1 sigma, as the copies of large walls show; 0 where none is doubled.
double registrationStd(const ScanSamples& samples, const std::vector<PlaneRegion>& regions) {
  double squares = 0, weights = 0;
  for (std::size_t a = 0; a < regions.size(); ++a) {  // largest first
    for (std::size_t b = a + 1; b < regions.size() && regions[b].area_m2 > kWall_m2; ++b) {
      if (!areCopies(samples, regions[a], regions[b])) continue;
      const double between_rad = quarter(yawOf(regions[a]) - yawOf(regions[b]));
      squares += regions[b].area_m2 * between_rad * between_rad / 2, weights += regions[b].area_m2;
    }
  }
  return weights > 0 ? std::sqrt(squares / weights) : 0;
}

/// A scanner that drifts bends a long wall, so that it grows in pieces that turn by a degree or two. A piece that goes
/// on where a larger one ends is of that wall where one plane holds both.
void joinBentWalls(const ScanSamples& samples, std::vector<PlaneRegion>& regions) {
  std::vector<char> joined(regions.size(), 0);
  for (std::size_t a = 0; a < regions.size(); ++a) {  // largest first
    PlaneRegion& wall = regions[a];
    if (joined[a] || wall.area_m2 < kWall_m2 || std::abs(wall.normal.z()) > std::sin(kBend_rad)) continue;
    for (std::size_t b = a + 1; b < regions.size(); ++b) {
      const PlaneRegion& piece = regions[b];
      if (joined[b] || piece.normal.dot(wall.normal) < std::cos(kBend_rad)) continue;
      if (std::abs(wall.distance(piece.middle)) > kFarthest_m || !goesOn(samples, wall, piece)) continue;
      PlaneRegion both = wall;
      both.samples.insert(both.samples.end(), piece.samples.begin(), piece.samples.end());
      std::sort(both.samples.begin(), both.samples.end());
      fitPlane(samples, kFarthest_m, both);
      if (!holdsPart(samples, both, wall.samples) || !holdsPart(samples, both, piece.samples)) continue;
      wall = std::move(both);
      joined[b] = 1;
    }
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (!joined[i] && kept++ != i) regions[kept - 1] = std::move(regions[i]);
  }
  regions.resize(kept);
}

}  // namespace

double regularise(const ScanSamples& samples, bool enabled, std::vector<PlaneRegion>& regions) {
  if (!samples.oriented) turnInwards(samples, regions);
  joinBentWalls(samples, regions);
  // No plane is known better than the place that it was seen from.
  const double registration_rad = registrationStd(samples, regions);
  for (PlaneRegion& r : regions) r.angle_std_rad = std::hypot(r.angle_std_rad, registration_rad);
  const double direction = mainDirection(regions);
  for (PlaneRegion& r : regions) {
    const Eigen::Vector3d before = r.normal;
    const double limit = std::max(3 * r.angle_std_rad, 0.05 * bounds::kDegree);
    const double height = std::asin(std::clamp(r.normal.z(), -1.0, 1.0));  // of the normal above the level
    // Floors and walls are level and upright to a degree; what leans more does so on purpose.
    const double lean = std::min(std::max(limit, 1 * bounds::kDegree), 4 * bounds::kDegree);
    if (M_PI / 2 - std::abs(height) < lean) {
      r.normal = Eigen::Vector3d(0, 0, r.normal.z() > 0 ? 1 : -1);
    } else if (std::abs(height) < lean) {
      double yaw = yawOf(r);
      const double off = quarter(yaw - direction);
      if (enabled && std::abs(off) < std::min(limit, 6 * bounds::kDegree)) yaw -= off;
      r.normal = Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0);
    } else {
      continue;
    }
    r.turned_rad = std::acos(std::min(1.0, before.dot(r.normal)));
    r.offset_m = r.normal.dot(r.middle);
    fitOffset(samples, r);
    measurePlane(samples, r);
  }
  return direction;
}

}  // namespace mmradartwin
