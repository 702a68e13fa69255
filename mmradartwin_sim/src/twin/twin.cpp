#include "mmradartwin_sim/twin.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "rays/view_cone.h"
#include "twin/assembled_twin.h"

namespace mmradartwin {
namespace {

/// True where something stands in the way of a path from the radar and back.
bool hides(const RayCaster& screen, const Eigen::Vector3d& radar, const PathRecord& r) {
  Eigen::Vector3d from = radar;
  for (const Eigen::Vector3d& v : r.vertices) {
    if (!screen.visible(from, v)) return true;
    from = v;
  }
  return r.vertices.size() > 1 && !screen.visible(from, radar);  // from a single point back on the way there
}

}  // namespace

Twin::Twin(TwinDescription description, std::uint64_t seed) : impl_(new AssembledTwin) {
  AssembledTwin& m = *impl_;
  m.description = std::move(description);
  m.seed = seed;
  m.scene = loadScene(m.description.scene_file, m.description.radar.center_frequency_hz());
  m.rays = std::make_shared<RayCaster>(m.scene);
  m.assemble();
}

Twin::Twin(std::unique_ptr<AssembledTwin> impl) : impl_(std::move(impl)) {}

Twin Twin::changed(std::vector<NamedParameters> mechanisms) const {
  auto other = std::make_unique<AssembledTwin>();
  other->description = impl_->description;
  other->description.mechanisms = std::move(mechanisms);
  other->seed = impl_->seed;
  other->scene = impl_->scene;
  other->rays = impl_->rays;
  other->strongest = impl_->strongest;
  other->session_ns = impl_->session_ns;
  other->reported = impl_->reported;
  other->assemble();
  return Twin(std::move(other));
}

bool Twin::altersGeometry() const { return impl_->edited || impl_->movesRadar(); }

std::optional<SceneChange> Twin::changesFrom(const Twin& other) const {
  const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
  if (impl_->poseLag_s() != other.impl_->poseLag_s() ||
      !impl_->modelPose(here, 0).isApprox(other.impl_->modelPose(here, 0), 0)) {
    return std::nullopt;
  }
  SceneChange change;
  const auto compare = [&](const std::vector<Actor>& a, const std::vector<Actor>& b, std::size_t known) {
    for (std::size_t i = 0; i < std::max(a.size(), b.size()); ++i) {
      if (i < a.size() && i < b.size() && isSame(a[i], b[i])) continue;
      if (i < known) change.actors.push_back(static_cast<int>(i));
      for (const std::vector<Actor>* list : {&a, &b}) {
        if (i >= list->size()) continue;
        Eigen::AlignedBox3d bounds;
        for (const Eigen::Vector3d& v : (*list)[i].vertices) bounds.extend(v);
        change.addBounds(bounds);
      }
    }
  };
  compare(impl_->model().actors, other.impl_->model().actors, impl_->scene.actors.size());
  compare(impl_->model().occluders_only, other.impl_->model().occluders_only, 0);
  return change;
}

std::optional<Twin::PlacedActor> Twin::placesOneActor() const {
  if (!impl_->edited || impl_->movesRadar() || !impl_->edited->occluders_only.empty()) return std::nullopt;
  const std::vector<Actor>&before = impl_->scene.actors, &after = impl_->edited->actors;
  std::optional<PlacedActor> placed;
  for (std::size_t i = 0; i < after.size(); ++i) {
    const bool added = i >= before.size();
    if (!added && isSame(before[i], after[i])) continue;
    Actor moved = after[i];
    if (!added) moved.vertices = before[i].vertices;
    if (placed || !after[i].present || (!added && !isSame(before[i], moved))) return std::nullopt;
    placed = {added ? -1 : static_cast<int>(i), after[i].occludes};
  }
  return placed;
}

bool Twin::removesActors() const {
  if (!impl_->edited) return false;
  const std::vector<Actor>&before = impl_->scene.actors, &after = impl_->edited->actors;
  return !std::equal(before.begin(), before.end(), after.begin(),
                     [](const Actor& a, const Actor& b) { return !a.occludes || b.occludes || !b.present; });
}

bool Twin::addsOccludersOnly() const {
  return impl_->occluders_only && impl_->only_occluders_added && !impl_->movesRadar();
}

void Twin::removeHidden(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord>& records,
                        std::int64_t stamp_ns) const {
  if (!impl_->occluders_only) return;
  const Eigen::Vector3d radar = impl_->modelPose(T_map_radar, stamp_ns).translation();
  const auto hidden = [&](const PathRecord& r) { return hides(*impl_->occluders_only, radar, r); };
  records.erase(std::remove_if(records.begin(), records.end(), hidden), records.end());
}

Twin::~Twin() = default;
Twin::Twin(Twin&&) noexcept = default;

const TwinDescription& Twin::description() const { return impl_->description; }
const RadarConfig& Twin::radar() const { return impl_->description.radar; }
const Scene& Twin::scene() const { return impl_->scene; }
const Scene& Twin::tracedScene() const { return impl_->model(); }
const RayCaster& Twin::rays() const { return *impl_->rays; }
void Twin::setStrongestAmplitude(double amplitude) { impl_->strongest = amplitude; }

void Twin::setSession(const std::vector<Pose>& poses) {
  impl_->session_ns.clear();
  for (const Pose& p : poses) impl_->session_ns.push_back(p.stamp_ns);
  std::sort(impl_->session_ns.begin(), impl_->session_ns.end());
  impl_->reported = trajectoryOf(poses);
  for (const auto& m : impl_->mechanisms) {
    const auto* stage = dynamic_cast<const TransportStage*>(m.get());
    const std::string only = stage ? stage->onlyPose() : std::string();
    if (only.empty() || std::any_of(poses.begin(), poses.end(), [&only](const Pose& p) { return p.name == only; })) {
      continue;
    }
    throw InputError(description().file + ": mechanism " + m->name() + ": key pose: the session has no pose " + only);
  }
}

void Twin::setTrajectory(Trajectory reported) { impl_->reported = std::move(reported); }

std::vector<std::string> Twin::notes() const {
  std::vector<std::string> notes;
  for (const auto& m : impl_->mechanisms) {
    for (std::string& note : m->notes()) notes.push_back(std::move(note));
  }
  return notes;
}

void Twin::prepare(const std::vector<Eigen::Isometry3d>& poses) {
  if (!impl_->stages.needs_strongest || impl_->strongest >= 0) return;
  std::vector<double> best(poses.size(), 0);
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
    try {
      std::vector<PathRecord> records = trace(poses[i]);
      const PoseContext c = impl_->context(poses[i]);
      impl_->reweight(c, records, 0);
      best[i] = impl_->strongestOf(c, records);
    } catch (const InputError&) {
      // An unusable pose is reported when it is simulated.
    }
  });
  for (double b : best) impl_->strongest = std::max(impl_->strongest, b);
}

