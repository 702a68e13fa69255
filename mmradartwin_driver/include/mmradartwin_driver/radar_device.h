#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_driver/check_result.h"
#include "mmradartwin_driver/radar_control.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Functions of the rig that a radar's self-test needs.
struct SelfTestRig {
  /// Arms the card, calls `begin` to start the radar, and returns the recording's first `wanted` bytes, expected within
  /// `expected_s`. Throws RigError where they do not arrive completely.
  std::function<std::vector<std::uint8_t>(std::size_t wanted, double expected_s, const std::function<void()>& begin)>
      record;
  std::function<void(const CheckResult&)> tell;
};

/// Kind of radar that the driver can configure. The functions throw InputError for what the user must change.
struct RadarDevice {
  std::string name;   ///< radar.yaml's `device`
  std::string title;  ///< for people
  /// The configuration with the values that the device really uses. Errors name `file`, the key and its value.
  std::function<RadarConfig(const RadarConfig&, const std::string& file)> quantised;
  /// Control of the radar; nothing is sent before configure(). firmware: image for a radar whose flash is empty, or "".
  std::function<std::unique_ptr<RadarControl>(const RadarConfig&, const std::string& firmware, RadarControl::EventSink)>
      control;
  /// Makes the radar generate samples and judges those that arrive; empty where the device cannot.
  std::function<void(const RadarConfig&, const std::string& firmware, const SelfTestRig&)> self_test;
};

}  // namespace mmradartwin
