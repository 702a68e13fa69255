#pragma once

#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/hiding_places.h"

namespace mmradartwin::diagnosis::search {

/// Laws without a name that the paths of a session support.
struct ScreenedLaws {
  std::vector<Screened> laws;  ///< best first
  /// False where gains differ between poses by far more than steps or a slope over time explain, so that gain_drift is
  /// no name for it.
  bool gains_follow_time = true;
  std::vector<HidingPlace> hiding;  ///< places where something stands before echoes that are not there
};

/// Laws without a name that a session supports: at most one per observable (gain, delay or angle of paths, gain and
/// phase of a transmitter's or a receiver's channels) and variable (LawVariable). Each path that stands out where it is
/// expected is measured: level, range and azimuth relative to the state's. A law is a robust regression of these
/// deviations on the variable, given the errors of the actors. Its form is a curve of a few nodes, a ripple, a sector
/// (steps among them) or, over the floor plan, a spot; the form that explains most for its numbers is taken. The
/// screened gain is in nats over the overdispersion. Steps of the gain between poses have a name, gain_drift; they are
/// among the laws where gains follow time.
ScreenedLaws screenLaws(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                        const std::vector<int>& poses);

/// Number of laws that screenLaws() compares, as a family of hypotheses.
constexpr int kLawFamily = 400;

}  // namespace mmradartwin::diagnosis::search
