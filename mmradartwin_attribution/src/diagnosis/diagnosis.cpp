#include "mmradartwin_attribution/diagnosis.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "diagnosis/channels/pose_time_lag.h"
#include "diagnosis/diagnosis_run.h"
#include "diagnosis/receiver/received_session.h"
#include "mmradartwin_attribution/scene_refinement.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

using namespace diagnosis;

namespace {

Diagnosis diagnosed(const TimedRecording& timed, Twin& twin, const DiagnosisOptions& options,
                    const std::map<std::string, double>& estimated) {
  DiagnosisRun run(timed, twin, options, estimated);
  run.judgeFrames();
  run.judgeConventions();
  run.judgeOwnEcho();
  run.judgeNoise();
  run.fitTwinAsGiven();
  run.compareTwins();
  if (run.sceneMatches()) {
    run.findCauses();
    run.estimateAccuracy();
    run.judgeRest();
    run.addUnexplained();
  }
  run.recordChangedPaths();
  return run.result();
}

/// Keeps to a number of threads as long as it lives; 0: as many as there are cores.
std::unique_ptr<tbb::global_control> limited(int jobs) {
  if (jobs <= 0) return nullptr;
  return std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                               static_cast<std::size_t>(jobs));
}

}  // namespace

SceneRefinement refineScene(const Recording& recording, Twin& twin, const DiagnosisOptions& options) {
  const auto limit = limited(options.jobs);
  const TimedRecording timed =
      inTime(recording, twin.description().mechanisms, readingProgress(options, "frames on the way"));
  DiagnosisRun run(timed, twin, options);
  run.judgeFrames();
  run.judgeConventions();
  run.judgeOwnEcho();
  run.judgeNoise();
  run.fitTwinAsGiven();
  if (!run.sceneMatches()) {
    throw InputError(
        recording.source +
        ": the twin explains no more of it than chance; diagnose it first, and refine the scene when it matches");
  }
  return run.refinement();
}

Diagnosis diagnose(const Recording& recording, Twin& twin, const DiagnosisOptions& options) {
  const auto limit = limited(options.jobs);
  const TimedRecording timed =
      inTime(recording, twin.description().mechanisms, readingProgress(options, "frames on the way"));
  Diagnosis by_stated = diagnosed(timed, twin, options, {});
  std::map<std::string, double> far_worse;
  for (const AccuracyKey& key : accuracyKeys()) {
    if (!by_stated.findings.isFarWorse(key.name)) continue;
    far_worse[key.name] = std::min(key.max, by_stated.findings.estimated.at(key.name).value);
  }
  if (far_worse.empty()) return by_stated;
  // By too small an accuracy, errors of the ground are taken for causes.
  Diagnosis by_estimate = diagnosed(timed, twin, options, far_worse);
  for (const auto& item : far_worse) {
    if (by_estimate.findings.isFarWorse(item.first)) continue;
    by_estimate.findings.estimated[item.first] = by_stated.findings.estimated.at(item.first);
  }
  return by_estimate;
}

}  // namespace mmradartwin
