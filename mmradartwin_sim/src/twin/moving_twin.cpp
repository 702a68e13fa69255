#include "mmradartwin_sim/moving_twin.h"

#include <algorithm>

#include "mmradartwin_dsp/input_error.h"
#include "rays/view_cone.h"
#include "twin/assembled_twin.h"

namespace mmradartwin {
namespace {

constexpr double kStands_m = 1e-9;  // roundings of a transform are no move
constexpr int kUpdates = 64;        // before rounding of differences is thrown away
constexpr double kCancelled = 1e3;  // a difference so much above what is left leaves too few digits

void addSum(const PoseContext& context, const std::vector<PathRecord>& filtered, ComplexGrid& x) {
  if (x.size() == 0) x = ComplexGrid::Zero(context.radar.channels(), context.radar.samples_per_chirp);
  accumulate(context.radar, filtered, x);
}

}  // namespace

MovingTwin::MovingTwin(const Twin& twin, const std::vector<std::string>& actors)
    : twin_(new Twin(twin.changed(twin.description().mechanisms))) {
  AssembledTwin& m = *twin_->impl_;
  std::vector<int> movable;
  for (const std::string& name : actors) {
    const int actor = m.scene.actorIndex(name);
    if (actor < 0) throw InputError("actor " + name + " cannot move: the scene has no actor of that name");
    if (std::find(movable.begin(), movable.end(), actor) != movable.end()) continue;
    movable.push_back(actor);
    movers_.push_back({actor});
  }
  if (!m.edited) m.edited = std::make_unique<Scene>(m.scene);
  rest_ = *m.edited;
  m.edited_rays = std::make_unique<RayCaster>(*m.edited, movable);
  for (const auto& mechanism : m.mechanisms) mechanism->build(*m.edited, m.description.radar);
  parts_.resize(m.stages.paths.size());
}

MovingTwin::~MovingTwin() = default;
MovingTwin::MovingTwin(MovingTwin&&) noexcept = default;

void MovingTwin::place(const std::string& actor, const Eigen::Isometry3d& T_map_actor) {
  const int index = rest_.actorIndex(actor);
  const auto mover = std::find_if(movers_.begin(), movers_.end(), [&](const Mover& m) { return m.actor == index; });
  if (mover == movers_.end()) throw InputError("actor " + actor + " is not among those that move");
  if (!T_map_actor.matrix().allFinite()) throw InputError("the transform of actor " + actor + " is not a number");
  mover->wanted = T_map_actor * rest_.actors[static_cast<std::size_t>(index)].T_map_mesh.inverse();
  const double moved = (mover->wanted.matrix() - mover->moved.matrix()).cwiseAbs().maxCoeff();
  if (moved < kStands_m) mover->wanted = mover->moved;
  placed_ =
      std::any_of(movers_.begin(), movers_.end(), [](const Mover& m) { return m.wanted.matrix() != m.moved.matrix(); });
}

SceneChange MovingTwin::moveActors() {
  AssembledTwin& m = *twin_->impl_;
  Scene& scene = *m.edited;
  SceneChange change;
  bool rebuild = false;
  const std::map<int, FacetShape> uncut_before = scene.uncut;
  for (Mover& mover : movers_) {
    if (mover.wanted.matrix() == mover.moved.matrix()) continue;
    const auto a = static_cast<std::size_t>(mover.actor);
    Actor& actor = scene.actors[a];
    change.actors.push_back(mover.actor);
    change.addBounds(actor.bounds);
    // From where it was at rest, so that roundings do not add up.
    const Actor& at_rest = rest_.actors[a];
    actor.vertices = at_rest.vertices;
    for (int id : at_rest.facets) {
      scene.facets[static_cast<std::size_t>(id)] = rest_.facets[static_cast<std::size_t>(id)];
      const auto shape = rest_.uncut.find(id);
      if (shape != rest_.uncut.end()) scene.uncut[id] = shape->second;
    }
    for (std::size_t i = 0; i < scene.curved.size(); ++i) {
      if (scene.curved[i].actor == mover.actor) scene.curved[i] = rest_.curved[i];
    }
    moveActor(scene, mover.actor, mover.wanted);
    mover.moved = mover.wanted;
    change.addBounds(actor.bounds);
    if (!actor.present) continue;
    if (actor.occludes) {
      m.edited_rays->place(mover.actor, mover.moved * mover.built.inverse());
    } else {
      rebuild = true;
    }
  }
  placed_ = false;
  // What a mover covered, or covers now, has another shape.
  for (const std::map<int, FacetShape>* uncut :
       std::initializer_list<const std::map<int, FacetShape>*>{&uncut_before, &scene.uncut}) {
    if (change.actors.empty()) break;
    for (const auto& [id, shape] : *uncut) {
      const int owner = scene.facets[static_cast<std::size_t>(id)].actor;
      if (change.moved(owner)) continue;
      change.actors.push_back(owner);
      change.addBounds(scene.actors[static_cast<std::size_t>(owner)].bounds);
      rebuild = true;
    }
  }
  if (rebuild) {
    std::vector<int> movable;
    for (Mover& mover : movers_) {
      movable.push_back(mover.actor);
      mover.built = mover.moved;
    }
    m.edited_rays = std::make_unique<RayCaster>(scene, movable);
  }
  if (!change.actors.empty()) {
    for (const auto& mechanism : m.mechanisms) mechanism->sceneChanged(scene, m.description.radar, change);
  }
  return change;
}

void MovingTwin::trace(const PoseContext& context, const SceneChange* change) {
  const AssembledTwin& m = *twin_->impl_;
  std::vector<PathRecord> before = std::move(simulation_.records);
  std::vector<PathRecord>& records = simulation_.records;
  records.clear();
  records.reserve(before.size());
  found_ = 0;
  std::vector<PathRecord> gone, fresh;
  const Eigen::Vector3d radar = context.T_map_radar.translation();
  const ViewCones cones(radar, change ? change->bounds : std::vector<Eigen::AlignedBox3d>());
  const auto touched = [&](const PathRecord& r) {
    if (r.vertices.size() == 1 && r.actors.size() == 1 && !cones.mayMeet(r.vertices[0] - radar)) {
      return change->moved(r.actors[0]);
    }
    return change->touches(radar, r);
  };
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const auto& [stage, mechanism] = m.stages.paths[i];
    Part& part = parts_[i];
    const bool partly = change && stage->tracesChanges();
    PoseContext c = context;
    c.change = partly ? change : nullptr;
    const std::size_t begin = records.size();
    gone.clear();
    if (partly) {
      for (std::size_t k = part.begin; k < part.end; ++k) {
        (touched(before[k]) ? gone : records).push_back(std::move(before[k]));
      }
    } else {
      part.sum.setZero(context.radar.channels(), context.radar.samples_per_chirp);
    }
    const std::size_t kept = records.size();
    if (!mechanism->needsStrongestAmplitude()) m.addPaths(*stage, c, records);
    m.reweight(c, records, kept);
    found_ += records.size() - kept;
    part.begin = begin;
    part.end = records.size();
    fresh.assign(records.begin() + static_cast<std::ptrdiff_t>(kept), records.end());
    addSum(c, m.filtered(c, std::move(fresh)), part.sum);
    if (gone.empty()) continue;
    for (PathRecord& r : gone) {
      for (auto& value : r.c) value = -value;
    }
    ComplexGrid difference;
    addSum(c, m.filtered(c, std::move(gone)), difference);
    part.sum += difference;
    if (difference.norm() > kCancelled * part.sum.norm()) updates_ = kUpdates;
  }
  echoes_ = records.size();
}

