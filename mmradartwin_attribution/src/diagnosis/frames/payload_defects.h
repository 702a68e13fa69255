#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin::diagnosis::frames {

/// Bytes of samples in a DCA1000 data packet.
constexpr int kPacketBytes = 1456;

/// Frames of one pose as the stream of int16 that the capture card sent, and which values are usable.
struct Payload {
  int frames = 0;
  std::size_t frame_values = 0;         ///< int16 values per frame in the capture's layout
  std::vector<std::int16_t> value;      ///< [frame][position]
  std::vector<std::uint8_t> use;        ///< [frame][position] 0 for an unusable value
  std::vector<std::uint32_t> sequence;  ///< [frame] number since arming, from which packets are counted
  std::size_t at(int frame, std::size_t position) const {
    return static_cast<std::size_t>(frame) * frame_values + position;
  }
};

/// Index in a cube ([chirp][sample][rx][I, Q]) of each int16 of a frame in the capture's layout; -1 for the zeros of
/// unused receivers.
std::vector<int> payloadOrder(const RadarConfig& radar);
/// Payload of frames. Values of chirps that are flagged as lost are unusable.
Payload toPayload(const std::vector<AdcCube>& cubes, const std::vector<int>& order);

/// Packets of a recording that were lost and filled with zeros.
struct ZeroedPackets {
  long long packets = 0;  ///< in the recording
  long long lost = 0;     ///< filled with zeros and not flagged
  double log_likelihood_gain = 0;
};
/// Finds packets of zeros only, where the same samples of other frames are not zero, and marks their values as
/// unusable.
ZeroedPackets markZeroedPackets(Payload& payload, const std::vector<int>& order);

/// Lost packets that were not filled: all later values are too early in the stream.
struct Slip {
  std::size_t position = 0;  ///< first value that is too early
  int packets = 0;           ///< missing there
  double log_likelihood_gain = 0;
};
/// Finds a slip: from one packet boundary on, frames equal those before it, shifted by whole packets.
std::optional<Slip> findSlip(const Payload& payload);
/// Inserts a gap of unusable values where packets are missing. Values beyond the last frame are dropped.
void closeSlip(const Slip& slip, Payload& payload);

}  // namespace mmradartwin::diagnosis::frames
