#pragma once

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// The paper's deployment (docs/reference/contracts.md section 3), two transmitters before four receivers with the
/// pitch at exactly half the wavelength of 77 GHz: what tests and benchmarks of all packages measure with. 1024 bytes
/// per chirp, 2048 per frame.
inline RadarConfig paperRadar() {
  RadarConfig radar;
  radar.device = "awr2243";
  radar.carrier_hz = 77e9;
  radar.slope_hz_per_s = 75e12;
  radar.samples_per_chirp = 64;
  radar.sample_rate_hz = 5e6;
  radar.adc_start_s = 6e-6;
  radar.loops_per_frame = 1;
  radar.frame_period_s = 0.05;
  const double d = kSpeedOfLight_m_per_s / 77e9 / 2;
  radar.tx_position_m = {{0, 0, 0}, {0, 4 * d, 0}};
  radar.rx_position_m = {{0, 0, 0}, {0, d, 0}, {0, 2 * d, 0}, {0, 3 * d, 0}};
  return radar;
}

}  // namespace mmradartwin
