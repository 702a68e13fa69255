#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/trajectory.h"
#include "mmradartwin_sim/twin_description.h"

namespace mmradartwin {

class MovingTwin;
struct AssembledTwin;

struct Simulation {
  std::int64_t stamp_ns = 0;
  Eigen::Isometry3d T_map_radar;  ///< the pose asked for (not moved by pose mechanisms)
  std::vector<PathRecord> records;
  ReceiveGrid grid;              ///< propagated and received; full_scale 1
  bool propagation_only = true;  ///< no mechanism has a receive stage: grid is the sum of its records
  RecordCheck check;
};

/// How a pose becomes frames of samples.
struct FrameOptions {
  int frames = 1;
  double gain_db = 0;     ///< sample / 32768 = 10^(gain_db/20) x
  std::string pose_name;  ///< of mechanisms that concern one pose
};

/// A twin ready to simulate. simulate() is const and may run for several poses at once; its result depends on pose and
/// description alone, not on threads.
class Twin {
 public:
  explicit Twin(TwinDescription description, std::uint64_t seed = 1);
  ~Twin();
  Twin(Twin&&) noexcept;

  const TwinDescription& description() const;
  const RadarConfig& radar() const;
  /// The scene as described, before mechanisms edited it: what expected regions come from. Records' actors index
  /// scene(), and mechanisms that remove an actor keep the indices.
  const Scene& scene() const;
  /// The scene as mechanisms edited it, scene() where none does: what PathRecord::facets index.
  const Scene& tracedScene() const;
  const RayCaster& rays() const;  ///< of scene()
  /// A twin of the same scene and radar with other mechanisms; reads no mesh again. What setStrongestAmplitude() and
  /// setSession() said holds on. Throws InputError as the constructor does.
  Twin changed(std::vector<NamedParameters> mechanisms) const;
  /// True where a mechanism edits the scene or moves the radar, so that every path has to be traced anew; else the
  /// paths of a twin are those of its mechanisms one by one.
  bool altersGeometry() const;
  /// Difference to another twin of the same scene: the actors that stand elsewhere and their bounds in both twins. An
  /// actor that a mechanism put into the room counts by its bounds only. Nothing where the radar is elsewhere.
  std::optional<SceneChange> changesFrom(const Twin& other) const;
  /// The actor that mechanisms move or add, where that is their only edit of the scene.
  struct PlacedActor {
    int actor;   ///< in scene(); -1 where they put it there
    bool hides;  ///< what is behind it
  };
  std::optional<PlacedActor> placesOneActor() const;
  /// True where an edit lets rays through what occludes in scene().
  bool removesActors() const;
  /// True where all that the edits add hides what is behind it and does nothing else: its paths are those of the
  /// scene without that, less what removeHidden() takes.
  bool addsOccludersOnly() const;
  /// Removes the records that an added occluder hides. T_map_radar: where they were traced from.
  void removeHidden(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord>& records,
                    std::int64_t stamp_ns = 0) const;
  /// Tells levels that are relative to the session's strongest echo; without it they refer to the strongest of the
  /// poses simulated so far.
  void setStrongestAmplitude(double amplitude);
  /// Poses of the session: finds the strongest amplitude where a mechanism needs it. Cheap otherwise.
  void prepare(const std::vector<Eigen::Isometry3d>& poses);
  /// Notes for the user about this scene with these mechanisms (search limits, say), a line each.
  std::vector<std::string> notes() const;
  /// The two halves of simulate(): all that has to be traced, and what weights, leakage and receiver make of it.
  /// Records traced once may be weighed again by a twin that differs in mechanisms of weight and receiver alone.
  /// cloud: cells within which scatter points are summed; not kept.
  std::vector<PathRecord> trace(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0,
                                const ScatterCells* cloud = nullptr) const;
  /// Paths of description().mechanisms[mechanism] alone.
  std::vector<PathRecord> trace(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                const ScatterCells* cloud) const;
  /// As trace() of one mechanism, from the `known` paths of a twin that differs by `change`: finds only what it
  /// touches.
  std::vector<PathRecord> retrace(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                  const ScatterCells& cloud, const SceneChange& change,
                                  const std::vector<PathRecord>& known) const;
  /// As trace() of one mechanism, from the paths of a twin `without` the placed actor: keeps those that the actor does
  /// not hide, and finds those that meet it.
  std::vector<PathRecord> traceAround(std::size_t mechanism, const Eigen::Isometry3d& T_map_radar,
                                      const ScatterCells& cloud, const PlacedActor& placed,
                                      const std::vector<PathRecord>& without) const;
  Simulation weigh(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord> traced,
                   std::int64_t stamp_ns = 0) const;
  /// The paths that weigh() makes a grid of: weighted, with leakage, and as the receiver's filters leave them.
  std::vector<PathRecord> receivedPaths(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord> traced,
                                        std::int64_t stamp_ns = 0) const;
  /// True where the receiver does more to the grid than filter it path by path.
  bool hasReceiveStage() const;
  /// The receiver's matrix over the channels [M][M], where beyond filters it is one matrix, the same at all samples;
  /// else nothing.
  std::optional<Eigen::MatrixXcd> channelMatrix(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0) const;
  /// Throws InputError for a pose that is NaN or inside an actor (names it).
  Simulation simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0) const;

  /// Names and stamps of the session's poses, for what concerns one of them or changes with time. Without it every pose
  /// is the first. Between poses that follow each other within 0.2 s the radar is taken to move evenly, elsewhere to
  /// stand. Throws InputError where a mechanism names a pose that is not among them.
  void setSession(const std::vector<Pose>& poses);
  /// Sets the reported poses along time, which pose_time_lag needs, instead of those of the session. The trajectory is
  /// called from any thread.
  void setTrajectory(Trajectory reported);
  /// True where a mechanism acts on frames, chirps or samples; else all frames are the grid's samples.
  bool hasFrameStage() const;
  /// True where simulateFrames() and visitChirps() look at the records; else the grid is all they need.
  bool framesNeedRecords() const;
  /// Share of I and Q values that the session's gain is to drive beyond full scale; 0 where no mechanism says so.
  double clippedFraction() const;
  /// The frames of a simulated pose, chirp by chirp, sample/32768 = 10^(gain_db/20) x, rounded and held within full
  /// scale. Depends on pose, stamp and seed alone.
  std::vector<AdcCube> simulateFrames(const Simulation& pose, const FrameOptions& options) const;
  /// Shows every chirp [R][N] as it comes to the converter, in path amplitudes: for the level of a whole session.
  void visitChirps(const Simulation& pose, int frames,
                   const std::function<void(const ChirpContext&, const ComplexGrid&)>& visit) const;

 private:
  void forEachChirp(const Simulation& pose, int frames,
                    const std::function<void(const ChirpContext&, ComplexGrid&)>& visit) const;
  friend class MovingTwin;
  friend class WhatIf;
  explicit Twin(std::unique_ptr<AssembledTwin> impl);
  std::unique_ptr<AssembledTwin> impl_;
};

}  // namespace mmradartwin
