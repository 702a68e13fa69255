#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// What one pose's trace is kept as, to be weighed again and again: most records as they are, but the many that come
/// back from one facet the way they went (scatter points; of small facets, from one actor) as grids at nodes of
/// direction. A record counts for the four nodes around its direction, by bilinear weights that add up to one. So a
/// weight that is the same for all of a facet's records (material, actor, mechanism, gain, channel) acts exactly, to
/// single precision; one that changes with direction is interpolated between the nodes; one that changes with length is
/// taken at the node's mean length.
class CondensedTrace {
 public:
  struct Options {
    double azimuth_step_deg = 4, elevation_step_deg = 8;  ///< between nodes
    double length_step_m = 2;                             ///< records of one node lie within
    int fewest_records = 8;                               ///< of a facet or actor, else they stay records
  };
  CondensedTrace() = default;
  CondensedTrace(const RadarConfig& radar, std::vector<PathRecord> records, const Options& options);
  CondensedTrace(const RadarConfig& radar, std::vector<PathRecord> records)
      : CondensedTrace(radar, std::move(records), Options()) {}

  const std::vector<PathRecord>& records() const { return records_; }  ///< those that stayed
  /// One stand-in per node, with the node's direction and mean length, vertex and level: what mechanisms weigh.
  const std::vector<PathRecord>& nodes() const { return nodes_; }
  /// Adds the nodes' grids to x [M][N] as their stand-ins say when they were weighed: by each channel's change of
  /// contribution, and of length. `weigh` is shown a copy of every stand-in.
  void addNodes(const RadarConfig& radar, const std::function<void(PathRecord&)>& weigh, ComplexGrid& x) const;
  std::size_t bytes() const;

 private:
  /// Nodes of one facet's records: a weight that all of them share acts on their sum.
  struct Stretch {
    std::size_t begin, end;  // in nodes_
  };
  std::vector<PathRecord> records_, nodes_;
  std::vector<Stretch> stretches_;
  std::vector<std::complex<double>> inverse_;  // [node][M]: 1 / c of the stand-in
  std::vector<float> grids_, sums_;            // [node], [stretch] of [M][re, im][N]
};

/// A session's poses, traced once. Twins that differ from the tracing one in mechanisms of weight, pattern, channel and
/// receiver alone weigh them; for what moves the radar, the scene or a path's vertices trace again.
class TracedSession {
 public:
  /// Traces in parallel; the result does not depend on the number of threads. A pose that cannot be traced is listed in
  /// problems() and stays empty.
  TracedSession(const Twin& twin, const std::vector<Pose>& poses, const CondensedTrace::Options& options);
  TracedSession(const Twin& twin, const std::vector<Pose>& poses)
      : TracedSession(twin, poses, CondensedTrace::Options()) {}

  std::size_t size() const { return poses_.size(); }
  bool usable(std::size_t pose) const { return usable_.at(pose) != 0; }
  const CondensedTrace& trace(std::size_t pose) const { return traces_.at(pose); }
  const std::vector<PoseProblem>& problems() const { return problems_; }
  /// As Twin::simulate() at that pose; records() of the simulation are without those that nodes stand for. Throws
  /// std::invalid_argument for a pose that is not usable or a twin of another scene file or radar.
  Simulation weigh(const Twin& twin, std::size_t pose) const;
  std::size_t bytes() const;

 private:
  std::string scene_file_, radar_yaml_;
  std::vector<Pose> poses_;
  std::vector<char> usable_;
  std::vector<CondensedTrace> traces_;
  std::vector<PoseProblem> problems_;
};

}  // namespace mmradartwin
