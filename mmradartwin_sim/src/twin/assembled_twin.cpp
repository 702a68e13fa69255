#include "twin/assembled_twin.h"

#include <sstream>
#include <string>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

void raise(std::atomic<double>& maximum, double value) {
  double known = maximum.load();
  while (value > known && !maximum.compare_exchange_weak(known, value)) {
  }
}

std::string formatPoint(const Eigen::Vector3d& p) {
  std::ostringstream out;
  out << '(' << p.x() << ", " << p.y() << ", " << p.z() << ") m";
  return out.str();
}

}  // namespace

bool isSame(const Actor& a, const Actor& b) {
  return a.present == b.present && a.vertices == b.vertices && a.material_tag == b.material_tag &&
         a.occludes == b.occludes && a.material.scattering_coefficient == b.material.scattering_coefficient;
}

void AssembledTwin::assemble() {
  AssembledTwin& m = *this;
  const RadarConfig& radar = description.radar;
  try {
    for (const NamedParameters& named : m.description.mechanisms) {
      m.mechanisms.push_back(MechanismRegistry::instance().create(named.mechanism));
      m.mechanisms.back()->configure(named.values, m.scene, radar);
      m.as_described.push_back(m.mechanisms.back().get());
    }
    std::stable_sort(m.mechanisms.begin(), m.mechanisms.end(), [](const auto& a, const auto& b) {
      return std::make_pair(a->rank(), a->name()) < std::make_pair(b->rank(), b->name());
    });
    m.stages = StageLists(m.mechanisms);
    m.edited = std::make_unique<Scene>(m.scene);
    for (const SceneStage* stage : m.stages.scene) stage->editScene(*m.edited);
    const bool same = std::equal(m.edited->actors.begin(), m.edited->actors.end(), m.scene.actors.begin(),
                                 m.scene.actors.end(), isSame);
    if (same && m.edited->occluders_only.empty()) {
      m.edited.reset();
    } else {
      m.edited_rays = std::make_unique<RayCaster>(*m.edited);
    }
    if (m.edited && !m.edited->occluders_only.empty()) {
      Scene alone;
      alone.occluders_only = m.edited->occluders_only;
      m.occluders_only = std::make_unique<RayCaster>(alone);
      m.only_occluders_added = same;
    }
    for (const auto& mechanism : m.mechanisms) mechanism->build(m.model(), radar);
  } catch (const InputError& e) {
    throw InputError((m.description.file.empty() ? m.description.scene_file : m.description.file) + ": " + e.what());
  }
}

void AssembledTwin::refuseUnusablePose(const PoseContext& c) const {
  if (!c.T_map_radar.matrix().allFinite()) {
    throw InputError("pose is not a number; correct x, y, z and the quaternion");
  }
  if (const auto inside = c.rays.insideActor(c.T_map_radar.translation())) {
    throw InputError("pose at " + formatPoint(c.T_map_radar.translation()) + " lies inside actor " +
                     c.scene.actors[*inside].name + "; correct the pose or the scene");
  }
}

std::vector<PathRecord> AssembledTwin::weighted(const PoseContext& c, std::vector<PathRecord> records) const {
  reweight(c, records, 0);
  addRelativePaths(c, records);
  return records;
}

void AssembledTwin::addRelativePaths(const PoseContext& c, std::vector<PathRecord>& records) const {
  if (stages.needs_strongest) {
    raise(strongest_so_far, strongestOf(c, records));
    const std::size_t echoes = records.size();
    for (const auto& [stage, m] : stages.paths) {
      if (m->needsStrongestAmplitude()) addPaths(*stage, c, records);
    }
    reweight(c, records, echoes);
  }
  addReplicas(c, records);
}

}  // namespace mmradartwin
