#pragma once

#include <string>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::hypotheses {

/// Values and 95 % intervals of the parameters that describe a cause. scaled_values: [coordinates]. standard_error:
/// [coordinates] of the values in their units, from the scatter over that many locations (Student's t).
std::vector<FindingParameter> fittedParameters(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                                               const std::vector<double>& standard_error, const std::string& cause,
                                               std::size_t locations);

/// Nats by which the values differ from those that do nothing. The errors are those of the intervals, taken as
/// independent.
double natsFromNothing(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                       const std::vector<double>& standard_error);

}  // namespace mmradartwin::diagnosis::hypotheses
