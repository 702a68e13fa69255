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

/// The frames of one pose as the stream of int16 that the capture card sent, and which of its values can be used.
struct Payload {
  int frames = 0;
  std::size_t frame_values = 0;         ///< int16 values per frame in the capture's layout
  std::vector<std::int16_t> value;      ///< [frame][position]
  std::vector<std::uint8_t> use;        ///< the same shape
  std::vector<std::uint32_t> sequence;  ///< [frame] number since arming: packets count from there
  std::size_t at(int frame, std::size_t position) const {
    return static_cast<std::size_t>(frame) * frame_values + position;
  }
};

/// Where each int16 of a frame in the capture's layout belongs in a cube ([chirp][sample][rx][I, Q]); -1 for the zeros
/// of receivers that are not in use.
std::vector<int> payloadOrder(const RadarConfig& radar);
/// Values of chirps that are flagged as lost are not to be used.
Payload toPayload(const std::vector<AdcCube>& cubes, const std::vector<int>& order);

struct ZeroedPackets {
  long long packets = 0;  ///< in the recording
  long long lost = 0;     ///< of them filled with zeros, without being flagged
  double log_likelihood_gain = 0;
};
/// Finds packets that consist of nothing but zeros where the same samples of other frames do not, and marks their
/// values as not to be used.
ZeroedPackets markZeroedPackets(Payload& payload, const std::vector<int>& order);

struct Slip {
  std::size_t position = 0;  ///< first value of the stream that stands too early
  int packets = 0;           ///< that are missing there
  double log_likelihood_gain = 0;
};
/// Finds lost packets that were not filled: from one packet boundary on, the frames are those before it, shifted.
std::optional<Slip> findSlip(const Payload& payload);
/// Puts a gap of unusable values where the packets are missing; what then goes beyond the last frame is dropped.
void closeSlip(const Slip& slip, Payload& payload);

}  // namespace mmradartwin::diagnosis::frames
