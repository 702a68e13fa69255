#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

struct NamedParameters {
  std::string mechanism;
  Parameters values;
};

/// twin.yaml, checked: scene, radar and mechanisms.
struct TwinDescription {
  std::string file;  ///< "" where the base twin stands in
  std::string scene_file;
  std::string radar_file;  ///< where twin.yaml names a radar of its own, else ""
  RadarConfig radar;
  std::vector<NamedParameters> mechanisms;  ///< in the order of the file
  std::string toYaml() const;               ///< resolved: all parameters with their values
};

/// Reads twin.yaml strictly; scene and radar default to the given ones. twin_file empty: base mechanisms.
/// Throws InputError (unknown mechanism or parameter, value out of range, no scene at all).
TwinDescription loadTwin(const std::string& twin_file, const std::optional<std::string>& default_scene,
                         const RadarConfig& default_radar);

struct Simulation {
  std::int64_t stamp_ns = 0;
  Eigen::Isometry3d T_map_radar;  ///< the pose asked for (not moved by pose mechanisms)
  std::vector<PathRecord> records;
  ReceiveGrid grid;              ///< propagated and received; full_scale 1
  bool propagation_only = true;  ///< no mechanism has a receive stage: grid is the sum of its records
  RecordCheck check;
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
  /// The scene as described, before mechanisms edited it: what expected regions come from. Records index scene(), and
  /// mechanisms that remove an actor keep the indices.
  const Scene& scene() const;
  const RayCaster& rays() const;  ///< of scene()
  /// Tells levels that are relative to the session's strongest echo; without it they refer to the strongest of the
  /// poses simulated so far.
  void setStrongestAmplitude(double amplitude);
  /// Poses of the session: finds the strongest amplitude where a mechanism needs it. Cheap otherwise.
  void prepare(const std::vector<Eigen::Isometry3d>& poses);
  /// What a user should know about this scene with these mechanisms (search limits, say), a line each.
  std::vector<std::string> notes() const;
  /// The two halves of simulate(): all that has to be traced, and what weights, leakage and receiver make of it.
  /// Records traced once may be weighed again by a twin that differs in mechanisms of weight and receiver alone.
  std::vector<PathRecord> trace(const Eigen::Isometry3d& T_map_radar) const;
  Simulation weigh(const Eigen::Isometry3d& T_map_radar, std::vector<PathRecord> traced,
                   std::int64_t stamp_ns = 0) const;
  /// Throws InputError for a pose that is NaN or inside an actor (names it).
  Simulation simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mmradartwin
