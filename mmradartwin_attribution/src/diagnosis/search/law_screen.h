#pragma once

#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Laws that a session promises.
struct ScreenedLaws {
  std::vector<Screened> laws;  ///< best first
  /// False where poses differ in gain by far more than steps or a slope explain: gain_drift is no name for it.
  bool gains_follow_time = true;
};

/// Laws without a name that a session promises: at most one per observable (gain, delay or angle of paths, gain and
/// phase of a transmitter's or a receiver's channels) and variable (LawVariable). Paths that stand out where they are
/// expected are measured one by one: level, range and azimuth against the state's. A law is a robust regression of
/// these deviations on the variable, beside the errors of the actors. Its form is a curve of a few nodes, a ripple, a
/// sector (a step among them) or, over the floor plan, a spot: the one that explains most for its numbers. A promise is
/// the gain in nats over the overdispersion. Steps of the gain between poses have a name, gain_drift; they are among
/// the laws where gains follow time.
ScreenedLaws screenLaws(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                        const std::vector<int>& poses);

/// Number of laws that screenLaws() compares, as a family of hypotheses.
constexpr int kLawFamily = 400;

}  // namespace mmradartwin::diagnosis::search
