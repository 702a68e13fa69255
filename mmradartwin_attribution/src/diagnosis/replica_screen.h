#pragma once

#include <vector>

#include "hypothesis_fit.h"
#include "session_model.h"

namespace mmradartwin {

/// Replicas of echoes at one distance behind or before them (echo_replica) that the session promises, best first: the
/// best of all echoes, and the best of those that meet one actor. Distances are scanned; at each, scores are summed of
/// power that stands where replicas of the expected echoes would, from where they would come. What they promise is a
/// quadratic's, of the best of hundreds: it wants a look at the likelihood itself.
std::vector<Screened> screenReplicas(const Twin& base, const SessionModel& model, const ModelState& null,
                                     const std::vector<int>& poses);

}  // namespace mmradartwin
