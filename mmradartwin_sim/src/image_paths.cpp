#include "image_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace mmradartwin {
namespace {

constexpr double kInside_m = 1e-9;
constexpr double kOnPlane_m = 1e-7;

/// Gap at the ends of a leg: a merged facet of a scan lies off the triangles that Embree sees.
double legGap(const Facet& facet, const Eigen::Vector3d& direction) {
  const double cosine = std::max(0.1, std::abs(facet.normal.dot(direction)));
  return std::max(1e-3, 2 * facet.flatness_m / cosine);
}

}  // namespace

ImageSearch::ImageSearch(const Scene& scene, bool all_orientations) : scene_(scene) {
  for (const Facet& f : scene.facets) {
    if (!f.present || f.curved >= 0 || !(f.reflects || all_orientations)) continue;
    reflectors_.push_back(f.id);
    Corners c;
    c.point << f.origin, f.origin + f.size1_m * f.e1, f.origin + f.size1_m * f.e1 + f.size2_m * f.e2,
        f.origin + f.size2_m * f.e2;
    corners_.push_back(c);
    planes_.push_back({f.normal, f.origin});
  }
  if (exhaustiveOrder() < 3) return;
  const int count = static_cast<int>(reflectors_.size());
  on_side_.resize(2 * reflectors_.size());
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < count; ++b) {
      for (int side : {0, 1}) {
        if (faces(a, side == 1, b)) on_side_[static_cast<std::size_t>(2 * a + side)].push_back(b);
      }
    }
  }
}

int ImageSearch::exhaustiveOrder() const {
  const double n = static_cast<double>(reflectors_.size());
  if (n * n * n < 5e8) return 3;
  return n * n < 4e6 ? 2 : 1;
}

bool ImageSearch::faces(int a, bool positive_side, int b) const {
  const Facet& plane = scene_.facets[reflectors_[a]];
  const Eigen::RowVector4d d = plane.normal.transpose() * (corners_[b].point.colwise() - plane.origin);
  return positive_side ? d.maxCoeff() > kOnPlane_m : d.minCoeff() < -kOnPlane_m;
}

bool ImageSearch::insideBeam(const Eigen::Vector3d& apex, int through, int target) const {
  const auto& window = corners_[through].point;
  const Eigen::Vector3d center = 0.25 * (window.col(0) + window.col(1) + window.col(2) + window.col(3)) - apex;
  for (int i = 0; i < 4; ++i) {
    Eigen::Vector3d n = (window.col(i) - apex).cross(window.col((i + 1) % 4) - apex);
    if (n.dot(center) < 0) n = -n;
    if ((n.transpose() * (corners_[target].point.colwise() - apex)).maxCoeff() < -1e-9) return false;
  }
  return true;
}

bool ImageSearch::solve(const Eigen::Vector3d& p, const std::vector<int>& sequence, const RayCaster& rays,
                        const Limits& limits, ImagePath& path) const {
  const int order = static_cast<int>(sequence.size());
  if (order < 1 || order > 8) return false;
  std::array<Eigen::Vector3d, 8> image;
  image.fill(p);
  Eigen::Vector3d at = p;
  for (int i = 0; i < order; ++i) image[i] = at = mirror(at, scene_.facets[sequence[i]]);
  if ((image[order - 1] - p).norm() > limits.max_length_m) return false;
  std::array<Eigen::Vector3d, 8> vertex = image;
  at = p;
  for (int i = order - 1; i >= 0; --i) {
    const Facet& f = scene_.facets[sequence[i]];
    const double here = f.planeDistance(at), there = f.planeDistance(image[i]);
    if (!(here * there < 0) || std::abs(here) < kOnPlane_m || std::abs(there) < kOnPlane_m) return false;
    vertex[i] = at + here / (here - there) * (image[i] - at);
    if (!f.contains(vertex[i], kInside_m)) return false;
    at = vertex[i];
  }
  if (limits.in_view &&
      (!limits.in_view((vertex[0] - p).normalized()) || !limits.in_view((vertex[order - 1] - p).normalized()))) {
    return false;
  }
  for (int i = 0; i <= order; ++i) {
    const Eigen::Vector3d& a = i == 0 ? p : vertex[i - 1];
    const Eigen::Vector3d& b = i == order ? p : vertex[i];
    const Eigen::Vector3d d = b - a;
    const double length = d.norm();
    if (length < 1e-9) return false;
    double gap = 1e-3;
    if (i > 0) gap = std::max(gap, legGap(scene_.facets[sequence[i - 1]], d / length));
    if (i < order) gap = std::max(gap, legGap(scene_.facets[sequence[i]], d / length));
    if (!rays.visible(a, b, gap)) return false;
  }
  path.facets = sequence;
  path.vertices.assign(vertex.begin(), vertex.begin() + order);
  path.image = image[order - 1];
  return true;
}

