#pragma once

#include <cmath>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// From one chirp's start to the next: as radar.yaml says, else as short as its samples allow.
inline double chirpPeriod_s(const RadarConfig& radar) {
  const double sampled_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  return (std::isfinite(radar.ramp_end_s) ? radar.ramp_end_s : sampled_s) +
         (std::isfinite(radar.idle_s) ? radar.idle_s : 0);
}

}  // namespace mmradartwin
