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

/// What a radar's self-test needs of the rig.
struct SelfTestRig {
  /// Arms the card, lets the radar begin, and returns the recording's first `wanted` bytes, which are made within
  /// `expected_s`. Throws RigError where they do not come, or not whole.
  std::function<std::vector<std::uint8_t>(std::size_t wanted, double expected_s, const std::function<void()>& begin)>
      record;
  std::function<void(const CheckResult&)> tell;
};

/// A kind of radar that the driver can configure. The functions throw InputError for what the user must change.
struct RadarDevice {
  std::string name;   ///< radar.yaml's `device`
  std::string title;  ///< for people
  /// The configuration with the values that the device really uses. Errors name `file`, the key and its value.
  std::function<RadarConfig(const RadarConfig&, const std::string& file)> quantised;
  /// `firmware`: image for a radar whose flash is empty, or "". Nothing is sent before configure().
  std::function<std::unique_ptr<RadarControl>(const RadarConfig&, const std::string& firmware, RadarControl::EventSink)>
      control;
  /// Lets the radar make samples up and judges what arrives; empty where the device cannot.
  std::function<void(const RadarConfig&, const std::string& firmware, const SelfTestRig&)> self_test;
};

}  // namespace mmradartwin
