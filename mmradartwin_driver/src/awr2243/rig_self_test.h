#pragma once

#include <cstdint>
#include <vector>

#include "awr2243/awr2243_messages.h"
#include "mmradartwin_driver/check_result.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// A self-test of the way from the chip's digital part to the samples: what the chip makes up itself (ramps on its
/// lanes, two synthetic targets) must come out as it was asked for. What is judged are bytes as the card sent them.

/// A radar as the self-test runs it: one transmitter, one loop, so that its receivers alone are the array.
RadarConfig selfTestRadar(const RadarConfig& radar);

/// Ramps without end, each with a start and a step of its own.
awr2243::TestPattern selfTestPattern();
/// Bytes of one packet of the pattern.
std::size_t selfTestPacketBytes();
/// `bytes`: whole packets from the first on. Says which lane carries which receiver, whether I and Q stand where
/// radar.yaml says, whether the bytes of a word are in order.
CheckResult judgeTestPattern(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes);

/// A target of the test source in radar_link.
struct SelfTestTarget {
  double range_m, azimuth_rad;
};
/// Two targets, at 0.3 and 0.6 of the radar's range, one on each side.
std::vector<SelfTestTarget> selfTestTargets(const RadarConfig& radar);
/// The same for the chip, whose x is radar_link's y, with the receivers where radar.yaml has them. Throws InputError
/// where they are further out than the chip can be told.
awr2243::TestSource selfTestSource(const RadarConfig& radar);
/// `bytes`: whole frames of selfTestRadar(). Looks for both targets where they were put, and at the places where
/// swapped I and Q or reversed lanes would put them. Throws InputError where the receivers are no uniform line.
CheckResult judgeTestSource(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes);

}  // namespace mmradartwin
