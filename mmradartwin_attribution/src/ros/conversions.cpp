#include "mmradartwin_attribution/ros/conversions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <set>
#include <sstream>
#include <string_view>

#include "ledger_fields.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

const std::string* interned(const std::string& name) {
  static std::mutex mutex;
  static std::set<std::string> names;
  const std::lock_guard<std::mutex> lock(mutex);
  return &*names.insert(name).first;
}

mmradartwin_msgs::FindingParameter toMsg(const FindingParameter& p) {
  mmradartwin_msgs::FindingParameter msg;
  msg.name = p.name;
  msg.unit = p.unit;
  if (const auto* number = std::get_if<double>(&p.value)) msg.value = {*number};
  if (const auto* numbers = std::get_if<std::vector<double>>(&p.value)) msg.value = *numbers;
  if (const auto* text = std::get_if<std::string>(&p.value)) msg.text = {*text};
  if (const auto* texts = std::get_if<std::vector<std::string>>(&p.value)) msg.text = *texts;
  for (const std::array<double, 2>& interval : p.ci95) {
    msg.ci95_low.push_back(interval[0]);
    msg.ci95_high.push_back(interval[1]);
  }
  return msg;
}

mmradartwin_msgs::FindingPlace toMsg(const FindingPlace& place) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr std::array<double, 2> kNowhere = {kNone, kNone};
  mmradartwin_msgs::FindingPlace msg;
  msg.range_min_m = place.range_m.value_or(kNowhere)[0];
  msg.range_max_m = place.range_m.value_or(kNowhere)[1];
  msg.azimuth_min_rad = place.azimuth_deg.value_or(kNowhere)[0] * M_PI / 180;
  msg.azimuth_max_rad = place.azimuth_deg.value_or(kNowhere)[1] * M_PI / 180;
  msg.x_m = place.x_m.value_or(kNone);
  msg.y_m = place.y_m.value_or(kNone);
  msg.actors = place.actors;
  msg.poses = place.poses;
  return msg;
}

mmradartwin_msgs::Finding toMsg(const Finding& finding) {
  const CauseDescription& cause = causeDescription(finding.cause);
  mmradartwin_msgs::Finding msg;
  msg.cause = finding.cause;
  msg.residual_class = className(cause.residual_class);
  msg.action = cause.action();
  msg.description = finding.description.value_or("");
  // The finding itself is the first of its candidates; others of its cause have other parameters.
  const auto own = std::find_if(finding.candidates.begin(), finding.candidates.end(),
                                [&](const CauseProbability& c) { return c.cause == finding.cause; });
  if (own != finding.candidates.end()) msg.probability = own->probability;
  msg.false_alarm_rate = finding.evidence.false_alarm_rate;
  msg.log_likelihood_gain = finding.evidence.log_likelihood_gain;
  const GainMetric explained = finding.gain ? finding.gain->explained_power : GainMetric();
  msg.explained_power_before = explained.before;
  msg.explained_power_after = explained.after;
  for (const FindingParameter& p : finding.parameters) msg.parameters.push_back(toMsg(p));
  for (const FindingPlace& place : finding.where) msg.where.push_back(toMsg(place));
  msg.json = toJson(finding);
  return msg;
}

constexpr std::uint8_t kResidualSource = 2;  // see RangeAngleMap.msg

mmradartwin_msgs::RangeAngleMap mapOf(const EvaluationField& field, const RealGrid& levels_db, std::uint8_t source,
                                      const Eigen::Isometry3d& T_map_radar) {
  mmradartwin_msgs::RangeAngleMap msg;
  msg.source = source;
  msg.range_m = field.axes().range_m;
  msg.azimuth_rad = field.axes().azimuth_rad;
  msg.power_db.assign(levels_db.data(), levels_db.data() + levels_db.size());
  msg.pose_valid = true;
  msg.T_map_radar = mmradartwin::toMsg(T_map_radar);
  return msg;
}

RegionKind regionKindOf(const std::string& name) {
  for (RegionKind kind : {RegionKind::kFacing, RegionKind::kCorner, RegionKind::kEdge, RegionKind::kImage}) {
    if (regionKindName(kind) == name) return kind;
  }
  return RegionKind::kExtent;
}

/// Tags of the materials of actors joined with ";", joined alike.
std::string materialsOf(const Scene& scene, const std::string& actors) {
  std::string materials;
  std::istringstream names(actors);
  for (std::string name; std::getline(names, name, ';');) {
    const int index = scene.actorIndex(name);
    if (index < 0) continue;
    if (!materials.empty()) materials += ';';
    materials += scene.actors[static_cast<std::size_t>(index)].material_tag;
  }
  return materials;
}

