#pragma once

#include <unistd.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// A session of the generator, a twin of it, and what changes when something is done to the simulated side.
class Laboratory {
 public:
  explicit Laboratory(const std::string& session) : recording(openSession(session)), twin(describe()) {
    std::vector<Eigen::Isometry3d> poses;
    for (const Pose& pose : recording.poses) poses.push_back(pose.T_map_radar);
    twin.prepare(poses);
    for (const Pose& pose : recording.poses) {
      simulations.emplace(pose.name, twin.simulate(pose.T_map_radar, pose.stamp_ns));
    }
  }

  /// The base twin with one more mechanism, as a line of twin.yaml.
  TwinDescription describe(const std::string& mechanism = "") const {
    const std::string file =
        std::filesystem::temp_directory_path() / ("attribution_twin_" + std::to_string(getpid()) + ".yaml");
    std::ofstream(file) << "mechanisms:\n  specular: {max_bounces: 3}\n  corner: {}\n  diffuse: {}\n" << mechanism;
    TwinDescription description = loadTwin(file, recording.scene_file, recording.radar);
    std::filesystem::remove(file);
    return description;
  }

  Evaluation against(const SimulatedBranch& simulated) const { return against(simulated, twin); }
  Evaluation against(const SimulatedBranch& simulated, const Twin& of) const {
    return evaluate(recording, simulated, of.scene(), of.rays(), options);
  }

  /// The twin's echoes with every path that `weight` does not give 1 scaled in amplitude. Occlusion stays as it is.
  SimulatedBranch weighed(const std::function<double(const PathRecord&)>& weight) const {
    auto chain = std::make_shared<SignalChain>(twin.radar());
    return [this, chain, weight](const Pose& pose) {
      Simulation simulation = simulations.at(pose.name);
      std::vector<PathRecord> difference;
      for (PathRecord& record : simulation.records) {
        const double factor = weight(record);
        if (factor == 1) continue;
        difference.push_back(record);
        for (auto& c : difference.back().c) c *= factor - 1;
        record.amplitude *= factor;
        for (auto& c : record.c) c *= factor;
      }
      accumulate(twin.radar(), difference, simulation.grid.x);
      return SimulatedPose{chain->map(simulation.grid), simulation.records};
    };
  }

  /// Residuals of `with` that have no counterpart in `without`: same pose and side, within the tight window.
  /// With `where` only those of poses in which the simulated map's peak, and so its normalisation, stayed within 0.1
  /// dB.
  enum class Where { kEveryPose, kPeakKept };
  std::vector<Residual> appearing(const Evaluation& with, const Evaluation& without,
                                  Where where = Where::kEveryPose) const {
    const SignalChain chain(recording.radar);
    const EvaluationField field(options.config, recording.radar, chain.axes());
    std::vector<Residual> result;
    for (std::size_t i = 0; i < with.poses.size(); ++i) {
      const double lift_db =
          with.poses[i].attribution.simulated.peak_db - without.poses[i].attribution.simulated.peak_db;
      if (where == Where::kPeakKept && std::abs(lift_db) > 0.1) continue;
      for (const Residual& r : with.poses[i].attribution.residuals) {
        bool before = false;
        for (const Residual& b : without.poses[i].attribution.residuals) {
          before = before || (b.measured_stronger == r.measured_stronger &&
                              field.inWindow(options.config.tight, b.range_m, b.azimuth_rad, r.range_m, r.azimuth_rad));
        }
        if (!before) result.push_back(r);
      }
    }
    return result;
  }

  static std::array<int, 5> classes(const std::vector<Residual>& residuals) {
    std::array<int, 5> count{};
    for (const Residual& r : residuals) ++count[static_cast<int>(r.residual_class) - 1];
    return count;
  }

  EvaluationOptions options;
  Recording recording;
  Twin twin;
  std::map<std::string, Simulation> simulations;  ///< of the twin as it is, by pose
};

inline double share(const std::array<int, 5>& count, int residual_class) {
  int all = 0;
  for (int c : count) all += c;
  return all ? static_cast<double>(count[residual_class - 1]) / all : 0.0;
}

inline std::string text(const std::array<int, 5>& count) {
  std::string s;
  for (int i = 0; i < 5; ++i) s += (i ? ", C" : "C") + std::to_string(i + 1) + " " + std::to_string(count[i]);
  return s;
}

}  // namespace mmradartwin
