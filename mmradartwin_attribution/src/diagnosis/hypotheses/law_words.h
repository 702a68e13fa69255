#pragma once

#include <string>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::hypotheses {

/// A fitted law in words and numbers. A mechanism outside the catalogue is given by its name and values.
std::string describeLaw(const Hypothesis& hypothesis, const NamedParameters& fitted);
/// Channels of an empirical_law in words, such as " of channels 4 5"; "" where it has all of them.
std::string channelsInWords(const NamedParameters& law);
/// Measurement that would distinguish these candidates, as a sentence.
std::string experimentFor(const std::vector<CauseProbability>& candidates);

}  // namespace mmradartwin::diagnosis::hypotheses
