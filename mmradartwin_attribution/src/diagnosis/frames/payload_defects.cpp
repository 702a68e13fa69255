#include "diagnosis/frames/payload_defects.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr std::size_t kPacketValues = kPacketBytes / 2;

constexpr int kMostPackets = 4;  ///< packets lost in a row of a slip that is searched for

struct ZeroRun {
  std::size_t begin, end;
};

/// Runs of zeros that are at least as long as a packet. At the end of the recording, whose last packet is short, a
/// sixteenth of one is enough. Unusable values and missing frames end a run.
std::vector<ZeroRun> zeroRuns(const Payload& payload, const std::vector<int>& order) {
  std::vector<ZeroRun> runs;
  std::size_t begin = 0;
  bool inside = false;
  const auto finish = [&](std::size_t end) {
    if (inside && end - begin >= (end == payload.value.size() ? kPacketValues / 16 : kPacketValues))
      runs.push_back({begin, end});
    inside = false;
  };
  for (int f = 0; f < payload.frames; ++f) {
    if (f > 0 &&
        payload.sequence[static_cast<std::size_t>(f)] != payload.sequence[static_cast<std::size_t>(f - 1)] + 1) {
      finish(payload.at(f, 0));
    }
    for (std::size_t i = 0; i < payload.frame_values; ++i) {
      const std::size_t place = payload.at(f, i);
      if (payload.use[place] && (payload.value[place] == 0 || order[i] < 0)) {
        if (!inside) begin = place;
        inside = true;
      } else {
        finish(place);
      }
    }
  }
  finish(payload.value.size());
  return runs;
}

/// Position of a value within its packet; packets are counted from arming.
std::size_t packetPhase(const Payload& p, std::size_t place) {
  const std::size_t frame = place / p.frame_values;
  return (p.sequence[frame] % kPacketValues * (p.frame_values % kPacketValues) + place % p.frame_values) %
         kPacketValues;
}

/// First position from `begin` on where a packet of the given phase starts.
std::size_t firstPacket(const Payload& p, std::size_t begin, std::size_t phase) {
  return begin + (phase + kPacketValues - packetPhase(p, begin)) % kPacketValues;
}

/// Squared changes of frames relative to the previous frame.
struct FrameChanges {
  std::vector<double> square;  ///< [frame], 0 for the first one
  double power = 0;            ///< of a frame, mean over all but the first
};

FrameChanges changesOfFrames(const Payload& payload) {
  FrameChanges changes;
  changes.square.assign(static_cast<std::size_t>(payload.frames), 0);
  for (int f = 1; f < payload.frames; ++f) {
    double sum = 0;
    for (std::size_t i = 0; i < payload.frame_values; ++i) {
      const std::size_t now = payload.at(f, i), before = payload.at(f - 1, i);
      if (!payload.use[now] || !payload.use[before]) continue;
      const double d = static_cast<double>(payload.value[now]) - payload.value[before];
      sum += d * d;
      changes.power += static_cast<double>(payload.value[now]) * payload.value[now];
    }
    changes.square[static_cast<std::size_t>(f)] = sum;
  }
  changes.power /= payload.frames - 1;
  return changes;
}

