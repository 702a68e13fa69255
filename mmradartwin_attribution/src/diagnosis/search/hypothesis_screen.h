#pragma once

#include <utility>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// All echoes of an actor, farther away by shift_m (one-way), and what the likelihood gains.
struct RangeShift {
  int actor;
  double nats, shift_m;
};

/// What hypotheses promise against a state, without a fit.
class HypothesisScreen {
 public:
  /// Keeps references.
  HypothesisScreen(ExpectedEchoes& source, const ChannelLikelihood& model) : source_(source), model_(model) {}

  /// Actors by how far their echoes' level and range are from where the twin has them, the priors of their errors
  /// included: most suspicious first, with nats (inflation taken off).
  std::vector<std::pair<int, double>> suspects(const ModelState& null) const;
  /// Actors by what the likelihood of the poses named gains where all their echoes are nearer or farther away by one
  /// length of several, first who gains most. Traces nothing.
  std::vector<RangeShift> nearerOrFarther(const ModelState& null, const std::vector<int>& poses);
  /// Of what is there or not, more or less, the likelihood at some values: a quadratic about nothing says little of it.
  /// Of all others a score test.
  Screened screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);
  /// Of several starts, the likelihood at each: the best few are kept, the best first, and what that one promises.
  Screened amongStarts(const ModelState& null, Screened hypothesis, const std::vector<int>& poses);
  /// Of an actor whose place is free, by the first two coordinates: the likelihood at places around it, farther away
  /// than slopes reach; of the best of them over all poses, with the latents settled there.
  Screened around(const ModelState& null, const Hypothesis& hypothesis, int actor, const std::vector<int>& poses);

 private:
  /// Gain in nats over the poses named, and what it promises for all with its inflation taken off. Where some of the
  /// poses lose far more than that beside `beside` nats, both are theirs: most values are plainly wrong.
  std::pair<double, double> valueAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& nuisance, double beside = 0);
  /// Log-likelihoods of the poses named with the hypothesis there.
  std::vector<double> likelihoodsAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& nuisance);
  /// Log-likelihoods of the poses named with these echoes of theirs and these latents. known_where_same: that of a pose
  /// whose echoes are the null's is the null's, since latents differ from it in what other echoes have alone.
  std::vector<double> byPose(const ModelState& null, std::vector<PoseEchoes> echoes, const SessionLatents& nuisance,
                             const std::vector<int>& poses, bool known_where_same) const;
  /// The same as valueAt() of log-likelihoods of those poses.
  std::pair<double, double> promiseOf(const ModelState& null, const Hypothesis& hypothesis,
                                      const std::vector<double>& there, const std::vector<int>& poses) const;
  /// What it promises over all poses once the latents, from those given, have settled on it.
  double settledAt(const ModelState& null, const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                   SessionLatents nuisance);
  Screened directly(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
};

}  // namespace mmradartwin::diagnosis::search
