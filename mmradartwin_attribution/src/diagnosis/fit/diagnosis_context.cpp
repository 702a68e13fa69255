#include "diagnosis/fit/diagnosis_context.h"

namespace mmradartwin::diagnosis::fit {

DiagnosisContext::DiagnosisContext(const Recording& recording_in, Twin& twin_in, ChannelData& data_in,
                                   const DiagnosisOptions& options_in, const StatedAccuracy& accuracy_in, int folds)
    : recording(recording_in),
      twin(twin_in),
      data(data_in),
      options(options_in),
      accuracy(accuracy_in),
      pose_accuracy(accuracy),
      echoes(twin, data, pose_accuracy),
      likelihood(data, static_cast<int>(twin.scene().actors.size()), pose_accuracy, LatentSpread(accuracy)),
      fitter(echoes, likelihood, folds, StatedBounds(accuracy)) {}

void DiagnosisContext::judgeActorsBy(const StatedAccuracy& other) {
  accuracy.scene_m = other.scene_m;
  accuracy.level_db = other.level_db;
  likelihood.setSpread(LatentSpread(accuracy));
  fitter.setStated(StatedBounds(accuracy));
}

void DiagnosisContext::report(const std::string& stage, double share) const {
  if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
  if (options.on_progress) options.on_progress({stage, share});
}

}  // namespace mmradartwin::diagnosis::fit
