#include "mmradartwin_sim/law_variable.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr double kDegrees = 180 / M_PI;

double azimuth_deg(const Eigen::Vector3d& direction) { return kDegrees * std::atan2(direction.y(), direction.x()); }

/// Distance of c from the segment a-b in the floor plan.
double planDistance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d from = a.head<2>(), way = b.head<2>() - from;
  const double share = std::clamp((c - from).dot(way) / std::max(1e-12, way.squaredNorm()), 0.0, 1.0);
  return (from + share * way - c).norm();
}

/// Of the first reflection; of a scatter point, on the facet that it lies on; -1 where neither is.
double incidenceCosine(const LawVariable::Where& where, const PathRecord& record) {
  const auto first =
      std::find_if(record.reflection_cosine.begin(), record.reflection_cosine.end(), [](double c) { return c >= 0; });
  if (first != record.reflection_cosine.end()) return std::min(1.0, *first);
  if (record.bounces != 1 || record.facets.empty() || record.facets[0] < 0 || record.vertices.empty()) return -1;
  const Eigen::Vector3d way = record.vertices[0] - where.T_map_radar.translation();
  const Facet& facet = where.scene.facets[static_cast<std::size_t>(record.facets[0])];
  return std::min(1.0, std::abs(way.dot(facet.normal)) / std::max(1e-9, way.norm()));
}

/// Of the path's first point, or its first on an actor, along its upright facet, from the middle of the facet's actor;
/// nothing where it has none.
LawVariable::Values foot(const LawVariable::Where& where, const PathRecord& record, int actor) {
  std::size_t at = 0;
  const std::size_t points = std::min(record.facets.size(), record.vertices.size());
  const auto facetAt = [&](std::size_t i) -> const Facet& {
    return where.scene.facets[static_cast<std::size_t>(record.facets[i])];
  };
  while (actor >= 0 && at < points && (record.facets[at] < 0 || facetAt(at).actor != actor)) ++at;
  if (at >= points || record.facets[at] < 0) return {};
  const Facet& facet = facetAt(at);
  const Eigen::Vector2d along = Eigen::Vector3d::UnitZ().cross(facet.normal).head<2>();
  if (along.norm() < 0.7 || facet.actor < 0 || facet.curved >= 0) return {};  // it lies, or has no length
  const Eigen::Vector3d middle = where.scene.actors[static_cast<std::size_t>(facet.actor)].bounds.center();
  return {1, {along.normalized().dot((record.vertices[at] - middle).head<2>()), 0}};
}

}  // namespace

const std::vector<std::string>& LawVariable::names() {
  static const std::vector<std::string> kNames = {"range_m",     "azimuth_deg", "incidence_deg", "height_m",
                                                  "heading_deg", "bearing_deg", "time_s",        "amplitude_db",
                                                  "foot_m",      "standing_m",  "passing_m",     "distance_m"};
  return kNames;
}

bool LawVariable::isAboutPlace(const std::string& name) { return name == "passing_m" || name == "distance_m"; }

std::string LawVariable::meaning() {
  return "range_m (half the path), azimuth_deg (of departure and of arrival, whose mean counts), incidence_deg (of the "
         "first reflection, or of the path on its scatter point; other paths stay as they are), height_m (of the radar "
         "in map), heading_deg (of the radar in map, -180 to 180), bearing_deg (of the arriving echo in map, -180 to "
         "180), time_s (after the session's first pose), amplitude_db (of the echo, 0 is the session's strongest), "
         "foot_m (where the path meets the law's actor, or else its first face, if upright, along it, from the middle "
         "of the face's actor; other paths stay as they are), standing_m (of the radar in the floor plan, from map's "
         "origin along bearing_deg), passing_m (at which the path passes x_m, y_m in the floor plan) or distance_m (of "
         "the radar from x_m, y_m in the floor plan)";
}

LawVariable::LawVariable(const std::string& name, const About& about)
    : place_(about.x_m, about.y_m),
      along_(std::cos(about.bearing_deg / kDegrees), std::sin(about.bearing_deg / kDegrees)),
      actor_(about.actor) {
  const auto at = std::find(names().begin(), names().end(), name);
  if (at == names().end()) {
    std::string known;
    for (const std::string& n : names()) known += (known.empty() ? "" : ", ") + n;
    throw InputError("mechanism empirical_law: key variable: '" + name + "' is unknown; allowed: " + known);
  }
  kind_ = static_cast<Kind>(at - names().begin());
}

LawVariable::Values LawVariable::of(const Where& where, const PathRecord& record) const {
  switch (kind_) {
    case Kind::kRange:
      return {1, {0.5 * record.length_m[0], 0}};
    case Kind::kAzimuth:
      return {2, {azimuth_deg(record.departure), azimuth_deg(record.arrival)}};
    case Kind::kIncidence: {
      const double cosine = incidenceCosine(where, record);
      return cosine < 0 ? Values{} : Values{1, {kDegrees * std::acos(cosine), 0}};
    }
    case Kind::kHeight:
      return {1, {where.T_map_radar.translation().z(), 0}};
    case Kind::kHeading:
      return {1, {azimuth_deg(where.T_map_radar.linear().col(0)), 0}};
    case Kind::kBearing:
      return {1, {azimuth_deg(where.T_map_radar.linear() * record.arrival), 0}};
    case Kind::kTime:
      return {1, {where.session_s, 0}};
    case Kind::kAmplitude:
      if (!(where.strongest_amplitude > 0) || !(record.amplitude > 0)) return {};
      return {1, {20 * std::log10(record.amplitude / where.strongest_amplitude), 0}};
    case Kind::kFoot:
      return foot(where, record, actor_);
    case Kind::kStanding:
      return {1, {along_.dot(where.T_map_radar.translation().head<2>()), 0}};
    case Kind::kDistance:
      return {1, {(where.T_map_radar.translation().head<2>() - place_).norm(), 0}};
    case Kind::kPassing:
      break;
  }
  if (record.vertices.empty()) return {};
  const Eigen::Vector3d radar = where.T_map_radar.translation();
  double nearest = planDistance_m(record.vertices.back(), radar, place_);
  for (std::size_t i = 0; i < record.vertices.size(); ++i) {
    nearest = std::min(nearest, planDistance_m(i > 0 ? record.vertices[i - 1] : radar, record.vertices[i], place_));
  }
  return {1, {nearest, 0}};
}

}  // namespace mmradartwin
