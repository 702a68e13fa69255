#pragma once

#include <cmath>

namespace mmradartwin {

constexpr double kPi = 3.14159265358979323846;
/// One degree in radians: `30 * kDegree` is an angle, `angle_rad / kDegree` its number of degrees.
constexpr double kDegree = kPi / 180.0;

/// One neper of power (a factor e of power) in dB: 10 / ln 10.
constexpr double kNeperOfPower_db = 4.3429448190325182765;
/// One neper of amplitude (a factor e of amplitude) in dB: 20 / ln 10.
constexpr double kNeperOfAmplitude_db = 8.6858896380650365530;

/// Level of a ratio of powers, dB.
inline double dbOfPower(double ratio) { return 10 * std::log10(ratio); }
/// Level of a ratio of amplitudes, dB.
inline double dbOfAmplitude(double ratio) { return 20 * std::log10(ratio); }
/// Ratio of powers of a level.
inline double powerOfDb(double level_db) { return std::pow(10.0, level_db / 10); }
/// Ratio of amplitudes of a level.
inline double amplitudeOfDb(double level_db) { return std::pow(10.0, level_db / 20); }

}  // namespace mmradartwin
