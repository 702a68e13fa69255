#include "mmradartwin_sim/seen_sides.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

constexpr double kOnPlane_m = 1e-5;  // a point this near to a layer lies on it

/// Solid angle of a triangle as seen from the origin, positive where it runs counter-clockwise about the outward normal
/// and the origin lies behind it. Source: Van Oosterom and Strackee 1983.
double solidAngle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

}  // namespace

bool isWithin(const Scene& scene, const ClosedBody& body, const Eigen::Vector3d& point) {
  const Actor& actor = scene.actors[static_cast<std::size_t>(body.actor)];
  if (!actor.bounds.contains(point)) return false;
  double sum = 0;
  for (const auto& t : body.triangles) {
    sum += solidAngle(actor.vertices[static_cast<std::size_t>(t[0])] - point,
                      actor.vertices[static_cast<std::size_t>(t[1])] - point,
                      actor.vertices[static_cast<std::size_t>(t[2])] - point);
  }
  return sum > 2 * M_PI;
}

SeenSides::SeenSides(const Scene& scene, const Eigen::Vector3d& radar)
    : scene_(scene), radar_(radar), holds_radar_(scene.bodies.size(), -1) {}

bool SeenSides::shows(const Facet& facet, const Eigen::Vector3d& towards) const {
  if (facet.body < 0) return true;
  const auto body = static_cast<std::size_t>(facet.body);
  signed char& holds = holds_radar_[body];
  if (holds < 0) holds = isWithin(scene_, scene_.bodies[body], radar_) ? 1 : 0;
  return (facet.outside * facet.planeDistance(towards) < 0) == (holds > 0);
}

bool SeenSides::isOpen(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& towards) const {
  if (!shows(facet, towards)) return false;
  for (int id : facet.layers) {
    const Facet& layer = scene_.facets[static_cast<std::size_t>(id)];
    if (!layer.present) continue;
    if (layer.actor != facet.actor && !scene_.actors[static_cast<std::size_t>(layer.actor)].occludes) continue;
    const double here = layer.planeDistance(point), there = layer.planeDistance(towards);
    if (!(here * there < 0) || std::abs(here) < kOnPlane_m + facet.flatness_m + layer.flatness_m) continue;
    if (layer.contains(point + here / (here - there) * (towards - point))) return false;
  }
  return true;
}

}  // namespace mmradartwin
