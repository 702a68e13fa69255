#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "capture_check/byte_reading.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// What a receiver that delivers nothing does deliver, in words ("only zeros", "a constant -1"), by its number.
using SilentReceivers = std::map<int, std::string>;

/// Receivers of which I or Q never changes in words of whole chirps.
SilentReceivers silentReceivers(const ByteReading& reading, const std::vector<std::int16_t>& words);
/// Those that both have, with what is said of them where they say the same.
SilentReceivers commonTo(const SilentReceivers& a, const SilentReceivers& b);

/// Leaves receivers out of a recording's frames, radar and channel correction.
void leaveOut(const SilentReceivers& silent, Recording& recording);

}  // namespace mmradartwin
