#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <functional>
#include <random>
#include <vector>

#include "diagnosis/frames/frame_stack.h"
#include "diagnosis/frames/payload_defects.h"
#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {

/// Which value of a recording.
struct SamplePlace {
  int frame, loop, slot, receiver, sample;
};

/// Frames of int16 samples whose truth is a function of the place, with normal noise on I and on Q.
class DrawnFrames {
 public:
  using Signal = std::function<std::complex<double>(const SamplePlace&)>;

  explicit DrawnFrames(const RadarConfig& radar, unsigned seed = 1) : radar_(radar), random_(seed) {}

  std::vector<AdcCube> cubes(int frames, double noise_rms, const Signal& signal) {
    std::normal_distribution<double> noise(0, noise_rms > 0 ? noise_rms : 1);
    std::vector<AdcCube> all(static_cast<std::size_t>(frames));
    for (int f = 0; f < frames; ++f) {
      AdcCube& cube = all[static_cast<std::size_t>(f)];
      cube.sequence = static_cast<std::uint32_t>(f);
      cube.stamp_ns = std::llround(1e9 * radar_.frame_period_s) * f;
      cube.chirps = radar_.loops_per_frame * radar_.slots();
      cube.samples = radar_.samples_per_chirp;
      cube.receivers = radar_.receivers();
      cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
      for (int chirp = 0; chirp < cube.chirps; ++chirp) {
        for (int n = 0; n < cube.samples; ++n) {
          for (int r = 0; r < cube.receivers; ++r) {
            const std::complex<double> v = signal({f, chirp / radar_.slots(), chirp % radar_.slots(), r, n});
            for (double part : {v.real(), v.imag()}) {
              const double noisy = part + (noise_rms > 0 ? noise(random_) : 0);
              cube.data.push_back(static_cast<std::int16_t>(std::lround(std::clamp(noisy, -32768.0, 32767.0))));
            }
          }
        }
      }
    }
    return all;
  }
  FrameStack stack(int frames, double noise_rms, const Signal& signal) {
    const std::vector<int> order = payloadOrder(radar_);
    return FrameStack(radar_, toPayload(cubes(frames, noise_rms, signal), order), order);
  }
  std::mt19937_64& random() { return random_; }

 private:
  RadarConfig radar_;
  std::mt19937_64 random_;
};

/// Far-field echo of a point: a beat of range over range bin cycles a chirp, and the phase of its direction over the
/// array.
inline std::complex<double> echoSample(const RadarConfig& radar, double amplitude, double range_m, double azimuth_rad,
                                       const SamplePlace& place) {
  const int k = place.slot * radar.receivers() + place.receiver;
  const double beat = range_m / radar.range_bin_m() * place.sample / radar.samples_per_chirp;
  const double across = radar.virtual_element_m(k).y() * std::sin(azimuth_rad) / radar.wavelength_m();
  const double round_trip = 2 * range_m / radar.wavelength_m();
  return std::polar(amplitude, 2 * M_PI * (beat - across + std::fmod(round_trip, 1.0)));
}

}  // namespace mmradartwin::diagnosis
