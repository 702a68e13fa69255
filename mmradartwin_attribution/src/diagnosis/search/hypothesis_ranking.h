#pragma once

#include <set>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/hypothesis_screen.h"

namespace mmradartwin::diagnosis::search {

constexpr std::size_t kMostOutOfPlace = 4;  ///< actors that are looked for elsewhere
constexpr std::size_t kMostObjects = 4;     ///< a wide or turned object may promise less than a point elsewhere

/// Ranks everything that could be wrong by a look without a fit: which hypotheses a round fits, and in which order.
class HypothesisRanking {
 public:
  /// Keeps a reference.
  explicit HypothesisRanking(DiagnosisContext& context)
      : context_(context), screen_(context.echoes, context.likelihood) {}

  /// Named hypotheses, and objects, late points, laws and replicas; most promised nats first. shifted: actors that are
  /// looked for elsewhere, most suspicious first.
  std::vector<Screened> rank(const std::vector<Hypothesis>& all, const ModelState& state,
                             const std::vector<RangeShift>& shifted);
  /// Actors whose echoes are far likelier nearer or farther away than their errors have them; highest gain first.
  std::vector<RangeShift> shifted(const ModelState& state);
  /// Forgets which hypotheses gained nothing: in a changed geometry they may gain.
  void tryAllAgain() { without_gain_.clear(); }

 private:
  DiagnosisContext& context_;
  HypothesisScreen screen_;
  std::set<std::string> without_gain_;  ///< labels of costly hypotheses that gain nothing whatever is found beside them
};

}  // namespace mmradartwin::diagnosis::search
