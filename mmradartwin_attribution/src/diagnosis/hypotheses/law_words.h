#pragma once

#include <string>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::hypotheses {

/// A fitted law in words and numbers; for a mechanism outside the catalogue its name and values.
std::string describeLaw(const Hypothesis& hypothesis, const NamedParameters& fitted);
/// " of channels 4 5", "" for an empirical_law of all of them.
std::string channelsInWords(const NamedParameters& law);
/// What to measure so that these candidates can be told apart.
std::string experimentFor(const std::vector<CauseProbability>& candidates);

}  // namespace mmradartwin::diagnosis::hypotheses
