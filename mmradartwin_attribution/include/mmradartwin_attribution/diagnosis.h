#pragma once

#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Finds what the twin gets wrong about a recording, names it and measures on held-out places what saying so gains
/// (docs/reference/contracts.md section 4, 5 and 7). Sets the twin's strongest amplitude and session. Throws InputError
/// for a recording that cannot be judged at all, DiagnosisCancelled.
Diagnosis diagnose(const Recording& recording, Twin& twin, const DiagnosisOptions& options);

/// Diagnosis without a scene: it judges frames and channels only, and there is no extended twin.
Diagnosis diagnoseReceiver(const Recording& recording, const DiagnosisOptions& options);

}  // namespace mmradartwin