/// Index of the region that a residual names by its actor, the nearest of those; -1 where it names none.
int regionOf(const mmradartwin_msgs::Residuals& msg, const mmradartwin_msgs::Residual& residual) {
  int nearest = -1;
  double nearest_distance = 0;
  for (std::size_t i = 0; i < msg.regions.size() && !residual.actor.empty(); ++i) {
    const mmradartwin_msgs::ResponseRegion& region = msg.regions[i];
    if (region.actor != residual.actor) continue;
    const double distance = std::hypot((residual.range_m - region.range_m) / region.half_range_m,
                                       (residual.azimuth_rad - region.azimuth_rad) / region.half_azimuth_rad);
    if (nearest >= 0 && distance >= nearest_distance) continue;
    nearest = static_cast<int>(i);
    nearest_distance = distance;
  }
  return nearest;
}

Eigen::Vector3d vector(const geometry_msgs::Point& p) { return {p.x, p.y, p.z}; }
Eigen::Vector3d vector(const geometry_msgs::Vector3& p) { return {p.x, p.y, p.z}; }

}  // namespace

mmradartwin_msgs::Residuals toMsg(const EvaluationField& field, const PoseAttribution& pose, const std::string& name,
                                  const Eigen::Isometry3d& T_map_radar) {
  const MatchWindow& tight = field.config().tight;
  mmradartwin_msgs::Residuals msg;
  msg.pose = name;
  msg.T_map_radar = mmradartwin::toMsg(T_map_radar);
  for (const ResponseRegion& r : pose.regions) {
    mmradartwin_msgs::ResponseRegion region;
    region.range_m = r.range_m;
    region.azimuth_rad = r.azimuth_rad;
    region.half_range_m = field.halfRange_m(tight);
    region.half_azimuth_rad = field.halfAzimuth_rad(tight, r.azimuth_rad);
    region.actor = r.actor;
    region.kind = regionKindName(r.kind);
    region.measured_strong = r.measured_strong;
    region.simulated_strong = r.simulated_strong;
    msg.regions.push_back(region);
  }
  for (const Residual& r : pose.residuals) {
    mmradartwin_msgs::Residual residual;
    residual.residual_class = static_cast<std::uint8_t>(r.residual_class);
    residual.action = classAction(r.residual_class);
    residual.measured_stronger = r.measured_stronger;
    residual.range_m = r.range_m;
    residual.azimuth_rad = r.azimuth_rad;
    residual.half_range_m = field.halfRange_m(tight);
    residual.half_azimuth_rad = field.halfAzimuth_rad(tight, r.azimuth_rad);
    residual.measured_db = r.measured_db;
    residual.simulated_db = r.simulated_db;
    residual.actor = r.actor;
    residual.material = r.material;
    residual.records.assign(r.records.begin(), r.records.end());
    msg.residuals.push_back(residual);
  }
  msg.range_m = field.axes().range_m;
  msg.azimuth_rad = field.axes().azimuth_rad;
  const double* begin = pose.residual_db.data();
  msg.residual_db.assign(begin, begin + pose.residual_db.size());
  return msg;
}

mmradartwin_msgs::RangeAngleMap toMsg(const EvaluationField& field, const NormalisedMap& map, Branch source,
                                      const Eigen::Isometry3d& T_map_radar) {
  return mapOf(field, map.level_db.array() + map.peak_db, static_cast<std::uint8_t>(source), T_map_radar);
}

mmradartwin_msgs::RangeAngleMap residualMapMsg(const EvaluationField& field, const PoseAttribution& pose,
                                               const Eigen::Isometry3d& T_map_radar) {
  return mapOf(field, pose.residual_db, kResidualSource, T_map_radar);
}

constexpr double mmradartwin_msgs::Ledger::*fieldOf(std::string_view metric) {
  for (const LedgerField& field : kLedgerFields) {
    if (field.name == metric) return field.member;
  }
  return nullptr;
}

constexpr bool everyMetricHasAField() {
  for (const ResidualMetric& metric : kResidualMetrics) {
    if (fieldOf(metric.name) == nullptr) return false;
  }
  return true;
}
static_assert(everyMetricHasAField(), "Ledger.msg needs a float64 of the name of each residual metric");

mmradartwin_msgs::Ledger toMsg(const LedgerSummary& s, const std::vector<std::string>& duplicates) {
  mmradartwin_msgs::Ledger msg;
  msg.poses = static_cast<std::uint32_t>(s.poses);
  msg.excluded_duplicates = duplicates;
  for (const ResidualMetric& metric : kResidualMetrics) msg.*fieldOf(metric.name) = s.*metric.member;
  msg.recall_near = s.recall_band[0];
  msg.recall_mid = s.recall_band[1];
  msg.recall_far = s.recall_band[2];
  msg.top1 = s.top[0];
  msg.top3 = s.top[1];
  msg.top5 = s.top[2];
  for (int i = 0; i < 5; ++i) msg.class_count[i] = static_cast<std::uint32_t>(s.class_count[i]);
  return msg;
}

mmradartwin_msgs::PoseFigures poseFiguresMsg(const PoseAttribution& pose, const std::string& name) {
  Ledger ledger;
  ledger.add(pose.central);
  mmradartwin_msgs::PoseFigures msg;
  msg.name = name;
  msg.figures = toMsg(ledger.summary(), {});
  double sum = 0;
  int cells = 0;
  for (const double* db = pose.residual_db.data(); db != pose.residual_db.data() + pose.residual_db.size(); ++db) {
    if (!std::isfinite(*db)) continue;
    sum += *db * *db;
    ++cells;
  }
  msg.residual_rms_db = cells > 0 ? std::sqrt(sum / cells) : std::numeric_limits<double>::quiet_NaN();
  return msg;
}

