#pragma once

#include <cmath>
#include <complex>
#include <cstdint>

namespace mmradartwin {

// Random numbers by key: the same for a key whatever was drawn before and on whichever thread. SplitMix64's mixing
// (Steele, Lea, Flood 2014) turns any key into an unrelated number.

inline std::uint64_t mixBits(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

inline std::uint64_t drawKey(std::uint64_t key, std::uint64_t part) { return mixBits(mixBits(key) ^ part); }

/// [0, 1)
inline double drawUniform(std::uint64_t key) { return static_cast<double>(mixBits(key) >> 11) * 0x1.0p-53; }

/// Circular complex normal of E|w|^2 = 1 (Box and Muller).
inline std::complex<double> drawNormal(std::uint64_t key) {
  const double u = static_cast<double>((mixBits(key) >> 11) + 1) * 0x1.0p-53;
  return std::polar(std::sqrt(-std::log(u)), 2 * M_PI * drawUniform(key ^ 0xD1B54A32D192ED03ULL));
}

}  // namespace mmradartwin
