#pragma once

#include <memory>
#include <string>

#include "mmradartwin_attribution/evaluation.h"

namespace mmradartwin {

/// Writes a bag that rviz can show without any other node: per pose, two seconds each, attribution/residuals,
/// attribution/markers and tf; latched, attribution/scene_markers and attribution/ledger. LZ4-compressed.
class ResultsBag {
 public:
  /// Throws std::runtime_error where the file cannot be written.
  ResultsBag(const std::string& file, const EvaluationField& field, const Scene& scene);
  ~ResultsBag();
  /// May be called from several threads and in any order of poses.
  void add(const PoseResult& pose);
  void finish(const Evaluation& evaluation);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mmradartwin