std::vector<ImagePath> ImageSearch::find(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                                         int min_order) const {
  std::vector<ImagePath> found;
  const int count = static_cast<int>(reflectors_.size());
  ImagePath path;
  // Facets that can be first or last: some of them lies in front of the radar.
  std::vector<char> in_front(static_cast<std::size_t>(count), 1);
  if (limits.forward.squaredNorm() > 0) {
    for (int a = 0; a < count; ++a) {
      in_front[a] = (limits.forward.transpose() * (corners_[a].point.colwise() - p)).maxCoeff() > 0;
    }
  }
  std::vector<double> from_radar;  // distance of p from each plane
  for (const Plane& plane : planes_) from_radar.push_back(plane.normal.dot(p - plane.origin));
  // The last facet is tried by where the straight line from p to the image meets its plane, which is cheap.
  const auto meetsLast = [&](int b, const Eigen::Vector3d& image_before) {
    const Facet& f = scene_.facets[reflectors_[b]];
    const double there = -f.planeDistance(image_before), here = f.planeDistance(p);
    if (!(here * there < 0)) return false;
    const Eigen::Vector3d image = image_before + 2 * there * f.normal;
    const Eigen::Vector3d q = p + here / (here - there) * (image - p) - f.origin;
    const double x = q.dot(f.e1), y = q.dot(f.e2);
    return x > -1e-6 && y > -1e-6 && x < f.size1_m + 1e-6 && y < f.size2_m + 1e-6;
  };
  for (int a = 0; a < count; ++a) {
    if (!in_front[a]) continue;
    const Facet& fa = scene_.facets[reflectors_[a]];
    const double da = fa.planeDistance(p);
    if (std::abs(da) < kOnPlane_m) continue;
    if (min_order <= 1 && solve(p, {fa.id}, rays, limits, path)) found.push_back(path);
    if (limits.max_order < 2) continue;
    const Eigen::Vector3d image1 = mirror(p, fa);
    for (int b = 0; b < count; ++b) {
      if (b == a || !faces(a, da > 0, b) || !insideBeam(image1, a, b)) continue;
      const Facet& fb = scene_.facets[reflectors_[b]];
      const double db = fb.planeDistance(image1);
      if (std::abs(db) < kOnPlane_m) continue;
      if (min_order <= 2 && in_front[b] && !perpendicular(fa, fb) && meetsLast(b, image1) &&
          solve(p, {fa.id, fb.id}, rays, limits, path)) {
        found.push_back(path);
      }
      if (limits.max_order < 3) continue;
      const Eigen::Vector3d image2 = mirror(image1, fb);
      // The way on from b stays on the side that it came from.
      for (int c : on_side_[static_cast<std::size_t>(2 * b + (db > 0))]) {
        const Plane& plane = planes_[static_cast<std::size_t>(c)];
        if (!(from_radar[static_cast<std::size_t>(c)] * plane.normal.dot(image2 - plane.origin) > 0)) continue;
        if (c == b || !in_front[c] || !meetsLast(c, image2)) continue;
        if (solve(p, {fa.id, fb.id, reflectors_[c]}, rays, limits, path)) found.push_back(path);
      }
    }
  }
  // Where the line to an image runs through an edge, several orders of the same facets are one path.
  std::vector<ImagePath> unique;
  for (const ImagePath& f : found) {
    std::vector<int> set = f.facets;
    std::sort(set.begin(), set.end());
    bool known = false;
    for (const ImagePath& u : unique) {
      if (u.facets.size() != f.facets.size() || f.facets.size() < 2 || (u.image - f.image).norm() > 1e-6) continue;
      std::vector<int> other = u.facets;
      std::sort(other.begin(), other.end());
      known = known || other == set;
    }
    if (!known) unique.push_back(f);
  }
  return unique;
}

std::vector<ImageSearch::Seed> ImageSearch::seeds(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                                                  int rays_launched, const Eigen::Matrix3d& R_map_radar,
                                                  double max_elevation_rad) const {
  std::map<std::vector<int>, bool> sequences;  // and whether an even ray met it
  const double golden = 0.6180339887498949;
  for (int i = 0; i < rays_launched; ++i) {
    const double azimuth = M_PI * ((i + 0.5) / rays_launched - 0.5);
    const double elevation = std::asin(std::sin(max_elevation_rad) * (2 * std::fmod(i * golden, 1.0) - 1));
    Eigen::Vector3d d = R_map_radar * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    Eigen::Vector3d from = p;
    std::vector<int> sequence;
    double length = 0;
    while (static_cast<int>(sequence.size()) < limits.max_order) {
      const auto hit = rays.firstHit(from, d, limits.max_length_m - length);
      if (!hit || hit->facet < 0) break;
      const Facet& f = scene_.facets[hit->facet];
      if (!f.reflects || !f.present || f.curved >= 0) break;
      sequence.push_back(f.id);
      bool& even = sequences[sequence];
      even = even || i % 2 == 0;
      length += hit->distance_m;
      d -= 2 * d.dot(f.normal) * f.normal;
      const double side = f.planeDistance(from) > 0 ? 1.0 : -1.0;
      from = hit->point + (1e-4 + f.flatness_m) * side * f.normal;
    }
  }
  std::vector<Seed> found;
  for (const auto& [facets, even] : sequences) found.push_back({facets, even});
  return found;
}

}  // namespace mmradartwin
