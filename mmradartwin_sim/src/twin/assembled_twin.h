#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/trajectory.h"
#include "mmradartwin_sim/twin_description.h"
#include "twin/stage_lists.h"

namespace mmradartwin {

/// Whether an actor was edited shows in what Embree and the facets would see.
bool isSame(const Actor& a, const Actor& b);

/// Scene and mechanisms of a twin, put together, and the steps from a pose to its paths and grid.
struct AssembledTwin {
  TwinDescription description;
  std::uint64_t seed;
  Scene scene;  // as described
  std::shared_ptr<const RayCaster> rays;
  std::unique_ptr<Scene> edited;  // null where no mechanism edits the scene
  std::unique_ptr<RayCaster> edited_rays;
  std::unique_ptr<RayCaster> occluders_only;           // of them alone; null where there are none
  bool only_occluders_added = false;                   // are all that was added
  std::vector<std::unique_ptr<Mechanism>> mechanisms;  // by rank
  std::vector<const Mechanism*> as_described;          // the same by Twin::description()
  StageLists stages;                                   // the same by what they act in
  double strongest = -1;                               // of the session, where it is known
  mutable std::atomic<double> strongest_so_far{0};
  mutable std::once_flag alone_made;
  mutable std::unique_ptr<RayCaster> alone_rays;
  std::vector<std::int64_t> session_ns;  // stamps of the session's poses in order of time
  Trajectory reported;                   // null where nothing is known

  /// Makes the mechanisms of the description and all that follows from them; scene and rays are there.
  void assemble();

  /// The mechanism's paths. What it meets that a mechanism put into the room has no index that others know: it is -1.
  void addPaths(const PathStage& stage, const PoseContext& c, std::vector<PathRecord>& records) const {
    const std::size_t known = records.size();
    stage.addPaths(c, records);
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
      only.occluders_only = {model().actors[static_cast<std::size_t>(actor)]};
      alone_rays = std::make_unique<RayCaster>(only);
    });
    return *alone_rays;
  }

  /// The path stage of a mechanism of Twin::description(); null where it adds no paths.
  const PathStage* pathStage(std::size_t described) const {
    return dynamic_cast<const PathStage*>(as_described[described]);
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
    for (const MountingStage* m : stages.mounting) lag_s += m->poseLag_s();
    return lag_s;
  }

  Eigen::Isometry3d modelPose(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) const {
    Eigen::Isometry3d T = T_map_radar;
    if (const double lag_s = poseLag_s(); lag_s != 0 && reported) {
      // The true pose of now is reported later.
      const auto now = reported(stamp_ns), later = reported(stamp_ns + std::llround(lag_s * 1e9));
      if (now && later) T = T * (now->inverse() * *later);
    }
    for (const MountingStage* m : stages.mounting) T = m->pose(T);
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
    for (const ToneStage* m : stages.tones) gain *= std::abs(m->toneGain(c, length_m));
    return gain;
  }

  void reweight(const PoseContext& c, std::vector<PathRecord>& records, std::size_t from) const {
    if (stages.weights.empty()) return;
    PoseContext of_pose = c;
    for (const PathRecord& r : records) of_pose.paths_power += r.amplitude * r.amplitude;
    for (std::size_t i = from; i < records.size(); ++i) {
      for (const WeightStage* m : stages.weights) m->reweight(of_pose, records[i]);
    }
  }

  /// Adds to weighted paths what they bring along (ReplicaStage).
  void addReplicas(const PoseContext& c, std::vector<PathRecord>& records) const {
    const std::size_t echoes = records.size();
    for (const ReplicaStage* m : stages.replicas) {
      for (std::size_t i = 0; i < echoes; ++i) {
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
    if (stages.tones.empty()) return records;
    for (PathRecord& r : records) {
      for (std::size_t k = 0; k < r.c.size(); ++k) {
        for (const ToneStage* m : stages.tones) r.c[k] *= m->toneGain(c, r.length_m[k]);
      }
    }
    return records;
  }

  /// Grid of filtered paths before receive().
  void propagate(const PoseContext& c, const std::vector<PathRecord>& filtered_paths, ComplexGrid& x) const {
    accumulate(c.radar, filtered_paths, x);
    if (stages.distortions.empty()) return;
    PoseContext with_delay = c;
    for (const WeightStage* m : stages.weights) with_delay.delay_m += m->delay_m();
    for (const DistortionStage* m : stages.distortions) m->distort(with_delay, filtered_paths, x);
  }

  void receive(const PoseContext& c, ComplexGrid& x) const {
    for (const ReceiveStage* m : stages.receive) m->receive(c, x);
  }

  /// True where the receiver does nothing: the grid is the sum of its records.
  bool propagatesOnly() const { return stages.tones.empty() && stages.receive.empty() && stages.distortions.empty(); }

  /// A grid [M][N] and, where a stage modulates chirps, the same with every path weighted by its delay in s.
  struct DelayedGrid {
    ComplexGrid x, delayed;
  };
  /// Memory that is used again from chirp to chirp.
  struct ChirpScratch {
    std::vector<PathRecord> moving;
    DelayedGrid added;
    ComplexGrid weighted, chirp;
  };
  ChirpContext chirpContext(const PoseContext& c, std::int64_t stamp_ns, int frame, int chirp) const;
  /// Makes both grids of filtered paths, before receive(); the paths are weighted by their delays then.
  void propagateWithDelays(const PoseContext& c, std::vector<PathRecord>& paths, DelayedGrid& grid) const;
  /// Adds one chirp's own paths to its rows of x, and modulates them; before receive().
  void varyChirp(const ChirpContext& now, const DelayedGrid& still, ChirpScratch& scratch, ComplexGrid& x) const;

  double strongestOf(const PoseContext& c, const std::vector<PathRecord>& records) const {
    double best = 0;
    for (const PathRecord& r : records) {
      best = std::max(best, stages.tones.empty() ? r.amplitude : r.amplitude * toneGain(c, r.length_m[0]));
    }
    return best;
  }
};

}  // namespace mmradartwin
