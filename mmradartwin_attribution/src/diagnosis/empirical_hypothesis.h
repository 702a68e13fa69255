#pragma once

#include <string>
#include <vector>

#include "channel_data.h"
#include "hypothesis.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin {

/// Laws without a name: gain, delay or angle of paths against one variable, as the mechanism empirical_law knows them.
std::vector<Hypothesis> empiricalHypotheses(const ChannelData& data, const std::vector<NamedParameters>& present);
/// A fitted law in words and numbers; for a mechanism outside the catalogue its name and values.
std::string describeLaw(const Hypothesis& hypothesis, const NamedParameters& fitted);
/// What to measure so that these candidates can be told apart.
std::string experimentFor(const std::vector<CauseProbability>& candidates);

}  // namespace mmradartwin