std::vector<PathRecord> Twin::trace(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns,
                                    const ScatterCells* cloud) const {
  PoseContext c = impl_->context(T_map_radar, stamp_ns);
  c.cloud = cloud;
  impl_->refuseUnusablePose(c);
  std::vector<PathRecord> records;
  for (const auto& [stage, m] : impl_->stages.paths) {
    if (!m->needsStrongestAmplitude()) impl_->addPaths(*stage, c, records);
  }
  return records;
}

std::vector<PathRecord> Twin::trace(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                    const ScatterCells* cloud) const {
  PoseContext c = impl_->context(T_map_radar);
  c.cloud = cloud;
  impl_->refuseUnusablePose(c);
  const PathStage* wanted = impl_->pathStage(mechanism);
  std::vector<PathRecord> records;
  if (!wanted || impl_->as_described[mechanism]->needsStrongestAmplitude()) return records;
  const std::vector<std::string> beside = wanted->looksAtPathsOf();
  for (const auto& [stage, m] : impl_->stages.paths) {
    if (stage == wanted) break;  // of those that it looks at, all act before it
    if (std::find(beside.begin(), beside.end(), m->name()) != beside.end()) impl_->addPaths(*stage, c, records);
  }
  const auto known = static_cast<std::ptrdiff_t>(records.size());
  impl_->addPaths(*wanted, c, records);
  records.erase(records.begin(), records.begin() + known);
  return records;
}

std::vector<PathRecord> Twin::retrace(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                      const ScatterCells& cloud, const SceneChange& change,
                                      const std::vector<PathRecord>& known) const {
  const PathStage* wanted = impl_->pathStage(mechanism);
  if (!wanted || !wanted->tracesChanges()) return trace(mechanism, T_map_radar, &cloud);
  PoseContext c = impl_->context(T_map_radar);
  impl_->refuseUnusablePose(c);
  ScatterCells::CellSet touched;
  ScatterCells cells = cloud;
  cells.touched = &touched;
  c.cloud = &cells;
  c.change = &change;
  std::vector<PathRecord> records;
  impl_->addPaths(*wanted, c, records);
  for (const PathRecord& r : known) {
    if (r.actors.size() == 1 && r.actors[0] >= 0 && !change.moved(r.actors[0]) &&
        touched.count(cells.cellOf(r.facets[0], r.vertices[0])) == 0) {
      records.push_back(r);
    }
  }
  return records;
}

