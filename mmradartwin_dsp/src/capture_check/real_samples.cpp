#include "capture_check/real_samples.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstring>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

Eigen::FFT<double>& unscaledFft() {
  thread_local Eigen::FFT<double> unscaledFft(Eigen::FFT<double>::impl_type(), Eigen::FFT<double>::Unscaled);
  return unscaledFft;
}

std::int16_t rounded(double value) {
  return static_cast<std::int16_t>(std::lround(std::clamp(value, -32768.0, 32767.0)));
}

/// Byte of a receiver's real sample n in its chirp.
std::size_t place(const RadarConfig& radar, std::size_t rx, std::size_t n) {
  const auto samples = 2 * static_cast<std::size_t>(radar.samples_per_chirp);
  if (radar.layout == CaptureLayout::kTwoLane) return 2 * (rx * samples + n);
  return 2 * (n * static_cast<std::size_t>(radar.capture_receivers()) + rx);
}

}  // namespace

void decodeRealChirp(const RadarConfig& radar, const std::uint8_t* bytes, std::int16_t* samples) {
  const auto N = static_cast<std::size_t>(radar.samples_per_chirp);
  const auto receivers = static_cast<std::size_t>(radar.receivers());
  std::vector<Complex> time(2 * N), spectrum(2 * N), analytic(N);
  for (std::size_t rx = 0; rx < receivers; ++rx) {
    double highest = 0;
    for (std::size_t n = 0; n < 2 * N; ++n) {
      std::int16_t value;
      std::memcpy(&value, bytes + place(radar, rx, n), 2);
      time[n] = value;
      highest += n % 2 == 0 ? value : -value;
    }
    highest /= static_cast<double>(2 * N);
    unscaledFft().fwd(spectrum.data(), time.data(), static_cast<Eigen::Index>(2 * N));
    // A cos p becomes A exp(jp): the half of positive frequencies counts twice.
    for (std::size_t r = 0; r < N; ++r) spectrum[r] *= (r == 0 ? 1.0 : 2.0) / static_cast<double>(2 * N);
    unscaledFft().inv(analytic.data(), spectrum.data(), static_cast<Eigen::Index>(N));
    for (std::size_t n = 0; n < N; ++n) {
      // Without the highest frequency, which has no partner: the analytic signal's real part, and exactly, so that no
      // rounding hangs on the transform's last bit.
      samples[2 * (n * receivers + rx)] = rounded(time[2 * n].real() - highest);
      samples[2 * (n * receivers + rx) + 1] = rounded(analytic[n].imag());
    }
  }
}

void encodeRealChirp(const RadarConfig& radar, const std::int16_t* samples, std::uint8_t* bytes) {
  const auto N = static_cast<std::size_t>(radar.samples_per_chirp);
  const auto receivers = static_cast<std::size_t>(radar.receivers());
  std::vector<Complex> time(2 * N), spectrum(2 * N), analytic(N);
  for (std::size_t rx = 0; rx < receivers; ++rx) {
    for (std::size_t n = 0; n < N; ++n) {
      analytic[n] = {static_cast<double>(samples[2 * (n * receivers + rx)]),
                     static_cast<double>(samples[2 * (n * receivers + rx) + 1])};
    }
    std::fill(spectrum.begin(), spectrum.end(), Complex(0));
    unscaledFft().fwd(spectrum.data(), analytic.data(), static_cast<Eigen::Index>(N));
    unscaledFft().inv(time.data(), spectrum.data(), static_cast<Eigen::Index>(2 * N));
    for (std::size_t n = 0; n < 2 * N; ++n) {
      const std::int16_t value = rounded(time[n].real() / static_cast<double>(N));
      std::memcpy(bytes + place(radar, rx, n), &value, 2);
    }
  }
}

}  // namespace mmradartwin
