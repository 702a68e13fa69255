#pragma once

#include <string>
#include <utility>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::rounds {

/// One round of fits: the hypotheses with the highest screened gains, each from its starts.
class FitRound {
 public:
  /// Keeps references. state: what fits are compared with; better latents that a fit finds are written to it.
  FitRound(DiagnosisContext& context, ModelState& state) : context_(context), state_(state) {}

  /// Fits of a round, best first, with false-alarm rates for a family of that size. screened: highest gain first. Every
  /// hypothesis that was considered is appended to `tried`.
  std::vector<HypothesisFit> fit(std::vector<Screened> screened, std::size_t family, int round,
                                 std::vector<TriedHypothesis>& tried);

 private:
  void fitOne(Screened screened);
  /// Tries a box about that object, if no other deserves it more: a point may be clutter, which has no sides.
  void considerBox(const HypothesisFit& cylinder);

  DiagnosisContext& context_;
  ModelState& state_;
  std::vector<Screened> screened_;
  std::vector<HypothesisFit> fits_;          ///< best first
  double best_overwhelming_name_ = 0;        ///< nats of the best overwhelming named cause
  std::pair<bool, double> boxed_{false, 0};  ///< of the object that a box is tried about: larger than clutter; its nats
};

/// Row of `tried` about a fit of that round.
TriedHypothesis& triedAs(const HypothesisFit& fit, int round, std::vector<TriedHypothesis>& tried);

}  // namespace mmradartwin::diagnosis::rounds
