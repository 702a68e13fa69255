// Image search in geometry of its own: expected regions come from scene and pose alone and share nothing with
// the simulator but facets and occlusion, so that an error of the simulator's geometry shows as a residual
// (docs/reference/contracts.md section 6).

#include "mirror_image.h"

#include <algorithm>
#include <cmath>

#include "fresnel_aperture.h"
#include "mmradartwin_sim/seen_sides.h"

namespace mmradartwin {
namespace {

constexpr double kOnPlane_m = 1e-7;
constexpr std::size_t kMaxMirrors = 300;  // the largest facets; the search grows with the third power of their number

Eigen::Vector3d mirrored(const Eigen::Vector3d& p, const Facet& f) { return p - 2 * f.planeDistance(p) * f.normal; }

// Finds where the straight line from p to its image meets the facet; false where it passes beside the facet's
// rectangle.
bool crossing(const Facet& f, const Eigen::Vector3d& p, const Eigen::Vector3d& image, Eigen::Vector3d& vertex) {
  const double here = f.planeDistance(p), there = f.planeDistance(image);
  if (!(here * there < 0) || std::abs(here) < kOnPlane_m || std::abs(there) < kOnPlane_m) return false;
  vertex = p + here / (here - there) * (image - p);
  const Eigen::Vector3d q = vertex - f.origin;
  const double x = q.dot(f.e1), y = q.dot(f.e2);
  return x >= 0 && y >= 0 && x <= f.size1_m && y <= f.size2_m;
}

// Fresnel aperture factor of a facet that a path meets at a vertex, d1 and d2 [m] along the path from either end. The
// facet's sides are projected across the ray.
double apertureFactor(const Facet& f, const Eigen::Vector3d& vertex, const Eigen::Vector3d& ray, double d1, double d2,
                      double wavelength_m) {
  const double scale = std::sqrt(2 * (d1 + d2) / (wavelength_m * d1 * d2));
  const auto axis = [&](const Eigen::Vector3d& e, double size) {
    const double along = e.dot(ray), across = scale * std::sqrt(std::max(0.0, 1 - along * along));
    const double x = e.dot(vertex - f.origin);
    return fresnelAperture(-x * across, (size - x) * across);
  };
  return axis(f.e1, f.size1_m) * axis(f.e2, f.size2_m);
}

}  // namespace

MirrorSearch::MirrorSearch(const Scene& scene, const RayCaster& rays, double wavelength_m)
    : scene_(scene), rays_(rays), wavelength_m_(wavelength_m) {
  for (const Facet& f : scene.facets) {
    if (!f.reflects || !f.present || f.actor < 0) continue;
    Mirror m;
    m.facet = &f;
    m.corners << f.origin, f.origin + f.size1_m * f.e1, f.origin + f.size1_m * f.e1 + f.size2_m * f.e2,
        f.origin + f.size2_m * f.e2;
    mirrors_.push_back(m);
  }
  std::stable_sort(mirrors_.begin(), mirrors_.end(),
                   [](const Mirror& a, const Mirror& b) { return a.facet->area_m2 > b.facet->area_m2; });
  if (mirrors_.size() > kMaxMirrors) mirrors_.resize(kMaxMirrors);
}

std::vector<MirrorImage> MirrorSearch::find(const Eigen::Isometry3d& T_map_radar, int max_order, double max_length_m,
                                            double max_elevation_rad) const {
  const Eigen::Vector3d radar = T_map_radar.translation();
  const Eigen::Isometry3d T_radar_map = T_map_radar.inverse();
  const double max_sine = std::sin(max_elevation_rad);
  const auto inView = [&](const Eigen::Vector3d& vertex) {
    const Eigen::Vector3d p = T_radar_map * vertex;
    return p.x() > 0 && std::abs(p.z()) <= max_sine * p.norm();
  };
  std::vector<char> ahead;
  for (const Mirror& m : mirrors_) {
    ahead.push_back((T_radar_map.linear().row(0) * (m.corners.colwise() - radar)).maxCoeff() > 0);
  }
  std::vector<MirrorImage> found;
  const SeenSides sides(scene_, radar);
  // Finds the vertices from the last mirror to the first, then checks that each leg is free.
  const auto solve = [&](const std::vector<const Facet*>& sequence, const std::vector<Eigen::Vector3d>& images) {
    const int order = static_cast<int>(sequence.size());
    MirrorImage path;
    path.vertices.resize(sequence.size());
    Eigen::Vector3d at = radar;
    for (int i = order - 1; i >= 0; --i) {
      if (!crossing(*sequence[i], at, images[i], path.vertices[i]) ||
          (!sequence[i]->rectangle && !sequence[i]->contains(path.vertices[i]))) {
        return;
      }
      at = path.vertices[i];
    }
    if (!inView(path.vertices.front()) || !inView(path.vertices.back())) return;
    for (int i = 0; i < order; ++i) {
      const Eigen::Vector3d& v = path.vertices[i];
      if (!sides.isOpen(*sequence[i], v, i == 0 ? radar : path.vertices[i - 1]) ||
          !sides.isOpen(*sequence[i], v, i + 1 == order ? radar : path.vertices[i + 1])) {
        return;
      }
    }
    path.length_m = (images.back() - radar).norm();
    path.aperture = 1;
    double before = 0;
    for (int i = 0; i <= order; ++i) {
      const Eigen::Vector3d& a = i == 0 ? radar : path.vertices[i - 1];
      const Eigen::Vector3d& b = i == order ? radar : path.vertices[i];
      const double leg = (b - a).norm();
      if (leg < 1e-2 || !rays_.visible(a, b, 2e-3)) return;
      before += leg;
      if (i == order) break;
      path.aperture *= apertureFactor(*sequence[i], b, (b - a) / leg, before, path.length_m - before, wavelength_m_);
      path.facets.push_back(sequence[i]->id);
    }
    found.push_back(path);
  };
  Eigen::Vector3d vertex;
  for (std::size_t a = 0; a < mirrors_.size(); ++a) {
    const Facet& fa = *mirrors_[a].facet;
    const double da = fa.planeDistance(radar);
    if (!ahead[a] || std::abs(da) < kOnPlane_m) continue;
    const Eigen::Vector3d first = mirrored(radar, fa);
    for (std::size_t b = 0; b < mirrors_.size(); ++b) {
      if (b == a) continue;
      const Facet& fb = *mirrors_[b].facet;
      const double side = da > 0 ? 1 : -1;
      if (side * fa.planeDistance(fb.origin) < kOnPlane_m &&
          (side * (fa.normal.transpose() * (mirrors_[b].corners.colwise() - fa.origin))).maxCoeff() < kOnPlane_m) {
        continue;  // behind the first mirror
      }
      const Eigen::Vector3d second = mirrored(first, fb);
      if (ahead[b] && std::abs(fa.normal.dot(fb.normal)) > 2e-3 && (second - radar).norm() <= max_length_m &&
          crossing(fb, radar, second, vertex)) {
        solve({&fa, &fb}, {first, second});
      }
      if (max_order < 3) continue;
      for (std::size_t c = 0; c < mirrors_.size(); ++c) {
        if (c == b || !ahead[c]) continue;
        const Facet& fc = *mirrors_[c].facet;
        const Eigen::Vector3d third = mirrored(second, fc);
        if ((third - radar).squaredNorm() > max_length_m * max_length_m || !crossing(fc, radar, third, vertex))
          continue;
        solve({&fa, &fb, &fc}, {first, second, third});
      }
    }
  }
  return found;
}

}  // namespace mmradartwin
