#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <memory>

#include "mechanisms/base/builtin.h"

namespace mmradartwin {

// Makers of the mechanisms of receiver, array and frames, each defined in the file that bears its name.
std::unique_ptr<Mechanism> makeIfLowpass();
std::unique_ptr<Mechanism> makeIqConjugation();
std::unique_ptr<Mechanism> makeChannelConjugation();
std::unique_ptr<Mechanism> makeChannelPermutation();
std::unique_ptr<Mechanism> makeMutualCoupling();
std::unique_ptr<Mechanism> makeTransmitterCoupling();
std::unique_ptr<Mechanism> makeIqImbalance();
std::unique_ptr<Mechanism> makeDcOffset();
std::unique_ptr<Mechanism> makeSecondHarmonic();
std::unique_ptr<Mechanism> makeChirpNonlinearity();
std::unique_ptr<Mechanism> makeGainDrift();
std::unique_ptr<Mechanism> makeMovingTarget();
std::unique_ptr<Mechanism> makePhaseNoise();
std::unique_ptr<Mechanism> makePhaseDrift();
std::unique_ptr<Mechanism> makeEmpiricalFrameGain();
std::unique_ptr<Mechanism> makeEmpiricalTone();
std::unique_ptr<Mechanism> makeInterference();
std::unique_ptr<Mechanism> makeNoiseFloor();
std::unique_ptr<Mechanism> makeAdcSaturation();
std::unique_ptr<Mechanism> makeQuantisation();
std::unique_ptr<Mechanism> makePacketLoss();
std::unique_ptr<Mechanism> makePacketMisalignment();

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

/// A list; an empty one stands for: not given.
inline ParameterSpec optionalListSpec(const char* name, const char* unit, double min, double max, const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, meaning);
  s.kind = ParameterKind::kNumbers;
  s.required = false;
  s.default_value = std::vector<double>();
  return s;
}

inline ParameterSpec integerSpec(const char* name, const char* unit, double min, double max, double default_value,
                                 const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, default_value, meaning);
  s.kind = ParameterKind::kInteger;
  return s;
}

}  // namespace mmradartwin
