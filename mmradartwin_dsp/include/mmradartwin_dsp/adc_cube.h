#pragma once

#include <cstdint>
#include <vector>

namespace mmradartwin {

/// One frame of raw samples.
struct AdcCube {
  std::int64_t stamp_ns = 0;   ///< start of the frame
  std::uint32_t sequence = 0;  ///< frame number since arming
  int chirps = 0, samples = 0, receivers = 0;
  std::vector<std::int16_t> data;         ///< [chirp][sample][rx][I, Q], ADC counts
  std::vector<std::uint8_t> chirp_valid;  ///< [chirp] 1 where all of the chirp's bytes arrived
  std::uint64_t lost_bytes = 0;
};

}  // namespace mmradartwin
