#pragma once

#include <cstdint>
#include <vector>

#include "awr2243/awr2243_messages.h"
#include "mmradartwin_driver/check_result.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Self-test of the path from the chip's digital part to the samples. Signals that the chip generates (ramps on its
/// lanes, two synthetic targets) must arrive as requested. The bytes are judged as the card sent them.

/// Radar configuration of the self-test: one transmitter and one loop, so that the array consists of the receivers.
RadarConfig selfTestRadar(const RadarConfig& radar);

/// Endless ramps, each with its own start and step.
awr2243::TestPattern selfTestPattern();
/// Bytes of one packet of the pattern.
std::size_t selfTestPacketBytes();
/// Judges which lane carries which receiver, whether I and Q are where radar.yaml states, and whether the bytes of a
/// word are in order. bytes: whole packets from the first on.
CheckResult judgeTestPattern(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes);

/// Target of the test source, in radar_link.
struct SelfTestTarget {
  double range_m, azimuth_rad;
};
/// Two targets, at 0.3 and 0.6 of the radar's range, one on each side.
std::vector<SelfTestTarget> selfTestTargets(const RadarConfig& radar);
/// The targets for the chip, whose x is radar_link's y, with the receivers where radar.yaml has them. Throws InputError
/// where they are outside the range of the chip's fields.
awr2243::TestSource selfTestSource(const RadarConfig& radar);
/// Searches for both targets at their places, and at the places to which swapped I and Q or reversed lanes would move
/// them. bytes: whole frames of selfTestRadar(). Throws InputError where the receivers are no uniform line.
CheckResult judgeTestSource(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes);

}  // namespace mmradartwin