std::vector<PathRecord> Twin::traceAround(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                          const ScatterCells& cloud, const PlacedActor& placed,
                                          const std::vector<PathRecord>& without) const {
  const PathStage* wanted = impl_->pathStage(mechanism);
  if (!wanted || !wanted->looksAtPathsOf().empty()) return trace(mechanism, T_map_radar, &cloud);
  PoseContext c = impl_->context(T_map_radar);
  impl_->refuseUnusablePose(c);
  const Scene& scene = impl_->model();
  c.only_actor = placed.actor >= 0 ? placed.actor : static_cast<int>(scene.actors.size()) - 1;
  c.cloud = &cloud;
  std::vector<PathRecord> records;
  wanted->addPaths(c, records);
  const auto others = [&](const PathRecord& r) {
    return std::find(r.actors.begin(), r.actors.end(), c.only_actor) == r.actors.end();
  };
  records.erase(std::remove_if(records.begin(), records.end(), others), records.end());
  impl_->nameAddedActors(records, 0);
  const Eigen::Vector3d radar = c.T_map_radar.translation();
  const ViewCones cones(radar, {scene.actors[static_cast<std::size_t>(c.only_actor)].bounds});
  const RayCaster& screen = impl_->alone(c.only_actor);
  for (const PathRecord& r : without) {
    const bool beside = r.vertices.size() == 1 && !cones.mayMeet(r.vertices[0] - radar);
    if (beside || !placed.hides || !hides(screen, radar, r)) records.push_back(r);
  }
  return records;
}

std::vector<PathRecord> Twin::receivedPaths(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord> traced,
                                            std::int64_t stamp_ns) const {
  PoseContext c = impl_->context(T_map_radar, stamp_ns);
  c.receiver_gain = [this, &c](double length_m) { return impl_->toneGain(c, length_m); };
  return impl_->filtered(c, impl_->weighted(c, std::move(traced)));
}

bool Twin::hasReceiveStage() const { return !impl_->stages.receive.empty() || !impl_->stages.distortions.empty(); }

std::optional<Eigen::MatrixXcd> Twin::channelMatrix(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) const {
  if (!impl_->stages.distortions.empty()) return std::nullopt;
  const PoseContext c = impl_->context(T_map_radar, stamp_ns);
  const int channels = c.radar.channels(), samples = c.radar.samples_per_chirp;
  const auto answer = [&](int channel, double cycles) {
    ComplexGrid x = ComplexGrid::Zero(channels, samples);
    for (int n = 0; channel >= 0 && n < samples; ++n) x(channel, n) = std::polar(1.0, 2 * M_PI * cycles * n / samples);
    impl_->receive(c, x);
    return x;
  };
  if (!answer(-1, 0).isZero(0)) return std::nullopt;
  Eigen::MatrixXcd matrix(channels, channels);
  constexpr double kCycles[] = {3.3, 17.9};  // a tone that comes back changed, or that another one changes, shows here
  for (int k = 0; k < channels; ++k) {
    for (double cycles : kCycles) {
      const ComplexGrid x = answer(k, cycles);
      if (cycles == kCycles[0]) matrix.col(k) = x.col(0);
      for (int n = 0; n < samples; ++n) {
        const std::complex<double> tone = std::polar(1.0, 2 * M_PI * cycles * n / samples);
        if ((x.col(n) - matrix.col(k) * tone).norm() > 1e-9 * (1 + matrix.col(k).norm())) return std::nullopt;
      }
    }
  }
  return matrix;
}

Simulation Twin::weigh(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord> traced,
                       std::int64_t stamp_ns) const {
  PoseContext c = impl_->context(T_map_radar, stamp_ns);
  c.receiver_gain = [this, &c](double length_m) { return impl_->toneGain(c, length_m); };
  Simulation s;
  s.stamp_ns = stamp_ns;
  s.T_map_radar = T_map_radar;
  s.records = impl_->weighted(c, std::move(traced));

  const RadarConfig& radar = impl_->description.radar;
  s.grid.stamp_ns = stamp_ns;
  s.grid.source = Branch::kSimulated;
  s.grid.full_scale = 1;
  s.grid.frames = 1;
  s.grid.pose_valid = true;
  s.grid.T_map_radar = T_map_radar;
  accumulate(radar, s.records, s.grid.x);
  if (s.records.empty()) s.grid.x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  s.check = checkRecords(radar, s.records, s.grid.x);
  s.propagation_only = impl_->propagatesOnly();
  if (!impl_->stages.tones.empty() || !impl_->stages.distortions.empty()) {
    s.grid.x.setZero();
    impl_->propagate(c, impl_->filtered(c, s.records), s.grid.x);
  }
  impl_->receive(c, s.grid.x);
  return s;
}

Simulation Twin::simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) const {
  return weigh(T_map_radar, trace(T_map_radar, stamp_ns), stamp_ns);
}

}  // namespace mmradartwin
