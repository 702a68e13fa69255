#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/gain/gain_measurement.h"
#include "diagnosis/rooms.h"
#include "diagnosis/rounds/selection.h"
#include "diagnosis/search/hypothesis_ranking.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::rounds {

/// Rounds of a diagnosis. Each ranks all hypotheses, fits the most promising ones, and takes the best fit that the
/// likelihood, the held-out places and the maps speak for; all findings are then fitted together.
class HypothesisRounds {
 public:
  /// Keeps references. frames: what frames show, whose walkers are no objects. result: gets findings and the hypotheses
  /// that were tried.
  HypothesisRounds(DiagnosisContext& context, GainMeasurement& gains, const std::vector<FrameFinding>& frames,
                   Diagnosis& result);

  /// Makes the likely range errors of actors part of a state's latents: far from zero the likelihood may have an
  /// optimum that steps from zero do not reach. Returns the actors that seem shifted by more than such an error.
  std::vector<RangeShift> takeRangeErrors(ModelState& state);
  /// Runs rounds until one finds nothing, most_rounds at the most. Mechanisms as the engine simulates them, and
  /// `extended` as the recording has them.
  void run(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& extended,
           ModelState state, int most_rounds);

  const std::vector<NamedParameters>& mechanisms() const { return selection_.mechanisms(); }
  const std::vector<NamedParameters>& extended() const { return selection_.extended(); }
  const SessionLatents& latents() { return selection_.state().latents; }

 private:
  /// One round; true where it found something.
  bool findOne(int round);
  std::vector<HypothesisFit> fitBest(int round);
  /// Reason why a fit is no finding by its likelihood alone, "" where it may be one.
  std::string rejectionByLikelihood(const HypothesisFit& fit) const;

  DiagnosisContext& context_;
  GainMeasurement& gains_;
  const std::vector<FrameFinding>& frames_;
  Diagnosis& result_;
  HypothesisRanking ranking_;
  Selection selection_;
  std::size_t family_ = 1;  ///< hypotheses of a round
};

}  // namespace mmradartwin::diagnosis::rounds
