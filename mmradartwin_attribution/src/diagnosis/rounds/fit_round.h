#pragma once

#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::rounds {

/// One round of a diagnosis: of what a ranking promises most of, which are fitted and from where.
class FitRound {
 public:
  /// Keeps references. state: what fits are compared with; gets the better latents that they find.
  FitRound(DiagnosisContext& context, ModelState& state) : context_(context), state_(state) {}

  /// screened: most promising first. Fits, best first, judged as of so large a family; puts behind `tried` what was
  /// looked at.
  std::vector<HypothesisFit> fit(std::vector<Screened> screened, std::size_t family, int round,
                                 std::vector<TriedHypothesis>& tried);

 private:
  void fitOne(Screened screened);

  DiagnosisContext& context_;
  ModelState& state_;
  std::vector<Screened> screened_;
  std::vector<HypothesisFit> fits_;  ///< best first
  double best_object_ = 0,
         best_overwhelming_name_ = 0;  ///< nats of the best fits of these kinds
};

/// The row of a fit of that round.
TriedHypothesis& triedAs(const HypothesisFit& fit, int round, std::vector<TriedHypothesis>& tried);

}  // namespace mmradartwin::diagnosis::rounds
