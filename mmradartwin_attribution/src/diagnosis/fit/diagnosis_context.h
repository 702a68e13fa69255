#pragma once

#include <string>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/hypothesis_fitter.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::fit {

/// Objects that the steps of a diagnosis share; made once per session.
struct DiagnosisContext {
  /// Keeps references. accuracy: by which the session is judged. folds: number of parts of the locations, each held out
  /// in turn. Throws InputError where scene and radar do not fit together.
  DiagnosisContext(const Recording& recording, Twin& twin, ChannelData& data, const DiagnosisOptions& options,
                   const StatedAccuracy& accuracy, int folds);

  /// Judges actors by other errors from now on; those of poses and single paths stay.
  void judgeActorsBy(const StatedAccuracy& other);

  /// Reports a stage and the share of it that is done to options.on_progress. Throws DiagnosisCancelled where the user
  /// has cancelled.
  void report(const std::string& stage, double share) const;

  const Recording& recording;
  Twin& twin;
  ChannelData& data;
  const DiagnosisOptions& options;
  StatedAccuracy accuracy;
  PoseAccuracy pose_accuracy;
  ExpectedEchoes echoes;
  ChannelLikelihood likelihood;
  HypothesisFitter fitter;
};

}  // namespace mmradartwin::diagnosis::fit
