#pragma once

#include <optional>

#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Each pose of a diagnosed recording, compared with the twin as given and with the corrected one: what the diagnosis'
/// report draws of single poses.
struct DiagnosedPoses {
  EvaluationField field;
  Evaluation given;
  std::optional<Evaluation> corrected;  ///< none where nothing was found that the twin could be extended by
};

/// Compares as evaluate() does, with the twin as given and with that of `diagnosis.extended`. Takes what diagnose()
/// took and gave. Throws InputError where the poses cannot be compared, as where the radar's maps have no cell beyond
/// the least range; what was found stands all the same. Throws DiagnosisCancelled.
DiagnosedPoses compareDiagnosedPoses(const Recording& recording, const Twin& twin, const Diagnosis& diagnosis,
                                     const DiagnosisOptions& options);

}  // namespace mmradartwin
