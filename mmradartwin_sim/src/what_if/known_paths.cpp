// What of a twin's known paths a change leaves as it was.

#include <algorithm>
#include <optional>

#include "mmradartwin_sim/mechanism_registry.h"
#include "mmradartwin_sim/what_if.h"
#include "rays/view_cone.h"
#include "twin/assembled_twin.h"

namespace mmradartwin {
namespace {

bool sameShape(const Facet& a, const Facet& b) {
  return a.present == b.present && a.origin == b.origin && a.area_m2 == b.area_m2 && a.size1_m == b.size1_m &&
         a.size2_m == b.size2_m && a.rectangle == b.rectangle && a.e1 == b.e1 && a.e2 == b.e2 && a.layers == b.layers;
}

bool samePlace(const Actor& a, const Actor& b) {
  return a.present == b.present && a.occludes == b.occludes && a.vertices == b.vertices;
}

/// The actors of two scenes that stand elsewhere or have other faces. Nothing where one has actors that the other
/// lacks.
std::optional<SceneChange> changeOfPlaces(const Scene& before, const Scene& now) {
  if (before.actors.size() != now.actors.size() || before.facets.size() != now.facets.size() ||
      before.occluders_only.size() != now.occluders_only.size()) {
    return std::nullopt;
  }
  SceneChange change;
  std::vector<bool> moved(now.actors.size(), false);
  for (std::size_t i = 0; i < now.actors.size(); ++i) moved[i] = !samePlace(before.actors[i], now.actors[i]);
  for (std::size_t i = 0; i < now.facets.size(); ++i) {
    if (!sameShape(before.facets[i], now.facets[i])) moved[static_cast<std::size_t>(now.facets[i].actor)] = true;
  }
  const auto addBounds = [&](const Actor& actor) {
    Eigen::AlignedBox3d bounds;
    for (const Eigen::Vector3d& v : actor.vertices) bounds.extend(v);
    change.addBounds(bounds);
  };
  for (std::size_t i = 0; i < moved.size(); ++i) {
    if (!moved[i]) continue;
    change.actors.push_back(static_cast<int>(i));
    addBounds(before.actors[i]);
    addBounds(now.actors[i]);
  }
  for (std::size_t i = 0; i < now.occluders_only.size(); ++i) {
    if (samePlace(before.occluders_only[i], now.occluders_only[i])) continue;
    addBounds(before.occluders_only[i]);
    addBounds(now.occluders_only[i]);
  }
  return change;
}

/// What of a mechanism its paths depend on, before any weight.
std::string traceKey(const NamedParameters& mechanism) {
  NamedParameters tracing{mechanism.mechanism, {}};
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism.mechanism)->parameters()) {
    if (!s.weighs && mechanism.values.has(s.name)) tracing.values.set(s.name, mechanism.values.all().at(s.name));
  }
  TwinDescription alone;
  alone.mechanisms = {tracing};
  return alone.toYaml();
}

}  // namespace

void WhatIf::findPaths(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) {
  const AssembledTwin& m = *now_->impl_;
  PoseContext c = m.context(T_map_radar, stamp_ns);
  const bool stands = traced_by_ && c.T_map_radar.matrix() == traced_at_.matrix();
  const std::optional<SceneChange> moved =
      stands ? changeOfPlaces(traced_by_->tracedScene(), now_->tracedScene()) : std::nullopt;
  const bool all_anew = !moved;
  const bool none_moved = moved && moved->actors.empty() && moved->bounds.empty();
  std::vector<Material> materials;
  bool same_materials = true;
  if (stands && !all_anew) {
    const std::vector<Actor>&before = traced_by_->tracedScene().actors, &now = now_->tracedScene().actors;
    for (std::size_t i = 0; i < before.size(); ++i) {
      materials.push_back(before[i].material);
      same_materials = same_materials && sameSurface(before[i].material, now[i].material);
    }
  }
  if (!none_moved) m.refuseUnusablePose(c);
  work_ = {};
  std::vector<Part> known = std::move(parts_);
  parts_.clear();
  traced_by_.reset();
  std::vector<std::string> found_anew;  // names of mechanisms
  const Eigen::Vector3d radar = c.T_map_radar.translation();
  for (const PathSource& source : m.stages.paths) {
    const PathStage* stage = source.stage;
    const auto described = static_cast<std::size_t>(
        std::find(m.as_described.begin(), m.as_described.end(), source.mechanism) - m.as_described.begin());
    Part part{traceKey(m.description.mechanisms[described]), {}};
    const auto old = std::find_if(known.begin(), known.end(), [&](const Part& p) { return p.key == part.key; });
    const std::vector<std::string> beside = stage->looksAtPathsOf();
    const bool beside_changed = std::any_of(beside.begin(), beside.end(), [&](const std::string& name) {
      return std::find(found_anew.begin(), found_anew.end(), name) != found_anew.end();
    });
    const bool usable = !all_anew && old != known.end() && !beside_changed;
    if (source.mechanism->needsStrongestAmplitude()) {
      // Its paths are made when weights are known.
    } else if (usable && none_moved && same_materials) {
      part.records = std::move(old->records);
      ++work_.kept;
    } else if (usable && none_moved && stage->changeMaterials(c, materials, old->records)) {
      part.records = std::move(old->records);
      ++work_.reflected;
    } else if (usable && !none_moved && same_materials && stage->tracesChanges()) {
      const ViewCones cones(radar, moved->bounds);
      for (PathRecord& r : old->records) {
        const bool beside_all = r.vertices.size() == 1 && r.actors.size() == 1 &&
                                !cones.mayMeet(r.vertices[0] - radar) && !moved->moved(r.actors[0]);
        if (beside_all || !moved->touches(radar, r)) part.records.push_back(std::move(r));
      }
      PoseContext changed = c;
      changed.change = &*moved;
      m.addPaths(*stage, changed, part.records);
      ++work_.updated;
      found_anew.push_back(source.mechanism->name());
    } else {
      std::vector<PathRecord> records;
      for (std::size_t i = 0; i < parts_.size() && !beside.empty(); ++i) {
        if (std::find(beside.begin(), beside.end(), m.stages.paths[i].mechanism->name()) == beside.end()) continue;
        records.insert(records.end(), parts_[i].records.begin(), parts_[i].records.end());
      }
      const auto others = static_cast<std::ptrdiff_t>(records.size());
      m.addPaths(*stage, c, records);
      part.records.assign(std::make_move_iterator(records.begin() + others), std::make_move_iterator(records.end()));
      ++work_.traced;
      found_anew.push_back(source.mechanism->name());
    }
    parts_.push_back(std::move(part));
  }
  traced_by_ = now_;
  traced_at_ = c.T_map_radar;
}

}  // namespace mmradartwin
