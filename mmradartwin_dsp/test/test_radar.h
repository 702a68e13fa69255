#pragma once

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cmath>
#include <complex>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

/// The paper's radar, as docs/reference/contracts.md section 5 writes it.
inline const char* paperRadarYaml() {
  return "device: awr2243\n"
         "carrier_hz: 77.0e+9\n"
         "slope_hz_per_s: 75.0e+12\n"
         "samples_per_chirp: 64\n"
         "sample_rate_hz: 5.0e+6\n"
         "adc_start_s: 6.0e-6\n"
         "loops_per_frame: 1\n"
         "frame_period_s: 0.05\n"
         "tx_position_m: [[0, 0, 0], [0, 0.0077867, 0]]\n"
         "rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]\n";
}

inline RadarConfig paperRadar() { return parseRadarConfig(paperRadarYaml(), "radar.yaml"); }

/// A point target at range and azimuth (z = 0): exact delay per element, from the signal model of
/// docs/reference/contracts.md section 3.
inline ComplexGrid pointTarget(const RadarConfig& radar, double range_m, double azimuth_rad, double amplitude) {
  const Eigen::Vector3d target(range_m * std::cos(azimuth_rad), range_m * std::sin(azimuth_rad), 0);
  ComplexGrid x(radar.channels(), radar.samples_per_chirp);
  for (int k = 0; k < radar.channels(); ++k) {
    const Eigen::Vector3d& tx = radar.tx_position_m[static_cast<std::size_t>(k / radar.receivers())];
    const Eigen::Vector3d& rx = radar.rx_position_m[static_cast<std::size_t>(k % radar.receivers())];
    const double tau = ((target - tx).norm() + (target - rx).norm()) / kSpeedOfLight_m_per_s;
    for (int n = 0; n < radar.samples_per_chirp; ++n) {
      const double t = radar.adc_start_s + n / radar.sample_rate_hz;
      const double cycles =
          radar.carrier_hz * tau + radar.slope_hz_per_s * tau * t - 0.5 * radar.slope_hz_per_s * tau * tau;
      x(k, n) = amplitude * std::polar(1.0, 2 * M_PI * std::fmod(cycles, 1.0));
    }
  }
  return x;
}

/// Real recordings; empty where they are not on this machine.
inline std::filesystem::path dataFolder() {
  if (const char* folder = std::getenv("MMRADARTWIN_DATA")) return folder;
  return std::filesystem::weakly_canonical(std::filesystem::path(MMRADARTWIN_DSP_SOURCE) / ".." / ".." / "shared" /
                                           "data");
}

#define SKIP_WITHOUT(file)                                                                               \
  if (!std::filesystem::exists(file)) {                                                                  \
    GTEST_SKIP() << file << " is not here; set MMRADARTWIN_DATA to the folder with the real recordings"; \
  }

/// Message of the InputError that `action` throws, "" where it throws none.
template <typename Action>
std::string inputError(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

inline bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// One line that holds all parts.
template <typename... Parts>
::testing::AssertionResult saysInOneLine(const std::string& message, const Parts&... parts) {
  if (message.empty()) return ::testing::AssertionFailure() << "no InputError";
  if (contains(message, "\n")) return ::testing::AssertionFailure() << "several lines: " << message;
  for (const std::string& part : {std::string(parts)...}) {
    if (!contains(message, part)) return ::testing::AssertionFailure() << "'" << part << "' is not in: " << message;
  }
  return ::testing::AssertionSuccess();
}

/// A folder of its own for each test, removed afterwards.
class TestFolder {
 public:
  TestFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_test_XXXXXX").string();
    path = ::mkdtemp(pattern.data());
  }
  ~TestFolder() { std::filesystem::remove_all(path); }
  std::string operator/(const std::string& name) const { return (path / name).string(); }
  std::filesystem::path path;
};

}  // namespace mmradartwin
