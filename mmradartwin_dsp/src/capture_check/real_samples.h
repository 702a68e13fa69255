#pragma once

#include <cstdint>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// One chirp of 2N real samples of each receiver <-> N complex ones [sample][rx][I, Q], the analytic signal at half the
/// rate. Four lanes carry one sample of each receiver after the other, two lanes all samples of a receiver.
void decodeRealChirp(const RadarConfig& radar, const std::uint8_t* bytes, std::int16_t* samples);
void encodeRealChirp(const RadarConfig& radar, const std::int16_t* samples, std::uint8_t* bytes);

}  // namespace mmradartwin
