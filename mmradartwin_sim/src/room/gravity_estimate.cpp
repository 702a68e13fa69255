#include <algorithm>
#include <cmath>

#include "mmradartwin_sim/room_registration.h"

namespace mmradartwin {
namespace {

constexpr double kWindow_s = 0.5;
constexpr std::size_t kFewest = 10;
constexpr double kGravity_m_per_s2 = 9.81;
// An accelerometer's offset and scale error reach some 0.1 m/s^2; a rig that is carried shows more than these.
constexpr double kAccelerationError_m_per_s2 = 0.4, kTurnRate_rad_per_s = 0.15;

}  // namespace

void GravityEstimate::add(double stamp_s, const Eigen::Vector3d& acceleration, const Eigen::Vector3d& turn_rate) {
  if (!samples_.empty() && stamp_s < samples_.back().stamp_s) samples_.clear();  // time went back: a bag that loops
  if (!acceleration.allFinite() || !turn_rate.allFinite()) return;
  samples_.push_back({stamp_s, acceleration, turn_rate});
  const auto old = [&](const Sample& s) { return s.stamp_s < stamp_s - kWindow_s; };
  samples_.erase(samples_.begin(), std::find_if_not(samples_.begin(), samples_.end(), old));
}

std::optional<Eigen::Vector3d> GravityEstimate::up(double stamp_s) const {
  if (samples_.size() < kFewest || std::abs(stamp_s - samples_.back().stamp_s) > kWindow_s) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Sample& s : samples_) {
    mean += s.acceleration;
    if (s.turn_rate.norm() > kTurnRate_rad_per_s) return std::nullopt;
  }
  mean /= static_cast<double>(samples_.size());
  for (const Sample& s : samples_) {
    if ((s.acceleration - mean).norm() > 2 * kAccelerationError_m_per_s2) return std::nullopt;
  }
  if (std::abs(mean.norm() - kGravity_m_per_s2) > kAccelerationError_m_per_s2) return std::nullopt;
  return mean.normalized();
}

}  // namespace mmradartwin
