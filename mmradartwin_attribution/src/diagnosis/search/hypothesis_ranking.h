#pragma once

#include <set>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/hypothesis_screen.h"

namespace mmradartwin::diagnosis::search {

constexpr std::size_t kMostOutOfPlace = 4;  ///< actors that are looked for elsewhere
constexpr double kWorthALaw = 8;            ///< nats promised
constexpr double kWorthAnObject = 3;        ///< at the best of all places
constexpr std::size_t kMostObjects = 4;     ///< what is wide or turned promises less than a point elsewhere

/// What a round of a diagnosis fits, and in which order: everything that could be wrong, looked at without a fit.
class HypothesisRanking {
 public:
  /// Keeps a reference.
  explicit HypothesisRanking(DiagnosisContext& context)
      : context_(context), screen_(context.echoes, context.likelihood) {}

  /// Names, and what they leave out: objects, late points, laws and replicas. Most nats promised first.
  /// shifted: actors that are looked for elsewhere, most suspicious first.
  std::vector<Screened> rank(const std::vector<Hypothesis>& all, const ModelState& state,
                             const std::vector<RangeShift>& shifted);
  /// Actors whose echoes are plainly likelier nearer or farther away than their errors have them, most plainly first.
  std::vector<RangeShift> shifted(const ModelState& state);
  /// The geometry has changed: what gained nothing before may gain now.
  void tryAllAgain() { no_use_.clear(); }

 private:
  std::vector<int> spread(std::size_t wanted) const;  // of all poses, evenly

  DiagnosisContext& context_;
  HypothesisScreen screen_;
  std::set<std::string> no_use_;  ///< costly ones that gain nothing whatever is found beside them
};

}  // namespace mmradartwin::diagnosis::search
