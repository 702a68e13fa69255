#pragma once

#include <memory>
#include <string>

#include "mmradartwin_attribution/evaluation.h"

namespace mmradartwin {

/// Writes a bag that rviz can show without any other node, and that inspect_node shows pose by pose. Per pose, two
/// seconds each, maps, attribution/residuals, attribution/markers, twin/paths and tf; latched, radar/config,
/// twin/scene, attribution/scene_markers, attribution/ledger and inspect/poses. LZ4-compressed.
class ResultsBag {
 public:
  /// Throws std::runtime_error where the file cannot be written.
  /// `twin_yaml`: what is simulated; empty where it is a recording. Keeps a reference to the scene.
  ResultsBag(const std::string& file, const EvaluationField& field, const RadarConfig& radar, const Scene& scene,
             const std::string& twin_yaml = "");
  ~ResultsBag();
  /// May be called from several threads and in any order of poses.
  void add(const PoseResult& pose);
  void finish(const Evaluation& evaluation);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mmradartwin
