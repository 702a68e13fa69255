#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "capture_check/byte_reading.h"

namespace mmradartwin {

/// Where chirps begin in words that may begin within one.
struct ChirpBoundary {
  /// First word of a chirp or, in two lanes, of a receiver's part of one: from 0 to below the period after which the
  /// next begins.
  std::size_t word = 0, period = 0;
  std::size_t stride = 0;              ///< words from one sample of a lane to the next
  Concentration from_there;            ///< of the words from there on
  Concentration from_the_start;        ///< of as many words as they stand
  double nats = 0, nats_at_start = 0;  ///< of one period, by which the words break there and where they begin
  std::vector<double> breaks;          ///< [period] the same nats from each word on
  /// How smooth the virtual line is where the frame's first chirp begins with that word, or so many periods later:
  /// mean over range bins of the share of the power that one phase step between neighbours explains.
  std::vector<double> smoothness;

  /// True where the words break far more there than where they begin, and the spectra do not speak against it. `tries`:
  /// captures that are looked at.
  bool breaksThere(double tries) const;
};

/// A glance at two lanes: false where the words break nowhere more than where they begin. It costs little beside
/// reading.
bool mayBeginWithin(const ByteReading& reading, const std::vector<std::int16_t>& words);

/// Finds the boundary as the place at which the words of a lane break with those before, in chirp after chirp, and
/// among its neighbours by concentration. Empty where the words begin with a chirp, nothing breaks, or fewer than four
/// chirps are there.
std::optional<ChirpBoundary> findChirpBoundary(const ByteReading& reading, std::size_t slots,
                                               const std::vector<std::int16_t>& words);

}  // namespace mmradartwin
