#pragma once

#include <string>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::hypotheses {

/// Values and 95 % intervals of the parameters that a cause is described by. scaled: of the hypothesis' coordinates;
/// standard_error: of their values, from the scatter over that many locations (Student's t).
std::vector<FindingParameter> fittedParameters(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                                               const std::vector<double>& standard_error, const std::string& cause,
                                               std::size_t locations);

/// Nats by which the values lie off those that do nothing, by the errors that their intervals have, taken as
/// independent.
double natsFromNothing(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                       const std::vector<double>& standard_error);

}  // namespace mmradartwin::diagnosis::hypotheses