void MovingTwin::sumAll(const PoseContext& context) {
  const AssembledTwin& m = *twin_->impl_;
  std::vector<PathRecord> paths;
  for (Part& part : parts_) {
    const auto first = simulation_.records.begin();
    paths.assign(first + static_cast<std::ptrdiff_t>(part.begin), first + static_cast<std::ptrdiff_t>(part.end));
    part.sum.setZero(context.radar.channels(), context.radar.samples_per_chirp);
    addSum(context, m.filtered(context, std::move(paths)), part.sum);
  }
}

const Simulation& MovingTwin::simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) {
  AssembledTwin& m = *twin_->impl_;
  const bool was_valid = valid_;
  valid_ = false;
  const SceneChange change = placed_ ? moveActors() : SceneChange();
  PoseContext c = m.context(T_map_radar, stamp_ns);
  const bool stands = was_valid && T_map_radar.matrix() == simulation_.T_map_radar.matrix() &&
                      c.T_map_radar.matrix() == traced_at_.matrix();
  traced_at_ = c.T_map_radar;
  c.receiver_gain = [&m, &c](double length_m) { return m.toneGain(c, length_m); };
  simulation_.stamp_ns = stamp_ns;
  simulation_.T_map_radar = T_map_radar;
  simulation_.propagation_only = m.propagatesOnly();
  simulation_.records.resize(std::min(simulation_.records.size(), echoes_));

  const bool moved = !change.actors.empty();
  found_ = 0;
  if (!stands || moved) {
    m.refuseUnusablePose(c);
    trace(c, stands ? &change : nullptr);
  }
  (!stands ? counts_.traced : (moved ? counts_.updated : counts_.reused)) += 1;
  if (!stands) updates_ = 0;
  bool checked = !stands;
  if (stands && moved && ++updates_ >= kUpdates) {
    sumAll(c);
    updates_ = 0;
    checked = true;
  }
  m.addRelativePaths(c, simulation_.records);
  const std::vector<PathRecord>& records = simulation_.records;
  const std::vector<PathRecord> relative(records.begin() + static_cast<std::ptrdiff_t>(echoes_), records.end());

  ReceiveGrid& grid = simulation_.grid;
  grid.stamp_ns = stamp_ns;
  grid.source = Branch::kSimulated;
  grid.full_scale = 1;
  grid.frames = 1;
  grid.pose_valid = true;
  grid.T_map_radar = T_map_radar;
  grid.x.setZero(c.radar.channels(), c.radar.samples_per_chirp);
  for (const Part& part : parts_) grid.x += part.sum;
  addSum(c, m.filtered(c, relative), grid.x);
  if (checked) {
    ComplexGrid sum = grid.x;
    if (!m.stages.tones.empty()) {
      sum.setZero();
      accumulate(c.radar, records, sum);
    }
    simulation_.check = checkRecords(c.radar, records, sum);
  }
  if (!m.stages.distortions.empty()) {
    grid.x.setZero();
    m.propagate(c, m.filtered(c, records), grid.x);
  }
  m.receive(c, grid.x);
  valid_ = true;
  return simulation_;
}

}  // namespace mmradartwin
