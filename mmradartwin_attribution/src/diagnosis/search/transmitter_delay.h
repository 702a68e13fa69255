#pragma once

#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// [slots] one-way delays of the transmitters' channels against those of the first one, metres. They are read from the
/// samples, without a twin: the product of one transmitter's samples with those of another, conjugated, is a tone whose
/// frequency is the delay's, whatever the echoes are.
std::vector<double> transmitterDelays_m(const ChannelData& data);

/// A transmitter's delay with starts at the measured one, the others' mean being none, and at four phases. Nothing for
/// another hypothesis.
std::optional<Screened> delayed(const Hypothesis& hypothesis, const std::vector<double>& delays_m);

}  // namespace mmradartwin::diagnosis::search
