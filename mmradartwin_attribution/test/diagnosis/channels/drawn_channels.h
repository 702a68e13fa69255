#pragma once

#include <cmath>
#include <complex>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {

/// A tone at a range, from a direction, with its amplitude and phase at the window's centre.
struct DrawnTone {
  double range_m = 0, sine = 0;
  std::complex<double> amplitude = 1;
};

/// Phase of each channel for a direction.
inline Eigen::VectorXcd arrayResponse(const RadarConfig& radar, double sine) {
  Eigen::VectorXcd v(radar.channels());
  for (int k = 0; k < radar.channels(); ++k) {
    v[k] = std::polar(1.0, -2 * M_PI * radar.virtual_element_m(k).y() * sine / radar.wavelength_m());
  }
  return v;
}

/// Adds a tone with any channels: exp(j 2 pi slope (2 r / c) (t - t_centre)).
inline void addTone(const RadarConfig& radar, double range_m, const Eigen::VectorXcd& channels, ComplexGrid& x) {
  const double beat_hz = radar.slope_hz_per_s * 2 * range_m / 299792458.0;
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    const double t_s = (n - 0.5 * radar.samples_per_chirp) / radar.sample_rate_hz;
    x.col(n) += std::polar(1.0, 2 * M_PI * beat_hz * t_s) * channels;
  }
}

inline ComplexGrid gridOf(const RadarConfig& radar, const std::vector<DrawnTone>& tones) {
  ComplexGrid x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  for (const DrawnTone& t : tones) addTone(radar, t.range_m, t.amplitude * arrayResponse(radar, t.sine), x);
  return x;
}

/// Range spectra by the plain sum over samples: Hann's window, divided by its sum and full scale.
inline Eigen::MatrixXcd spectraOf(const ReceiveGrid& grid) {
  const auto samples = static_cast<int>(grid.x.cols());
  Eigen::MatrixXcd transform(samples, samples);
  for (int n = 0; n < samples; ++n) {
    const double window = 0.5 * (1 - std::cos(2 * M_PI * n / samples));
    for (int r = 0; r < samples; ++r) {
      transform(n, r) = std::polar(window / (0.5 * samples * grid.full_scale), -2 * M_PI * (n * r % samples) / samples);
    }
  }
  return grid.x * transform;
}

/// A session of poses, one a location each, whose grids are as given; noise_power is that of the cells.
inline ChannelData sessionOf(const RadarConfig& radar, const std::vector<ComplexGrid>& grids, double noise_power) {
  ChannelData data;
  data.radar = radar;
  for (const ComplexGrid& x : grids) {
    PoseChannels& p = data.poses.emplace_back();
    p.location = static_cast<int>(data.locations.size());
    data.locations.push_back("l" + std::to_string(p.location));
    p.pose.name = "p" + std::to_string(p.location);
    p.pose.location = data.locations.back();
    p.grid.x = x;
    p.grid.full_scale = 1;
    p.range_spectra = spectraOf(p.grid);
    p.noise_power = noise_power;
  }
  return data;
}

}  // namespace mmradartwin::diagnosis
