#pragma once

#include <utility>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Gain of the likelihood with all echoes of an actor farther away by shift_m (one-way).
struct RangeShift {
  int actor;
  double nats, shift_m;
};

/// Looks at hypotheses against a state without a fit: a score test, or the likelihood at a few values. A *promise* is
/// the gain in nats over its overdispersion, scaled to all poses.
class HypothesisScreen {
 public:
  /// Keeps references.
  HypothesisScreen(ExpectedEchoes& source, const ChannelLikelihood& model) : source_(source), model_(model) {}

  /// Actors with the nats that the prior charges for their errors of level and range; most suspicious first.
  std::vector<std::pair<int, double>> suspects(const ModelState& null) const;
  /// Actors with the gain at the poses named where all their echoes are nearer or farther away by the best of several
  /// lengths; highest gain first. Traces nothing.
  std::vector<RangeShift> nearerOrFarther(const ModelState& null, const std::vector<int>& poses);
  /// Promise of one hypothesis with a start. One-sided hypotheses are looked at by the likelihood at some values (a
  /// quadratic about nothing says little of them), all others by a score test.
  Screened screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);
  /// Promise of the best of several starts, by the likelihood at each; the best few are kept, best first.
  Screened amongStarts(const ModelState& null, Screened hypothesis, const std::vector<int>& poses);
  /// Promise of a move of an actor (the first two coordinates are its place): the likelihood at places farther away
  /// than slopes reach, and at the best of them over all poses with settled latents.
  Screened around(const ModelState& null, const Hypothesis& hypothesis, int actor, const std::vector<int>& poses);

 private:
  /// Gain in nats over the poses named, and the promise. Most values are plainly wrong: where a third of the poses
  /// loses far more than `beside` nats, the others are not looked at.
  std::pair<double, double> valueAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& latents, double beside = 0);
  /// Log-likelihoods of the poses named with the hypothesis at these values.
  std::vector<double> likelihoodsAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& latents);
  /// Log-likelihoods of the poses named with these echoes and latents. known_where_same: a pose whose echoes are the
  /// null's has the null's likelihood, since the latents differ only in what other echoes have.
  std::vector<double> byPose(const ModelState& null, std::vector<PoseEchoes> echoes, const SessionLatents& latents,
                             const std::vector<int>& poses, bool known_where_same) const;
  /// Gain and promise of log-likelihoods `there` of the poses named.
  std::pair<double, double> screenedGain(const ModelState& null, const Hypothesis& hypothesis,
                                         const std::vector<double>& there, const std::vector<int>& poses) const;
  /// Promise over all poses once the latents, from those given, have settled.
  double screenedWithLatents(const ModelState& null, const Hypothesis& hypothesis,
                             const std::vector<double>& scaled_values, SessionLatents latents);
  /// Promise by the likelihood at some values.
  Screened directly(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
};

}  // namespace mmradartwin::diagnosis::search
