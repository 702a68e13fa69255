#pragma once

#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

struct ScreenedLaws {
  std::vector<Screened> laws;     ///< best first
  bool gains_follow_time = true;  ///< false: poses differ in gain by far more than steps or a slope explain, and
                                  ///< gain_drift is no name for it
};

/// Laws without a name that the session promises, best first, at most one per observable (gain, delay or angle of
/// paths, gain and phase of a transmitter's or a receiver's channels) and variable (LawVariable). Paths that stand out
/// where they are expected are measured one by one: level, range and azimuth against the state's; a law is a regression
/// of these over the variable, robust and beside the errors that actors have of their own. Forms are curves of a few
/// nodes, ripples, sectors (steps among them) and, over the floor plan, spots; the one that explains most for its
/// numbers is taken. Promises are what it takes off the paths' scatter, in nats, over how much more than by chance
/// places scatter. Steps of all levels between poses have a name, gain_drift, and stand among them where gains follow
/// time.
ScreenedLaws screenLaws(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                        const std::vector<int>& poses);

/// How many laws screenLaws() compares, as a family.
constexpr int kLawFamily = 400;

}  // namespace mmradartwin::diagnosis::search
