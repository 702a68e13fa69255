#include "capture_check/silent_receivers.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace mmradartwin {
namespace {

/// The only value of a receiver's I or Q, if it has only one.
std::optional<std::int16_t> constantValue(const ByteReading& reading, const std::vector<std::int16_t>& words,
                                          std::size_t rx, std::size_t behind) {
  const std::size_t chirps = words.size() / reading.words();
  if (chirps == 0) return std::nullopt;
  const std::int16_t first = words[reading.wordOf(rx, 0) + behind];
  for (std::size_t chirp = 0; chirp < chirps; ++chirp) {
    for (std::size_t n = 0; n < reading.samples; ++n) {
      if (words[chirp * reading.words() + reading.wordOf(rx, n) + behind] != first) return std::nullopt;
    }
  }
  return first;
}

std::string constantInWords(std::int16_t value) {
  return value == 0 ? "only zeros" : "only a constant " + std::to_string(value);
}

/// Keeps the elements whose receivers are kept, of a list by receiver or by virtual channel.
template <typename Value>
void keep(const std::vector<int>& kept, std::size_t receivers, std::vector<Value>& list) {
  std::vector<Value> result;
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (std::find(kept.begin(), kept.end(), static_cast<int>(i % receivers)) != kept.end()) result.push_back(list[i]);
  }
  list = std::move(result);
}

AdcCube reduced(const AdcCube& cube, const std::vector<int>& kept) {
  AdcCube result;
  result.stamp_ns = cube.stamp_ns;
  result.sequence = cube.sequence;
  result.chirps = cube.chirps;
  result.samples = cube.samples;
  result.receivers = static_cast<int>(kept.size());
  result.chirp_valid = cube.chirp_valid;
  result.lost_bytes = cube.lost_bytes;
  const auto receivers = static_cast<std::size_t>(cube.receivers);
  result.data.reserve(cube.data.size() / receivers * kept.size());
  for (std::size_t at = 0; at + 2 * receivers <= cube.data.size(); at += 2 * receivers) {
    for (const int rx : kept) {
      const std::size_t from = at + 2 * static_cast<std::size_t>(rx);
      result.data.push_back(cube.data[from]);
      result.data.push_back(cube.data[from + 1]);
    }
  }
  return result;
}

void leaveOutOfFrames(const std::vector<int>& kept, Recording& recording) {
  recording.forEachFrame = [whole = recording.forEachFrame, kept](const Pose& pose,
                                                                  const std::function<void(const AdcCube&)>& visit) {
    whole(pose, [&](const AdcCube& cube) { visit(reduced(cube, kept)); });
  };
  if (recording.forEachFrameBetween) {
    recording.forEachFrameBetween = [whole = recording.forEachFrameBetween, kept](
                                        std::int64_t first_ns, std::int64_t last_ns,
                                        const std::function<void(const AdcCube&)>& visit) {
      whole(first_ns, last_ns, [&](const AdcCube& cube) { visit(reduced(cube, kept)); });
    };
  }
}

}  // namespace

SilentReceivers silentReceivers(const ByteReading& reading, const std::vector<std::int16_t>& words) {
  SilentReceivers silent;
  for (std::size_t rx = 0; rx < reading.receivers; ++rx) {
    const auto i = constantValue(reading, words, rx, 0);
    const auto q = reading.real ? i : constantValue(reading, words, rx, reading.qBehind());
    if (!i && !q) continue;
    std::string& what = silent[static_cast<int>(rx)];
    if (i && q) {
      what = *i == *q ? constantInWords(*i) : "only constants " + std::to_string(*i) + ", " + std::to_string(*q);
    } else {
      what = i ? constantInWords(*i) + " in I" : constantInWords(*q) + " in Q";
    }
  }
  return silent;
}

SilentReceivers commonTo(const SilentReceivers& a, const SilentReceivers& b) {
  SilentReceivers common;
  for (const auto& [receiver, what] : a) {
    const auto found = b.find(receiver);
    if (found != b.end()) common[receiver] = found->second == what ? what : "only constants";
  }
  return common;
}

void leaveOut(const SilentReceivers& silent, Recording& recording) {
  const std::vector<Eigen::Vector3d> whole = recording.radar.rx_position_m;
  std::vector<int> kept;
  for (int rx = 0; rx < recording.radar.receivers(); ++rx) {
    if (!silent.count(rx)) kept.push_back(rx);
  }
  RadarConfig& radar = recording.radar;
  radar.whole_line_rx_m = whole;
  keep(kept, whole.size(), radar.rx_position_m);
  if (!radar.rx_enable.empty()) keep(kept, whole.size(), radar.rx_enable);
  if (recording.channels) {
    keep(kept, whole.size(), recording.channels->phase_deg);
    keep(kept, whole.size(), recording.channels->gain_db);
  }
  leaveOutOfFrames(kept, recording);
  if (recording.withPoseLag) {
    recording.withPoseLag = [open = recording.withPoseLag, silent, channels = recording.channels](double lag_s) {
      Recording later = open(lag_s);
      later.channels.reset();
      leaveOut(silent, later);
      later.channels = channels;
      return later;
    };
  }
}

}  // namespace mmradartwin