/// Numbers of the frames that differ from the previous one by far more than frames usually do. least: smallest change
/// that a slip causes. Empty where frames always change as much.
std::vector<int> jumpingFrames(const FrameChanges& changes, double least) {
  const int frames = static_cast<int>(changes.square.size());
  std::vector<double> sorted(changes.square.begin() + 1, changes.square.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  // A tone that turns from frame to frame changes all frames, and some shift of samples explains any of these changes.
  if (frames > 3 && usual > least) return {};
  std::vector<int> jumps;
  for (int f = 1; f < frames; ++f) {
    const double change = changes.square[static_cast<std::size_t>(f)];
    if (change > least && (frames == 2 || change > bounds::kLeastSlipOverUsual * usual)) jumps.push_back(f);
  }
  return jumps;
}

/// Mean of the frames of one interval, and the variance of a value about it.
struct FrameTemplate {
  std::vector<double> mean;  ///< [position]
  double variance = 0;
};

/// Template from the longest sequence of frames without a jump; empty where a position has no usable value in it.
std::optional<FrameTemplate> longestStretch(const Payload& payload, std::vector<int> jumps) {
  int first = 0, last = 0;
  jumps.push_back(payload.frames);
  for (std::size_t i = 0, begin = 0; i < jumps.size(); begin = static_cast<std::size_t>(jumps[i++])) {
    if (jumps[i] - static_cast<int>(begin) > last - first) {
      first = static_cast<int>(begin);
      last = jumps[i];
    }
  }
  std::vector<double> sum(payload.frame_values, 0), weight(payload.frame_values, 0);
  double squares = 0;
  for (int f = first; f < last; ++f) {
    for (std::size_t i = 0; i < payload.frame_values; ++i) {
      const std::size_t place = payload.at(f, i);
      if (!payload.use[place]) continue;
      const double v = payload.value[place];
      sum[i] += v;
      squares += v * v;
      ++weight[i];
    }
  }
  double residual = squares, freedom = 0;
  for (std::size_t i = 0; i < payload.frame_values; ++i) {
    if (weight[i] == 0) return std::nullopt;
    residual -= sum[i] * sum[i] / weight[i];
    freedom += weight[i] - 1;
    sum[i] /= weight[i];
  }
  return FrameTemplate{std::move(sum), std::max(freedom > 0 ? residual / freedom : 0.0, kRoundingVariance)};
}

/// Blocks of the stream between packet boundaries, and the misfit of each to a template.
class PacketBlocks {
 public:
  explicit PacketBlocks(const Payload& p)
      : payload_(p),
        origin_(firstPacket(p, 0, 0)),
        count_((p.value.size() - origin_ + kPacketValues - 1) / kPacketValues + 1) {}
  std::size_t count() const { return count_; }
  /// First value of a block, counted from 1.
  std::size_t position(std::size_t block) const { return origin_ + (block - 1) * kPacketValues; }
  /// Squared misfit to a template shifted `packets` later, summed over all blocks before each: [count + 1].
  std::vector<double> misfit(const FrameTemplate& frame, long packets) const {
    std::vector<double> sum(count_ + 1, 0);
    const long values = static_cast<long>(payload_.frame_values);
    const auto turn =
        static_cast<std::size_t>(((packets * static_cast<long>(kPacketValues)) % values + values) % values);
    for (std::size_t i = 0; i < payload_.value.size(); ++i) {
      if (!payload_.use[i]) continue;
      const double d = payload_.value[i] - frame.mean[(i + turn) % payload_.frame_values];
      sum[blockOf(i) + 1] += d * d;
    }
    std::partial_sum(sum.begin(), sum.end(), sum.begin());
    return sum;
  }
  /// Number of usable values in all blocks before each: [count + 1].
  std::vector<double> used() const {
    std::vector<double> sum(count_ + 1, 0);
    for (std::size_t i = 0; i < payload_.value.size(); ++i) {
      if (payload_.use[i]) ++sum[blockOf(i) + 1];
    }
    std::partial_sum(sum.begin(), sum.end(), sum.begin());
    return sum;
  }

 private:
  std::size_t blockOf(std::size_t i) const { return i < origin_ ? 0 : (i - origin_) / kPacketValues + 1; }

  const Payload& payload_;
  std::size_t origin_;  ///< first packet boundary in the stream
  std::size_t count_;
};

}  // namespace

