#pragma once

#include <set>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/hypothesis_screen.h"

namespace mmradartwin::diagnosis::search {

constexpr std::size_t kMostOutOfPlace = 4;  ///< actors that are searched for at other places
/// Objects fitted; a wide one may screen lower than a point elsewhere.
constexpr std::size_t kMostObjects = 4;

/// Ranks all hypotheses without a fit: which of them a round fits, and in which order.
class HypothesisRanking {
 public:
  /// Keeps a reference.
  explicit HypothesisRanking(DiagnosisContext& context)
      : context_(context), screen_(context.echoes, context.likelihood) {}

  /// Named hypotheses, objects, late points, laws and replicas; highest screened gain first. shifted: actors that are
  /// searched for at other places, highest gain first.
  std::vector<Screened> rank(const std::vector<Hypothesis>& all, const ModelState& state,
                             const std::vector<RangeShift>& shifted);
  /// Actors whose echoes are much likelier at other ranges than their errors allow; highest gain first.
  std::vector<RangeShift> shifted(const ModelState& state);
  /// Forgets which hypotheses gained nothing: they may gain in a changed geometry.
  void tryAllAgain() { without_gain_.clear(); }

 private:
  DiagnosisContext& context_;
  HypothesisScreen screen_;
  std::set<std::string> without_gain_;  ///< labels of costly hypotheses that gain nothing whatever else is found
};

}  // namespace mmradartwin::diagnosis::search
