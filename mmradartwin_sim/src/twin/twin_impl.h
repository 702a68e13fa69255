#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <vector>

#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Invariants of records and the grid that accumulate() made of them, by another arithmetic.
RecordCheck checkRecords(const RadarConfig& radar, const std::vector<PathRecord>& records, const ComplexGrid& x);

struct Twin::Impl {
  TwinDescription description;
  std::uint64_t seed;
  Scene scene;  // as described
  std::shared_ptr<const RayCaster> rays;
  std::unique_ptr<Scene> edited;  // null where no mechanism edits the scene
  std::unique_ptr<RayCaster> edited_rays;
  std::unique_ptr<RayCaster> screens;                  // of the screens alone; null where there are none
  bool screens_alone = false;                          // are all that was added
  std::vector<std::unique_ptr<Mechanism>> mechanisms;  // by rank
  std::vector<const Mechanism*> as_described;          // the same by Twin::description()
  double strongest = -1;                               // of the session, where it is known
  mutable std::atomic<double> strongest_so_far{0};
  mutable std::once_flag alone_made;
  mutable std::unique_ptr<RayCaster> alone_rays;
  bool has_tone_gain = false, has_receive = false, has_distort = false, has_replicas = false, needs_strongest = false;
  bool has_chirp_paths = false, has_modulation = false, has_chirp_stage = false, has_digitise = false,
       has_transport = false;
  std::vector<std::int64_t> session_ns;  // stamps of the session's poses in order of time
  Trajectory reported;                   // null where nothing is known

  /// Makes the mechanisms of the description and all that follows from them; scene and rays are there.
  void assemble();

  /// The mechanism's paths. What it meets that a mechanism put into the room has no index that others know: it is -1.
  void addPaths(const Mechanism& mechanism, const PoseContext& c, std::vector<PathRecord>& records) const {
    const std::size_t known = records.size();
    mechanism.addPaths(c, records);
    nameAddedActors(records, known);
  }
  void nameAddedActors(std::vector<PathRecord>& records, std::size_t from) const {
    if (model().actors.size() == scene.actors.size()) return;
    for (std::size_t i = from; i < records.size(); ++i) {
      for (int& actor : records[i].actors) actor = actor < static_cast<int>(scene.actors.size()) ? actor : -1;
    }
  }
  /// Rays that meet one actor of model() alone; made at the first call.
  const RayCaster& alone(int actor) const {
    std::call_once(alone_made, [&] {
      Scene only;
      only.screens = {model().actors[static_cast<std::size_t>(actor)]};
      alone_rays = std::make_unique<RayCaster>(only);
    });
    return *alone_rays;
  }

  const Scene& model() const { return edited ? *edited : scene; }
  const RayCaster& modelRays() const { return edited_rays ? *edited_rays : *rays; }

  /// True where a mechanism moves the radar.
  bool movesRadar() const {
    const Eigen::Isometry3d here = Eigen::Isometry3d::Identity();
    return poseLag_s() != 0 || !modelPose(here, 0).isApprox(here, 0);
  }
  double poseLag_s() const {
    double lag_s = 0;
    for (const auto& m : mechanisms) lag_s += m->poseLag_s();
    return lag_s;
  }

  Eigen::Isometry3d modelPose(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) const {
    Eigen::Isometry3d T = T_map_radar;
    if (const double lag_s = poseLag_s(); lag_s != 0 && reported) {
      // What is true now is reported later.
      const auto now = reported(stamp_ns), later = reported(stamp_ns + std::llround(lag_s * 1e9));
      if (now && later) T = T * (now->inverse() * *later);
    }
    for (const auto& m : mechanisms) T = m->pose(T);
    return T;
  }

  PoseContext context(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0) const {
    const RadarConfig& radar = description.radar;
    PoseContext c{radar,
                  model(),
                  modelRays(),
                  modelPose(T_map_radar, stamp_ns),
                  radar.center_frequency_hz(),
                  radar.max_range_m(),
                  seed,
                  [this] { return strongest >= 0 ? strongest : strongest_so_far.load(); },
                  {}};
    if (!session_ns.empty()) {
      c.session_s = static_cast<double>(stamp_ns - session_ns.front()) * 1e-9;
      c.pose_count = static_cast<int>(session_ns.size());
      c.pose_index =
          static_cast<int>(std::lower_bound(session_ns.begin(), session_ns.end(), stamp_ns) - session_ns.begin());
    }
    return c;
  }

  double toneGain(const PoseContext& c, double length_m) const {
    double gain = 1;
    for (const auto& m : mechanisms) {
      if (m->hasToneGain()) gain *= std::abs(m->toneGain(c, length_m));
    }
    return gain;
  }

  void reweight(const PoseContext& c, std::vector<PathRecord>& records, std::size_t from) const {
    for (std::size_t i = from; i < records.size(); ++i) {
      for (const auto& m : mechanisms) m->reweight(c, records[i]);
    }
  }

  /// Adds to weighted paths what they bring along (Mechanism::replicate).
  void addReplicas(const PoseContext& c, std::vector<PathRecord>& records) const {
    if (!has_replicas) return;
    const std::size_t echoes = records.size();
    for (const auto& m : mechanisms) {
      for (std::size_t i = 0; m->hasReplicas() && i < echoes; ++i) {
        PathRecord replica = records[i];
        if (m->replicate(c, replica)) records.push_back(std::move(replica));
      }
    }
  }

  /// Throws InputError for a pose that is NaN or inside an actor.
  void refuseUnusablePose(const PoseContext& c) const;
  /// Adds to weighted paths those whose level is relative to the strongest echo, and replicas of all.
  void addRelativePaths(const PoseContext& c, std::vector<PathRecord>& records) const;

  /// Paths after all weights, with those whose level is relative to the strongest echo.
  std::vector<PathRecord> weighted(const PoseContext& c, std::vector<PathRecord> records) const;

  /// Paths as the receiver's filters leave them; the same records where there are no filters.
  std::vector<PathRecord> filtered(const PoseContext& c, std::vector<PathRecord> records) const {
    if (!has_tone_gain) return records;
    for (PathRecord& r : records) filter(c, r);
    return records;
  }
  void filter(const PoseContext& c, PathRecord& r) const {
    if (!has_tone_gain) return;
    for (std::size_t k = 0; k < r.c.size(); ++k) {
      for (const auto& m : mechanisms) {
        if (m->hasToneGain()) r.c[k] *= m->toneGain(c, r.length_m[k]);
      }
    }
  }

  /// Grid of filtered paths before receive().
  void propagate(const PoseContext& c, const std::vector<PathRecord>& filtered_paths, ComplexGrid& x) const {
    accumulate(c.radar, filtered_paths, x);
    if (!has_distort) return;
    for (const auto& m : mechanisms) {
      if (m->hasDistortStage()) m->distort(c, filtered_paths, x);
    }
  }

  void receive(const PoseContext& c, ComplexGrid& x) const {
    if (!has_receive) return;
    for (const auto& m : mechanisms) {
      if (m->hasReceiveStage()) m->receive(c, x);
    }
  }

  double strongestOf(const PoseContext& c, const std::vector<PathRecord>& records) const {
    double best = 0;
    for (const PathRecord& r : records) {
      best = std::max(best, has_tone_gain ? r.amplitude * toneGain(c, r.length_m[0]) : r.amplitude);
    }
    return best;
  }
};

}  // namespace mmradartwin
