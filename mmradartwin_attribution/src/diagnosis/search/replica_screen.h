#pragma once

#include <functional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Replicas of echoes at one distance behind or before them (echo_replica): the best one of all echoes, the best one of
/// the echoes that meet one actor, and a second face within the main lobe of one actor's echoes. A scan sums the power
/// where replicas of the expected echoes would be, from the direction that they would have. Distances with a gain above
/// least_nats are then judged by `look`.
std::vector<Screened> screenReplicas(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                                     const std::vector<int>& poses, double least_nats,
                                     const std::function<Screened(const Hypothesis&)>& look);

}  // namespace mmradartwin::diagnosis::search