std::vector<int> payloadOrder(const RadarConfig& radar) {
  // Pairs of real samples stand where I and Q of the complex ones do that they are read as.
  RadarConfig complex = radar;
  complex.real_samples = false;
  const std::size_t cube =
      static_cast<std::size_t>(radar.chirps_per_frame()) * radar.samples_per_chirp * radar.receivers() * 2;
  // The encoder maps the index of every value, seven bits at a time, with one bit that marks it as a value.
  std::vector<int> order(radar.bytes_per_frame() / 2, 0);
  std::vector<std::int16_t> digits(cube);
  for (int shift = 0; shift < 28; shift += 7) {
    for (std::size_t i = 0; i < cube; ++i) digits[i] = static_cast<std::int16_t>(128 + ((i >> shift) & 127));
    const std::vector<std::uint8_t> bytes = encodeFrame(complex, digits);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const int digit = bytes[2 * i] + 256 * bytes[2 * i + 1];
      order[i] = digit & 128 ? order[i] + ((digit & 127) << shift) : -1;
    }
  }
  return order;
}

Payload toPayload(const std::vector<AdcCube>& cubes, const std::vector<int>& order) {
  Payload payload;
  payload.frames = static_cast<int>(cubes.size());
  payload.frame_values = order.size();
  payload.value.resize(cubes.size() * order.size());
  payload.use.assign(payload.value.size(), 1);
  for (int f = 0; f < payload.frames; ++f) {
    const AdcCube& cube = cubes[static_cast<std::size_t>(f)];
    payload.sequence.push_back(cube.sequence);
    const std::size_t per_chirp = cube.data.size() / static_cast<std::size_t>(cube.chirps);
    const bool whole = std::all_of(cube.chirp_valid.begin(), cube.chirp_valid.end(), [](auto v) { return v != 0; });
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i] < 0) continue;
      const auto from = static_cast<std::size_t>(order[i]);
      payload.value[payload.at(f, i)] = cube.data[from];
      if (!whole && !cube.chirp_valid[from / per_chirp]) payload.use[payload.at(f, i)] = 0;
    }
  }
  return payload;
}

ZeroedPackets markZeroedPackets(Payload& payload, const std::vector<int>& order) {
  ZeroedPackets found;
  found.packets = static_cast<long long>((payload.value.size() + kPacketValues - 1) / kPacketValues);
  const std::vector<ZeroRun> runs = zeroRuns(payload, order);
  if (runs.empty()) return found;

  // Share of zeros outside these runs, at each position of a frame and overall.
  std::vector<std::uint8_t> in_run(payload.value.size(), 0);
  for (const ZeroRun& r : runs) std::fill(&in_run[r.begin], &in_run[0] + r.end, std::uint8_t{1});
  std::vector<int> zeros(payload.frame_values, 0), counted(payload.frame_values, 0);
  for (int f = 0; f < payload.frames; ++f) {
    for (std::size_t i = 0; i < payload.frame_values; ++i) {
      const std::size_t at = payload.at(f, i);
      if (in_run[at] || !payload.use[at] || order[i] < 0) continue;
      ++counted[i];
      zeros[i] += payload.value[at] == 0;
    }
  }
  const double all = std::accumulate(counted.begin(), counted.end(), 0.0);
  if (all == 0) return found;  // nothing but zeros: no packet is worse than the others
  const double share = std::max(std::accumulate(zeros.begin(), zeros.end(), 0.0) / all, 1.0 / 65536);

  std::vector<ZeroRun> lost;
  std::vector<double> gains;
  for (const ZeroRun& r : runs) {
    double gain = 0;
    for (std::size_t at = r.begin; at < r.end; ++at) {
      const std::size_t i = at % payload.frame_values;
      if (order[i] >= 0) gain -= std::log((zeros[i] + share) / (counted[i] + 1.0));
    }
    if (gain <= bounds::kLeastNatsOfZeroedPacket) continue;
    lost.push_back(r);
    gains.push_back(gain);
  }
  // Packets are counted from arming. A bag may have begun later: the runs themselves then show where packets start.
  const auto packetsAt = [&](std::size_t phase) {
    long long packets = 0;
    for (const ZeroRun& r : lost) {
      const std::size_t first = firstPacket(payload, r.begin, phase);
      if (first + kPacketValues <= r.end) packets += static_cast<long long>((r.end - first) / kPacketValues);
    }
    return packets;
  };
  std::size_t phase = 0;
  long long best = packetsAt(0), possible = 0;
  for (const ZeroRun& r : lost) possible += static_cast<long long>((r.end - r.begin) / kPacketValues);
  for (std::size_t candidate = 1; best < possible && candidate < kPacketValues; ++candidate) {
    const long long packets = packetsAt(candidate);
    if (packets > best) {
      best = packets;
      phase = candidate;
    }
  }
  for (std::size_t i = 0; i < lost.size(); ++i) {
    const std::size_t first = firstPacket(payload, lost[i].begin, phase);
    if (first + (lost[i].end == payload.value.size() ? 1 : kPacketValues) > lost[i].end) continue;
    const std::size_t whole = (lost[i].end - first) / kPacketValues;
    const std::size_t rest = lost[i].end == payload.value.size() ? lost[i].end - first - whole * kPacketValues : 0;
    std::fill(&payload.use[first], &payload.use[0] + first + whole * kPacketValues + rest, std::uint8_t{0});
    found.lost += static_cast<long long>(whole) + (rest > 0 ? 1 : 0);
    found.log_likelihood_gain += gains[i];
  }
  return found;
}

