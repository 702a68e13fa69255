#pragma once

#include <utility>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Gain of the likelihood with all echoes of one actor farther away by shift_m (one-way).
struct RangeShift {
  int actor;
  double nats, shift_m;
};

/// Judges hypotheses over a state without a fit, by a score test or by the likelihood at a few values. The *screened
/// gain* is the gain in nats over its overdispersion, scaled to all poses.
class HypothesisScreen {
 public:
  /// Keeps references.
  HypothesisScreen(ExpectedEchoes& source, const ChannelLikelihood& model) : source_(source), model_(model) {}

  /// Actors with the nats that the prior charges for their errors of level and range; highest first.
  std::vector<std::pair<int, double>> suspects(const ModelState& null) const;
  /// Actors with the gain at these poses of shifting all their echoes by the best of several ranges; highest gain
  /// first. Traces no paths.
  std::vector<RangeShift> nearerOrFarther(const ModelState& null, const std::vector<int>& poses);
  /// Screened gain and start of one hypothesis. A one-sided hypothesis is judged by the likelihood at some values,
  /// since a quadratic about zero predicts it badly. All others are judged by a score test.
  Screened screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);
  /// Screened gain of the best of several starts, by the likelihood at each. The best few are kept, best first.
  Screened amongStarts(const ModelState& null, Screened hypothesis, const std::vector<int>& poses);
  /// Screened gain of a move of an actor, whose position is the first two coordinates: by the likelihood at places
  /// beyond the reach of slopes, and at the best of them over all poses with refitted latents.
  Screened around(const ModelState& null, const Hypothesis& hypothesis, int actor, const std::vector<int>& poses);

 private:
  /// Adds starts of a ratio that edits the scene, the likeliest of a scan over its range. The likelihood's optimum is a
  /// centimetre wide, and a far wall moves by many.
  void scanRatio(const ModelState& null, const std::vector<int>& poses, Screened& of);
  /// Gain in nats over these poses, and the screened gain. Most values are wrong: where a third of the poses loses far
  /// more than `beside` nats, the other poses are skipped.
  std::pair<double, double> valueAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& latents, double beside = 0);
  /// Log-likelihoods of these poses with the hypothesis at these values.
  std::vector<double> likelihoodsAt(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& scaled_values, const std::vector<int>& poses,
                                    const SessionLatents& latents);
  /// Log-likelihoods of these poses with these echoes and latents. known_where_same: a pose whose echoes are the null's
  /// keeps the null's likelihood, as the latents then differ only in other echoes.
  std::vector<double> byPose(const ModelState& null, std::vector<PoseEchoes> echoes, const SessionLatents& latents,
                             const std::vector<int>& poses, bool known_where_same) const;
  /// Gain in nats and screened gain from the log-likelihoods `there` of these poses.
  std::pair<double, double> screenedGain(const ModelState& null, const Hypothesis& hypothesis,
                                         const std::vector<double>& there, const std::vector<int>& poses) const;
  /// Screened gain over all poses after a refit of the latents, which starts from those given.
  double screenedWithLatents(const ModelState& null, const Hypothesis& hypothesis,
                             const std::vector<double>& scaled_values, SessionLatents latents);
  /// Screened gain by the likelihood at some values.
  Screened directly(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses);

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
};

}  // namespace mmradartwin::diagnosis::search
