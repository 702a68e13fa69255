#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "test_radar.h"

namespace mmradartwin {

/// The paper's radar with 32 loops in a frame and a chirp each 60 us: bins of 0.5 m/s.
inline RadarConfig loopedRadar(int loops = 32) {
  RadarConfig radar = paperRadar();
  radar.loops_per_frame = loops;
  radar.idle_s = 30e-6;
  radar.ramp_end_s = 30e-6;
  return radar;
}

/// A point that goes straight away from the radar, or towards it where the speed is negative.
struct MovingEcho {
  double range_m, azimuth_rad, speed_m_per_s;
  double amplitude;  ///< ADC counts
};

/// One frame: the place of each echo at the start of each chirp, and white noise.
inline AdcCube movingFrame(const RadarConfig& radar, const std::vector<MovingEcho>& echoes, double noise_counts,
                           unsigned seed) {
  AdcCube cube;
  cube.stamp_ns = 1'700'000'000'000'000'000;
  cube.chirps = radar.chirps_per_frame();
  cube.samples = radar.samples_per_chirp;
  cube.receivers = radar.receivers();
  cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_counts);
  for (int chirp = 0; chirp < cube.chirps; ++chirp) {
    const double time_s = chirp * (radar.idle_s + radar.ramp_end_s);
    ComplexGrid x = ComplexGrid::Zero(radar.channels(), cube.samples);
    for (const MovingEcho& echo : echoes) {
      x += pointTarget(radar, echo.range_m + echo.speed_m_per_s * time_s, echo.azimuth_rad, echo.amplitude);
    }
    const int first = chirp % radar.slots() * cube.receivers;
    for (int n = 0; n < cube.samples; ++n) {
      for (int rx = 0; rx < cube.receivers; ++rx) {
        cube.data.push_back(static_cast<std::int16_t>(std::lround(x(first + rx, n).real() + noise(random))));
        cube.data.push_back(static_cast<std::int16_t>(std::lround(x(first + rx, n).imag() + noise(random))));
      }
    }
  }
  return cube;
}

}  // namespace mmradartwin