std::optional<Slip> findSlip(const Payload& payload) {
  if (payload.frames < 2) return std::nullopt;
  const FrameChanges changes = changesOfFrames(payload);
  const double least = bounds::kLeastSlipShare * changes.power;
  const std::vector<int> jumps = jumpingFrames(changes, least);
  if (jumps.empty()) return std::nullopt;
  const std::optional<FrameTemplate> frame = longestStretch(payload, jumps);
  if (!frame) return std::nullopt;

  const PacketBlocks blocks(payload);
  const std::vector<double> still = blocks.misfit(*frame, 0), used = blocks.used();
  const std::size_t end = blocks.count();
  std::optional<Slip> best;
  for (int packets = 1; packets <= kMostPackets; ++packets) {
    for (const bool template_after : {false, true}) {
      const std::vector<double> shifted = blocks.misfit(*frame, template_after ? -packets : packets);
      for (std::size_t b = 1; b < end; ++b) {
        // Blocks before b are in place, those from b on are shifted.
        const double fit = template_after ? shifted[b] : shifted[end] - shifted[b];
        const double was = template_after ? still[b] : still[end] - still[b];
        const double noise = frame->variance * (template_after ? used[b] : used[end] - used[b]);
        if (was - noise < least || fit - noise > bounds::kMostLeftOfSlip * (was - noise)) continue;
        const double gain = (was - fit) / (2 * frame->variance);
        if (!best || gain > best->log_likelihood_gain) best = Slip{blocks.position(b), packets, gain};
      }
    }
  }
  // Every boundary and number of packets was tried, with either sign.
  const double tries =
      std::log(2.0 * kMostPackets * static_cast<double>(end)) + std::log(1 / bounds::kFramesFalseAlarmRate);
  if (!best || best->log_likelihood_gain <= tries) return std::nullopt;
  return best;
}

void closeSlip(const Slip& slip, Payload& payload) {
  const std::size_t gap =
      std::min(static_cast<std::size_t>(slip.packets) * kPacketValues, payload.value.size() - slip.position);
  const auto open = [&](auto& list) {
    std::copy_backward(list.begin() + static_cast<long>(slip.position), list.end() - static_cast<long>(gap),
                       list.end());
    std::fill_n(list.begin() + static_cast<long>(slip.position), gap, 0);
  };
  open(payload.value);
  open(payload.use);
}

}  // namespace mmradartwin::diagnosis::frames
