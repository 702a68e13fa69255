#pragma once

#include <vector>

#include "channel_data.h"
#include "hypothesis_fit.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// What a fitted hypothesis says, as a finding without its gain on held-out places. `fits`: all of the round, by rank;
/// `before`: what the twin without it came to.
Finding findingOf(const HypothesisFit& best, const std::vector<HypothesisFit>& fits, const ModelState& before,
                  const Scene& scene, const ChannelData& data);

/// Of an actor_unmodelled, for people.
std::string sizeAndPlace(const HypothesisFit& object);

/// An actor that is gone explains as much as the same one moved away, without a number: that something is wrong with it
/// is then as sure.
void believeAbsences(std::vector<HypothesisFit>& fits);

}  // namespace mmradartwin
