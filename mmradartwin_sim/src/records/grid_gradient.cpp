#include "mmradartwin_sim/grid_gradient.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace mmradartwin {

template <typename Growth>
ComplexGrid GridGradient::byLength(Growth growth) const {
  const std::complex<double> turn(0, 2 * M_PI / kSpeedOfLight_m_per_s);
  // One part stays the same over the samples, the other grows with them.
  std::vector<PathRecord> steady, rising;
  for (const PathRecord& r : records_) {
    PathRecord a;
    a.length_m = r.length_m;
    PathRecord b = a;
    for (std::size_t k = 0; k < r.c.size(); ++k) {
      const double tau_s = r.length_m[k] / kSpeedOfLight_m_per_s;
      const std::complex<double> share = turn * growth(r, k) * r.c[k];
      a.c.push_back(share * (radar_.center_frequency_hz() - radar_.slope_hz_per_s * tau_s));
      b.c.push_back(share * radar_.slope_hz_per_s);
    }
    steady.push_back(std::move(a));
    rising.push_back(std::move(b));
  }
  ComplexGrid x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp), slope = x;
  accumulate(radar_, steady, x);
  accumulate(radar_, rising, slope);
  for (int n = 0; n < radar_.samples_per_chirp; ++n) {
    x.col(n) += (radar_.sample_time_s(n) - radar_.window_center_s()) * slope.col(n);
  }
  return x;
}

ComplexGrid GridGradient::byRangeBias_per_m() const {
  return byLength([](const PathRecord&, std::size_t) { return 2.0; });
}

ComplexGrid GridGradient::byRangeScale() const {
  std::vector<PathRecord> rising = records_;
  for (PathRecord& r : rising) {
    for (std::size_t k = 0; k < r.c.size(); ++k) {
      r.c[k] *= std::complex<double>(0, 2 * M_PI * radar_.slope_hz_per_s * r.length_m[k] / kSpeedOfLight_m_per_s);
    }
  }
  ComplexGrid x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
  accumulate(radar_, rising, x);
  for (int n = 0; n < radar_.samples_per_chirp; ++n) x.col(n) *= radar_.sample_time_s(n) - radar_.window_center_s();
  return x;
}

ComplexGrid GridGradient::byWeight_per_db() const {
  ComplexGrid x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
  accumulate(radar_, records_, x);
  return x * (std::log(10.0) / 20);
}

ComplexGrid GridGradient::byYaw_per_rad() const {
  const std::size_t receivers = radar_.rx_position_m.size();
  return byLength([&](const PathRecord& r, std::size_t k) {
    // Seen from the turned radar, directions turn the other way.
    const auto turned = [](const Eigen::Vector3d& u) { return Eigen::Vector3d(-u.y(), u.x(), 0); };
    const Eigen::Vector3d &tx = radar_.tx_position_m[k / receivers], &rx = radar_.rx_position_m[k % receivers];
    return turned(r.departure).dot(tx) + turned(r.arrival).dot(rx);
  });
}

ComplexGrid GridGradient::byChannelPhase_per_rad(int channel) const {
  if (channel < 0 || channel >= radar_.channels())
    throw std::invalid_argument("GridGradient: there is no channel " + std::to_string(channel));
  ComplexGrid x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
  accumulate(radar_, records_, x);
  ComplexGrid gradient = ComplexGrid::Zero(x.rows(), x.cols());
  gradient.row(channel) = std::complex<double>(0, 1) * x.row(channel);
  return gradient;
}

}  // namespace mmradartwin
