#pragma once

#include <functional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Replicas of echoes at one distance behind or before them (echo_replica): the best of all echoes, and the best of
/// those that meet one actor. Distances are scanned by scores of power that stands where replicas of the expected
/// echoes would, from where they would come; those that promise more than `least` nats are judged by `look`.
std::vector<Screened> screenReplicas(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                                     const std::vector<int>& poses, double least,
                                     const std::function<Screened(const Hypothesis&)>& look);

}  // namespace mmradartwin::diagnosis::search
