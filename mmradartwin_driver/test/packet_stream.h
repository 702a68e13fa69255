#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// A packet as it arrives: owned, impaired.
struct ArrivingPacket {
  std::uint32_t sequence;
  std::uint64_t offset;  ///< absolute, beyond 48 bits
  std::vector<std::uint8_t> payload;
  std::int64_t stamp_ns;

  DataPacket view() const {
    return {sequence, offset % (std::uint64_t{1} << 48), payload.data(), payload.size(), stamp_ns};
  }
};

/// Byte `offset` of recording `epoch`: anything that differs from place to place and from recording to recording.
inline std::uint8_t streamByte(std::uint64_t epoch, std::uint64_t offset) {
  std::uint64_t x = offset + epoch * 0x9e3779b97f4a7c15u;
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return static_cast<std::uint8_t>(x >> 56);
}

/// Four lanes and four receivers, of random size: 16 bytes per sample.
inline RadarConfig randomRadar(std::mt19937_64& random) {
  const auto between = [&](int a, int b) { return std::uniform_int_distribution<int>(a, b)(random); };
  RadarConfig radar = paperRadar();
  radar.samples_per_chirp = between(0, 2) ? between(1, 12) : between(32, 128);
  radar.loops_per_frame = between(1, 6);
  radar.tx_position_m.assign(between(1, 2), Eigen::Vector3d::Zero());
  radar.rx_position_m.assign(4, Eigen::Vector3d::Zero());
  return radar;
}

/// Byte of the frame that sample word [chirp][n][rx][I,Q] begins at (SWRA581B, four lanes interleaved).
inline std::size_t byteOfWord(const RadarConfig& radar, std::size_t word) {
  const std::size_t iq = word % 2, rx = word / 2 % 4, sample = word / 8;
  (void)radar;
  return sample * 16 + iq * 8 + rx * 2;
}

/// Cuts a recording into packets, from `begin` on; at most 240, fewer than an assembler remembers. Where they are not
/// `equal`, the first two differ in length.
inline std::vector<ArrivingPacket> cutIntoPackets(std::mt19937_64& random, std::uint64_t epoch, std::uint64_t begin,
                                                  std::size_t bytes, bool equal) {
  std::vector<ArrivingPacket> packets;
  const std::size_t longest = std::uniform_int_distribution<std::size_t>(1, 3)(random) == 1
                                  ? 1456
                                  : std::uniform_int_distribution<std::size_t>(8, 1462)(random);
  std::uint32_t sequence = begin == 0 ? 1 : static_cast<std::uint32_t>(random());
  for (std::size_t at = 0; at < bytes && packets.size() < 240;) {
    std::size_t size = equal ? longest : std::uniform_int_distribution<std::size_t>(1, longest)(random);
    if (!equal && packets.size() == 1 && size == packets.front().payload.size()) size = size % longest + 1;
    size = std::min(size, bytes - at);
    ArrivingPacket packet{sequence++, begin + at, std::vector<std::uint8_t>(size), 0};
    for (std::size_t i = 0; i < size; ++i) packet.payload[i] = streamByte(epoch, begin + at + i);
    packets.push_back(std::move(packet));
    at += size;
  }
  return packets;
}

struct Impairment {
  double loss = 0, duplicate = 0, reorder = 0, truncate = 0;
  int depth = 1;           ///< places a packet may fall behind
  std::size_t spared = 0;  ///< so many packets at the head stay as they are
};

inline std::vector<ArrivingPacket> impair(std::mt19937_64& random, const std::vector<ArrivingPacket>& sent,
                                          const Impairment& how) {
  const auto chance = [&](double p) { return std::uniform_real_distribution<double>()(random) < p; };
  std::vector<std::pair<double, ArrivingPacket>> keyed;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const auto deliver = [&] {
      ArrivingPacket packet = sent[i];
      double key = static_cast<double>(i);
      if (i >= how.spared) {
        if (chance(how.truncate)) {
          packet.payload.resize(std::uniform_int_distribution<std::size_t>(1, packet.payload.size())(random));
        }
        if (chance(how.reorder)) key += std::uniform_real_distribution<double>(0, how.depth)(random) + 0.5;
      }
      keyed.emplace_back(key, std::move(packet));
    };
    if (i >= how.spared && chance(how.loss)) continue;
    deliver();
    while (i >= how.spared && chance(how.duplicate)) deliver();
  }
  std::stable_sort(keyed.begin(), keyed.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ArrivingPacket> arriving;
  for (auto& [key, packet] : keyed) arriving.push_back(std::move(packet));
  return arriving;
}

/// What an assembler must have of one recording, byte by byte, told from the arrivals by the rule alone: a byte of
/// frame f counts if, by the time it is placed, no byte beyond the end of f + window has come.
class ArrivalOracle {
 public:
  ArrivalOracle(std::uint64_t frame_bytes, std::uint64_t window_bytes) : frame_(frame_bytes), window_(window_bytes) {}

  void arrive(std::uint64_t offset, std::size_t size) {
    for (std::uint64_t byte = offset; byte < offset + size; ++byte) {
      // All of a frame's part of a packet is taken at once: its end decides.
      const std::uint64_t part_end = std::min(offset + size, (byte / frame_ + 1) * frame_);
      newest_ = std::max(newest_, part_end);
      if (newest_ > window_) closed_ = std::max(closed_, (newest_ - window_) / frame_);
      if (byte / frame_ < closed_) continue;
      auto& frame = frames_[byte / frame_];
      frame.resize(frame_);
      frame[byte % frame_] = true;
    }
  }
  void flush() { closed_ = std::max(closed_, (newest_ + frame_ - 1) / frame_); }

  const std::map<std::uint64_t, std::vector<bool>>& frames() const { return frames_; }

 private:
  std::uint64_t frame_, window_, newest_ = 0, closed_ = 0;
  std::map<std::uint64_t, std::vector<bool>> frames_;
};

}  // namespace mmradartwin
