#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// One way in which the int16 words of a chirp may belong to receivers, samples, I and Q.
struct ByteReading {
  enum class Order { kFourLane, kTwoLane, kPairsByReceiver, kPairsBySample };
  Order order = Order::kFourLane;
  bool real = false;          ///< no Q
  std::size_t samples = 0;    ///< of a chirp
  std::size_t receivers = 0;  ///< with samples in use
  std::size_t lanes = 0;      ///< that have room, of kFourLane

  std::string name() const;    ///< "4lane", "real samples in 4lane", ...
  std::string advice() const;  ///< what to set or do where bytes are of this kind
  std::size_t words() const;   ///< of a chirp
  /// Word of I of a sample, and by how many words Q follows.
  std::size_t wordOf(std::size_t receiver, std::size_t sample) const;
  std::size_t qBehind() const;
};

/// What radar.yaml states, and all others that captures of its receivers and samples are known to come in.
ByteReading statedReading(const RadarConfig& radar);
std::vector<ByteReading> otherReadings(const RadarConfig& radar);

/// Words of the loops that differ least from the one before or behind, half of them: a burst in a few chirps says
/// nothing of layouts. The choice is the same for all readings.
std::vector<std::int16_t> quietLoops(const std::vector<std::int16_t>& words, std::size_t loop);

/// How concentrated the range spectra of words are in a reading. Readings only permute the words, so that the numbers
/// of two of them for the same words differ by the log-likelihood ratio of Gaussian spectra, per bin.
struct Concentration {
  double nats = 0;      ///< minus the mean over bins of the log of a bin's power: the higher, the more concentrated
  double variance = 0;  ///< of that, by chance
};
/// `slots`: chirps that follow each other before the same transmitter sends again.
Concentration concentrationOf(const ByteReading& reading, std::size_t slots, const std::int16_t* words,
                              std::size_t count);

/// Range spectra [slot * receivers + rx][bin] of words, averaged over the chirps of a slot.
std::vector<std::vector<std::complex<double>>> averageSpectra(const ByteReading& reading, std::size_t slots,
                                                              const std::int16_t* words, std::size_t count);

}  // namespace mmradartwin
