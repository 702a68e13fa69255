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

/// Cosine of incidence at the first reflection, or of a scatter point on its facet; -1 where the path has neither.
double incidenceCosine(const LawVariable::PathPlace& where, const PathRecord& record) {
  const auto first =
      std::find_if(record.reflection_cosine.begin(), record.reflection_cosine.end(), [](double c) { return c >= 0; });
  if (first != record.reflection_cosine.end()) return std::min(1.0, *first);
  if (record.bounces != 1 || record.facets.empty() || record.facets[0] < 0 || record.vertices.empty()) return -1;
  const Eigen::Vector3d way = record.vertices[0] - where.T_map_radar.translation();
  const Facet& facet = where.scene.facets[static_cast<std::size_t>(record.facets[0])];
  return std::min(1.0, std::abs(way.dot(facet.normal)) / std::max(1e-9, way.norm()));
}

/// Place of the path's first point (or first point on `actor`) along its upright facet, from the middle of the facet's
/// actor; nothing where there is none.
LawVariable::Values foot(const LawVariable::PathPlace& where, const PathRecord& record, int actor) {
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

/// Least distance of the path from a place in the floor plan; nothing where the path meets no point.
LawVariable::Values passing(const LawVariable::PathPlace& where, const PathRecord& record,
                            const Eigen::Vector2d& place) {
  if (record.vertices.empty()) return {};
  const Eigen::Vector3d radar = where.T_map_radar.translation();
  double nearest = planDistance_m(record.vertices.back(), radar, place);
  for (std::size_t i = 0; i < record.vertices.size(); ++i) {
    nearest = std::min(nearest, planDistance_m(i > 0 ? record.vertices[i - 1] : radar, record.vertices[i], place));
  }
  return {1, {nearest, 0}};
}

}  // namespace

/// One variable: its name, what it means, whether it has a place x_m, y_m, and its values.
struct LawVariable::Row {
  std::string name, meaning;
  bool about_place;
  Values (*values)(const LawVariable& variable, const PathPlace& where, const PathRecord& record);
};

const std::vector<LawVariable::Row>& LawVariable::table() {
  using Variable = const LawVariable&;
  using Place = const PathPlace&;
  using Record = const PathRecord&;
  static const std::vector<Row> kTable = {
      {"range_m", "half the path", false,
       [](Variable, Place, Record record) -> Values {
         return {1, {0.5 * record.length_m[0], 0}};
       }},
      {"azimuth_deg", "of departure and of arrival, whose mean counts", false,
       [](Variable, Place, Record record) -> Values {
         return {2, {azimuth_deg(record.departure), azimuth_deg(record.arrival)}};
       }},
      {"incidence_deg", "of the first reflection, or of the path on its scatter point; other paths stay as they are",
       false,
       [](Variable, Place where, Record record) -> Values {
         const double cosine = incidenceCosine(where, record);
         return cosine < 0 ? Values{} : Values{1, {kDegrees * std::acos(cosine), 0}};
       }},
      {"height_m", "of the radar in map", false,
       [](Variable, Place where, Record) -> Values {
         return {1, {where.T_map_radar.translation().z(), 0}};
       }},
      {"heading_deg", "of the radar in map, -180 to 180", false,
       [](Variable, Place where, Record) -> Values {
         return {1, {azimuth_deg(where.T_map_radar.linear().col(0)), 0}};
       }},
      {"bearing_deg", "of the arriving echo in map, -180 to 180", false,
       [](Variable, Place where, Record record) -> Values {
         return {1, {azimuth_deg(where.T_map_radar.linear() * record.arrival), 0}};
       }},
      {"time_s", "after the session's first pose", false,
       [](Variable, Place where, Record) -> Values {
         return {1, {where.session_s, 0}};
       }},
      {"amplitude_db", "of the echo, 0 is the session's strongest", false,
       [](Variable, Place where, Record record) -> Values {
         if (!(where.strongest_amplitude > 0) || !(record.amplitude > 0)) return {};
         return {1, {20 * std::log10(record.amplitude / where.strongest_amplitude), 0}};
       }},
      {"total_power_db", "of all of the pose's echoes together, 0 is the session's strongest echo", false,
       [](Variable, Place where, Record) -> Values {
         if (!(where.strongest_amplitude > 0) || !(where.paths_power > 0)) return {};
         return {1, {10 * std::log10(where.paths_power) - 20 * std::log10(where.strongest_amplitude), 0}};
       }},
      {"foot_m",
       "where the path meets the law's actor, or else its first face, if upright, along it, from the middle of the "
       "face's actor; other paths stay as they are",
       false,
       [](Variable variable, Place where, Record record) -> Values { return foot(where, record, variable.actor_); }},
      {"standing_m", "of the radar in the floor plan, from map's origin along bearing_deg", false,
       [](Variable variable, Place where, Record) -> Values {
         return {1, {variable.along_.dot(where.T_map_radar.translation().head<2>()), 0}};
       }},
      {"passing_m", "at which the path passes x_m, y_m in the floor plan", true,
       [](Variable variable, Place where, Record record) -> Values { return passing(where, record, variable.place_); }},
      {"distance_m", "of the radar from x_m, y_m in the floor plan", true,
       [](Variable variable, Place where, Record) -> Values {
         return {1, {(where.T_map_radar.translation().head<2>() - variable.place_).norm(), 0}};
       }}};
  return kTable;
}

const std::vector<std::string>& LawVariable::names() {
  static const std::vector<std::string> kNames = [] {
    std::vector<std::string> names;
    for (const Row& row : table()) names.push_back(row.name);
    return names;
  }();
  return kNames;
}

bool LawVariable::isAboutPlace(const std::string& name) {
  return std::any_of(table().begin(), table().end(),
                     [&name](const Row& row) { return row.name == name && row.about_place; });
}

std::string LawVariable::meaning() {
  std::string text;
  for (const Row& row : table()) {
    text += (text.empty() ? "" : (&row == &table().back() ? " or " : ", ")) + row.name + " (" + row.meaning + ")";
  }
  return text;
}

LawVariable::LawVariable(const std::string& name, const ReferencePlace& about)
    : place_(about.x_m, about.y_m),
      along_(std::cos(about.bearing_deg / kDegrees), std::sin(about.bearing_deg / kDegrees)),
      actor_(about.actor) {
  const auto found = std::find_if(table().begin(), table().end(), [&name](const Row& row) { return row.name == name; });
  if (found == table().end()) {
    std::string known;
    for (const std::string& n : names()) known += (known.empty() ? "" : ", ") + n;
    throw InputError("mechanism empirical_law: key variable: '" + name + "' is unknown; allowed: " + known);
  }
  row_ = &*found;
}

LawVariable::Values LawVariable::of(const PathPlace& where, const PathRecord& record) const {
  return row_->values(*this, where, record);
}

}  // namespace mmradartwin
