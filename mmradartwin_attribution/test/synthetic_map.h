#pragma once

#include <cmath>
#include <complex>
#include <vector>

#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace synthetic {

constexpr double kDegree = M_PI / 180.0;

struct Target {
  double range_m, azimuth_deg, level_db;
};

/// Far-field samples of point targets in closed form: a tone of r/(c/2B) cycles per window and exp(-j 2 pi d k
/// sin(theta)/lambda) over the elements; `conjugate` as a receiver with I and Q swapped delivers them.
inline ReceiveGrid grid(const RadarConfig& radar, const std::vector<Target>& targets, bool conjugate = false) {
  ReceiveGrid g;
  g.full_scale = 1;
  g.frames = 1;
  g.x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  const double d = radar.virtual_pitch_m();
  double start_phase = 0.3;
  for (const Target& t : targets) {
    start_phase += 1.7;  // targets do not share a phase
    for (int k = 0; k < radar.channels(); ++k) {
      for (int n = 0; n < radar.samples_per_chirp; ++n) {
        const double phase = start_phase + 2 * M_PI * t.range_m / radar.range_bin_m() * n / radar.samples_per_chirp -
                             2 * M_PI * d * k * std::sin(t.azimuth_deg * kDegree) / radar.wavelength_m();
        g.x(k, n) += std::polar(std::pow(10.0, t.level_db / 20), phase);
      }
    }
  }
  if (conjugate) g.x = g.x.conjugate().eval();
  return g;
}

inline RangeAngleMap map(const RadarConfig& radar, const std::vector<Target>& targets) {
  return SignalChain(radar).map(grid(radar, targets));
}

}  // namespace synthetic
}  // namespace mmradartwin
