#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/gain/gain_measurement.h"
#include "diagnosis/rooms.h"
#include "diagnosis/rounds/selection.h"
#include "diagnosis/search/hypothesis_ranking.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::rounds {

/// Rounds of a diagnosis. Each round ranks all hypotheses, fits the best-ranked ones, and takes the best fit that the
/// likelihood, the held-out places and the maps support. All findings are then refitted jointly.
class HypothesisRounds {
 public:
  /// Keeps references. frames: findings about frames, whose walkers are no objects. result: receives findings and the
  /// hypotheses that were tried.
  HypothesisRounds(DiagnosisContext& context, GainMeasurement& gains, const std::vector<FrameFinding>& frames,
                   Diagnosis& result);

  /// Sets the likely range errors of actors in a state's latents: the likelihood may have an optimum far from zero that
  /// steps from zero do not reach. Returns the actors that seem shifted by more than such an error.
  std::vector<RangeShift> takeRangeErrors(ModelState& state);
  /// Runs rounds until one finds nothing, at most most_rounds. mechanisms: as the engine simulates them. extended: as
  /// the recording has them.
  void run(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& extended,
           ModelState state, int most_rounds);

  const std::vector<NamedParameters>& mechanisms() const { return selection_.mechanisms(); }
  const std::vector<NamedParameters>& extended() const { return selection_.extended(); }
  const SessionLatents& latents() { return selection_.state().latents; }
  const ModelState& state() { return selection_.state(); }
  /// Actors whose echoes are likelier at other ranges, in the last round, and whose latents do not say so.
  const std::vector<RangeShift>& elsewhere() const { return elsewhere_; }

 private:
  enum class RoundEnd { kNothing, kFound, kAllowedFor };
  /// Runs one round. Where clutter that stands out is likelier than a cause that the scene does not place, or the move
  /// of an actor within the scene's error likelier than a cause, these are allowed for and the round ends: the next one
  /// judges all causes beside them.
  RoundEnd findOne(int round);
  std::vector<HypothesisFit> fitBest(int round);
  /// Reason why a fit is no finding by its likelihood alone, "" where it may be one.
  std::string rejectionByLikelihood(const HypothesisFit& fit) const;
  /// True of what lies about on an actor, and of an object no larger than clutter is, with all the evidence that a
  /// finding needs.
  bool isClutter(const HypothesisFit& fit) const;
  /// Those of these things, likeliest first, that stand apart from each other, as many as may still be allowed for.
  std::vector<HypothesisFit> newClutter(const std::vector<HypothesisFit>& clutter) const;
  /// Those of these moves within the scene's error whose actors are not allowed one yet, beside so many other things.
  std::vector<HypothesisFit> newMoves(const std::vector<HypothesisFit>& moves, std::size_t others) const;
  /// Takes fits of a round for granted in all that follows.
  void allowFor(const std::vector<HypothesisFit>& granted, int round);
  /// Index of the likeliest named fit after fits[best] that is about as likely and explains clearly more power on
  /// held-out places; nothing where there is none.
  std::optional<std::size_t> betterByMaps(std::vector<HypothesisFit>& fits, std::size_t best);

  DiagnosisContext& context_;
  GainMeasurement& gains_;
  const std::vector<FrameFinding>& frames_;
  Diagnosis& result_;
  HypothesisRanking ranking_;
  Selection selection_;
  std::vector<RangeShift> elsewhere_;
  std::size_t family_ = 1;                      ///< number of hypotheses of a round
  std::size_t allowed_for_ = 0;                 ///< number of things and moves that are taken for granted
  std::vector<std::string> moves_allowed_for_;  ///< their actors
};

}  // namespace mmradartwin::diagnosis::rounds
