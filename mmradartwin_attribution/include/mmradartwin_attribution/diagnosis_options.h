#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Progress of a diagnosis: its stage, and the share of the stage that is done, 0 to 1.
struct DiagnosisProgress {
  std::string stage;
  double share = 0;
};

struct DiagnosisOptions {
  int jobs = 0;           ///< 0: as many as there are cores
  int most_findings = 6;  ///< among echoes; 0: frames, conventions and what the twin as given explains
  std::function<void(const DiagnosisProgress&)> on_progress;
  std::function<bool()> cancelled;  ///< asked between steps
  AttributionConfig config;         ///< of the paper's metrics
  StatedAccuracy accuracy;          ///< of sessions that state none themselves
  /// Other twins of the same scene and radar, whose likelihood is told beside that of the twin as given.
  std::vector<TwinDescription> compared;
};

/// Thrown where DiagnosisOptions::cancelled said so.
class DiagnosisCancelled : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace mmradartwin
