#include "mmradartwin_attribution/diagnosed_poses.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_sim/pose_placement.h"

namespace mmradartwin {
namespace {

Evaluation comparedWith(const Twin& twin, const Recording& recording, const EvaluationField& field,
                        const DiagnosisOptions& options, const std::string& stage) {
  EvaluationOptions evaluation;
  evaluation.config = options.config;
  evaluation.jobs = options.jobs;
  evaluation.on_progress = [&](std::size_t done, std::size_t all) {
    if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options.on_progress) options.on_progress({stage, static_cast<double>(done) / static_cast<double>(all)});
  };
  return evaluate(recording, simulatedByTwin(twin, DiffuseRecords::kCells, &field), twin.scene(), twin.rays(),
                  evaluation);
}

}  // namespace

DiagnosedPoses compareDiagnosedPoses(const Recording& recording, const Twin& twin, const Diagnosis& diagnosis,
                                     const DiagnosisOptions& options) {
  const SignalChain chain(recording.radar);
  EvaluationField field(options.config, recording.radar, chain.axes());
  Evaluation given = comparedWith(twin, recording, field, options, "comparing poses with the twin as given");
  DiagnosedPoses poses{std::move(field), std::move(given), std::nullopt};
  const std::vector<Finding>& findings = diagnosis.findings.findings;
  const bool changed =
      std::any_of(findings.begin(), findings.end(), [](const Finding& f) { return f.mechanism.has_value(); });
  if (!changed) return poses;
  Twin corrected = twinAt(diagnosis.extended, recording.poses, recording.source);
  std::vector<Eigen::Isometry3d> places;
  for (const Pose& pose : recording.poses) places.push_back(pose.T_map_radar);
  corrected.prepare(places);
  poses.corrected = comparedWith(corrected, recording, poses.field, options, "comparing poses with the corrected twin");
  return poses;
}

}  // namespace mmradartwin
