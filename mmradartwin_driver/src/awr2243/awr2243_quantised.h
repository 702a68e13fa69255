#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

constexpr double kAwr2243StartFrequencyStep_hz = 3.6e9 / 67108864.0;           ///< 53.644 Hz
constexpr double kAwr2243SlopeStep_hz_per_s = 3.6e6 * 900 / 67108864.0 * 1e9;  ///< 48.28 kHz/us
constexpr double kAwr2243TimeStep_s = 10e-9;
constexpr double kAwr2243PeriodStep_s = 5e-9;

/// Values of a radar.yaml in the device's own units.
struct Awr2243Registers {
  std::uint32_t start_frequency = 0;  ///< 3.6e9/2^26 Hz
  std::int16_t slope = 0;             ///< 3.6e6*900/2^26 kHz/us
  std::uint32_t idle = 0;             ///< 10 ns
  std::uint32_t adc_start = 0;        ///< 10 ns
  std::uint32_t ramp_end = 0;         ///< 10 ns
  std::uint16_t samples = 0;
  std::uint16_t sample_rate_ksps = 0;
  std::uint8_t highpass1 = 0, highpass2 = 0;  ///< codes of the corner frequencies
  std::uint16_t rx_gain_db = 0;
  std::uint8_t tx_backoff_db = 0;
  std::uint16_t rx_mask = 0;                 ///< bit per receiver
  std::vector<std::uint16_t> chirp_tx_mask;  ///< per slot, bit per transmitter
  std::uint16_t loops = 0;
  std::uint32_t frame_period = 0;  ///< 5 ns
  bool q_first = false;

  std::uint16_t tx_mask() const;  ///< of all slots
};

/// Rounds the values of `radar` to those of the device, in its units. The optional keys of radar.yaml that configure a
/// device are required. Throws InputError naming `file`, the key, its value and the allowed range.
Awr2243Registers quantiseAwr2243(const RadarConfig& radar, const std::string& file);

/// `radar` with the values that the device uses (a slope of 75 MHz/us becomes 74.978).
RadarConfig withQuantisedValues(const RadarConfig& radar, const Awr2243Registers& registers);

}  // namespace mmradartwin
