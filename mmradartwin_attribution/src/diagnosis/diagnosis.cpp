#include "mmradartwin_attribution/diagnosis.h"

#include <tbb/global_control.h>

#include <memory>

#include "diagnosis/channels/pose_time_lag.h"
#include "diagnosis/diagnosis_run.h"
#include "diagnosis/receiver/received_session.h"

namespace mmradartwin {

using namespace diagnosis;

Diagnosis diagnose(const Recording& recording, Twin& twin, const DiagnosisOptions& options) {
  std::unique_ptr<tbb::global_control> limit;
  if (options.jobs > 0) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(options.jobs));
  }
  const TimedRecording timed =
      inTime(recording, twin.description().mechanisms, readingProgress(options, "frames on the way"));
  DiagnosisRun run(timed, twin, options);
  run.judgeFrames();
  run.judgeConventions();
  run.judgeOwnEcho();
  run.judgeNoise();
  run.fitTwinAsGiven();
  run.compareTwins();
  if (run.sceneMatches()) {
    run.findCauses();
    run.judgeRest();
    run.addUnexplained();
  }
  run.recordChangedPaths();
  return run.result();
}

}  // namespace mmradartwin
