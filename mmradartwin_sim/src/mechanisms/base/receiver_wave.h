#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Phases [receivers] of a plane wave from a direction of the horizontal plane in radar_link.
inline Eigen::VectorXcd receiverWave(const RadarConfig& radar, double azimuth_deg) {
  const double azimuth_rad = azimuth_deg * M_PI / 180;
  const Eigen::Vector3d towards(std::cos(azimuth_rad), std::sin(azimuth_rad), 0);
  Eigen::VectorXcd wave(radar.receivers());
  for (Eigen::Index r = 0; r < wave.size(); ++r) {
    const double along_m = radar.rx_position_m[static_cast<std::size_t>(r)].dot(towards);
    wave[r] = std::polar(1.0, -2 * M_PI * along_m / radar.wavelength_m());
  }
  return wave;
}

}  // namespace mmradartwin
