#include "mmradartwin_dsp/range_angle.h"

#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <unsupported/Eigen/FFT>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// Level of a cell without any signal, instead of minus infinity.
constexpr double kFloor_db = -400;

/// kissfft keeps its plans by length and scratch space inside this object, so each thread has its own.
Eigen::FFT<double>& fft() {
  thread_local Eigen::FFT<double> fft(Eigen::FFT<double>::impl_type(), Eigen::FFT<double>::Unscaled);
  return fft;
}

std::string shape(const ComplexGrid& grid) {
  return std::to_string(grid.rows()) + " channels x " + std::to_string(grid.cols()) + " samples";
}

}  // namespace

std::vector<double> hannWindow(int samples) {
  std::vector<double> window(static_cast<std::size_t>(samples));
  for (int n = 0; n < samples; ++n) {
    window[static_cast<std::size_t>(n)] = 0.5 * (1 - std::cos(2 * M_PI * n / samples));
  }
  return window;
}

struct SignalChain::Plan {
  explicit Plan(const RadarConfig& config) : radar(config), line(config.virtualLine()) {
    const std::vector<double> hann = hannWindow(radar.samples_per_chirp);
    window = Eigen::Map<const Eigen::ArrayXd>(hann.data(), static_cast<Eigen::Index>(hann.size()));
    window_sum = window.sum();
    for (int r = 0; r < radar.samples_per_chirp; ++r) axes.range_m.push_back(r * radar.range_bin_m());
    for (int a = 0; a < kAngleBins; ++a) {
      const double sine = (a - kAngleBins / 2) / (kAngleBins / 2.0) * radar.wavelength_m() / (2 * line.pitch_m);
      axes.azimuth_rad.push_back(std::abs(sine) <= 1 ? std::asin(sine) : std::numeric_limits<double>::quiet_NaN());
    }
  }

  void checkShape(const ComplexGrid& grid) const {
    if (grid.rows() == radar.channels() && grid.cols() == radar.samples_per_chirp) return;
    throw InputError("a grid of " + shape(grid) + " does not fit the radar, which has " +
                     std::to_string(radar.channels()) + " channels x " + std::to_string(radar.samples_per_chirp) +
                     " samples");
  }

  RadarConfig radar;
  VirtualLine line;
  Eigen::ArrayXd window;
  double window_sum = 0;
  RangeAngleAxes axes;
};

SignalChain::SignalChain(const RadarConfig& radar) : plan_(std::make_unique<Plan>(radar)) {}
SignalChain::~SignalChain() = default;
SignalChain::SignalChain(SignalChain&&) noexcept = default;
SignalChain& SignalChain::operator=(SignalChain&&) noexcept = default;

const RadarConfig& SignalChain::radar() const { return plan_->radar; }
const RangeAngleAxes& SignalChain::axes() const { return plan_->axes; }

ComplexGrid SignalChain::rangeSpectra(const ComplexGrid& x) const {
  plan_->checkShape(x);
  ComplexGrid spectra(x.rows(), x.cols());
  thread_local std::vector<std::complex<double>> windowed;
  windowed.resize(static_cast<std::size_t>(x.cols()));
  for (Eigen::Index k = 0; k < x.rows(); ++k) {
    for (Eigen::Index n = 0; n < x.cols(); ++n) windowed[static_cast<std::size_t>(n)] = x(k, n) * plan_->window[n];
    fft().fwd(spectra.row(k).data(), windowed.data(), x.cols());
  }
  return spectra;
}

ComplexGrid SignalChain::spatialSpectra(const ComplexGrid& range_spectra) const {
  plan_->checkShape(range_spectra);
  ComplexGrid spectra(range_spectra.cols(), kAngleBins);
  // exp(+j 2 pi d k sin(theta_a)/lambda_c) = exp(j pi k (a - 32)/32) = (-1)^k exp(j 2 pi k a/64): an inverse FFT of
  // length 64 with alternating signs. It repeats after 64 elements, so larger arrays are folded, not cut.
  std::array<std::complex<double>, kAngleBins> elements;
  for (Eigen::Index r = 0; r < range_spectra.cols(); ++r) {
    elements.fill(0);
    for (std::size_t k = 0; k < plan_->line.channels.size(); ++k) {
      const std::complex<double> x = range_spectra(plan_->line.channels[k], r);
      const auto place = static_cast<std::size_t>(plan_->line.places[k]);
      place % 2 == 0 ? elements[place % kAngleBins] += x : elements[place % kAngleBins] -= x;
    }
    fft().inv(spectra.row(r).data(), elements.data(), kAngleBins);
  }
  return spectra;
}

RangeAngleMap SignalChain::map(const ReceiveGrid& grid) const {
  const ComplexGrid spectra = spatialSpectra(rangeSpectra(grid.x));
  RangeAngleMap map;
  map.stamp_ns = grid.stamp_ns;
  map.source = grid.source;
  map.axes = plan_->axes;
  map.frames = grid.frames;
  map.pose_valid = grid.pose_valid;
  map.T_map_radar = grid.T_map_radar;
  const double full_scale = static_cast<double>(plan_->line.channels.size()) * plan_->window_sum * grid.full_scale;
  map.power_db = (10 * (spectra.array().abs2() / (full_scale * full_scale)).log10()).max(kFloor_db);
  for (int a = 0; a < kAngleBins; ++a) {
    if (std::isnan(plan_->axes.azimuth_rad[static_cast<std::size_t>(a)])) {
      map.power_db.col(a).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  }
  return map;
}

}  // namespace mmradartwin