mmradartwin_msgs::Findings toMsg(const Findings& findings) {
  mmradartwin_msgs::Findings msg;
  msg.verdict = findings.verdict();
  for (const Finding& finding : findings.findings) msg.findings.push_back(toMsg(finding));
  msg.json = toJson(findings);
  return msg;
}

PoseAttribution attributionFromMsg(const mmradartwin_msgs::Residuals& msg, const Scene* scene) {
  PoseAttribution pose;
  for (const mmradartwin_msgs::ResponseRegion& m : msg.regions) {
    ResponseRegion region;
    region.range_m = m.range_m;
    region.azimuth_rad = m.azimuth_rad;
    region.kind = regionKindOf(m.kind);
    region.actor = m.actor;
    if (scene) region.material = materialsOf(*scene, m.actor);
    region.measured_strong = m.measured_strong;
    region.simulated_strong = m.simulated_strong;
    pose.regions.push_back(region);
  }
  for (const mmradartwin_msgs::Residual& m : msg.residuals) {
    Residual residual;
    residual.residual_class = static_cast<ResidualClass>(std::clamp<int>(m.residual_class, 1, 5));
    residual.measured_stronger = m.measured_stronger;
    residual.range_m = m.range_m;
    residual.azimuth_rad = m.azimuth_rad;
    residual.measured_db = m.measured_db;
    residual.simulated_db = m.simulated_db;
    residual.actor = m.actor;
    residual.material = m.material;
    residual.records.assign(m.records.begin(), m.records.end());
    residual.region = regionOf(msg, m);
    pose.residuals.push_back(std::move(residual));
  }
  return pose;
}

std::vector<PathRecord> pathsFromMsg(const mmradartwin_msgs::PathRecords& msg, const Scene& scene) {
  std::vector<PathRecord> records;
  records.reserve(msg.records.size());
  for (const mmradartwin_msgs::PathRecord& m : msg.records) {
    PathRecord r;
    r.event = interned(m.event);
    for (const std::string& name : m.actors) r.actors.push_back(scene.actorIndex(name));
    r.facets.assign(m.actors.size(), -1);
    for (const geometry_msgs::Point& v : m.vertices) r.vertices.push_back(vector(v));
    r.departure = vector(m.departure);
    r.arrival = vector(m.arrival);
    r.bounces = static_cast<int>(m.bounces);
    r.range_bin = static_cast<int>(m.range_bin);
    r.amplitude = m.amplitude;
    r.phase_rad = m.phase_rad;
    r.length_m.assign(m.length_m.begin(), m.length_m.end());
    if (m.c_re.size() != m.c_im.size() || m.c_re.size() != m.length_m.size()) {
      throw InputError("path records: record " + std::to_string(records.size()) +
                       " has contributions and lengths of different number; send one of each per virtual element");
    }
    for (std::size_t k = 0; k < m.c_re.size(); ++k) r.c.emplace_back(m.c_re[k], m.c_im[k]);
    records.push_back(std::move(r));
  }
  return records;
}

Scene actorsFromMsg(const mmradartwin_msgs::Scene& msg) {
  Scene scene;
  scene.file = msg.scene_file;
  if (msg.facet_angle_rad != 0 || msg.facet_offset_m != 0) {
    if (!(msg.facet_angle_rad > 0 && msg.facet_offset_m > 0)) {
      throw InputError("scene message: facet_angle_rad and facet_offset_m must both be above 0, or both be 0");
    }
    scene.tolerance = {msg.facet_angle_rad / kDegree, msg.facet_offset_m};
  }
  for (const mmradartwin_msgs::SceneActor& m : msg.actors) {
    Actor actor;
    actor.name = m.name;
    actor.material_tag = m.material;
    actor.material.name = m.material;
    for (int i = 0; i < 3; ++i) actor.material.color[i] = m.color[i];
    if (m.triangles.size() % 3 != 0) {
      throw InputError("scene message: actor " + m.name + " has " + std::to_string(m.triangles.size()) +
                       " corners, which is no whole number of triangles");
    }
    for (const geometry_msgs::Point& p : m.triangles) {
      const Eigen::Vector3d v = vector(p);
      if (!v.allFinite()) throw InputError("scene message: actor " + m.name + " has a corner that is not finite");
      actor.vertices.push_back(v);
      actor.bounds.extend(v);
    }
    for (std::size_t i = 0; i < m.triangles.size() / 3; ++i) {
      const int first = static_cast<int>(3 * i);
      actor.triangles.push_back({first, first + 1, first + 2});
    }
    scene.actors.push_back(std::move(actor));
  }
  return scene;
}

Scene sceneFromMsg(const mmradartwin_msgs::Scene& msg) {
  Scene scene = actorsFromMsg(msg);
  rebuildFacets(scene);
  return scene;
}

}  // namespace mmradartwin
