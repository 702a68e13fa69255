#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/parameters.h"

namespace mmradartwin::diagnosis::rounds {

/// Variable of laws over the angle of an element pattern: "azimuth_deg"; nothing for other mechanisms.
std::optional<std::string> angleOfPattern(const Hypothesis& hypothesis);
/// True of a law without a name, of the level of all echoes over this variable.
bool isLawOfAllLevels(const Hypothesis& hypothesis, const std::string& variable);

/// Hypothesis that a pattern is a curve of angles_deg and gain_db, a cubic spline in dB that is 0 at 0 degrees, and
/// scaled values with which it is the product of a power of the cosine (one way) and a law (two ways). Beyond the outer
/// nodes it goes on as a straight line.
std::pair<Hypothesis, std::vector<double>> patternCurve(Hypothesis hypothesis, const Parameters& of_cosine,
                                                        const Parameters& law);

}  // namespace mmradartwin::diagnosis::rounds
