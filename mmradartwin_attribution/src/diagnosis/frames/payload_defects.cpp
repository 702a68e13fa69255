#include "diagnosis/frames/payload_defects.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mmradartwin_dsp/capture.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr std::size_t kPacketValues = kPacketBytes / 2;

// A run of zeros is a lost packet where chance makes one run in 1e6 sessions of 1e6 packets.
const double kPacketEvidence = std::log(1e6) + std::log(1e6);
// Lost packets in a row that a slip is searched for.
constexpr int kMostPackets = 4;

struct Run {
  std::size_t begin, end;
};

/// Runs of zeros of a packet's length or more; at the end of the recording, whose last packet is short, of a sixteenth
/// of one. Values not to be used and missing frames end a run.
std::vector<Run> zeroRuns(const Payload& p, const std::vector<int>& order) {
  std::vector<Run> runs;
  std::size_t begin = 0;
  bool inside = false;
  const auto finish = [&](std::size_t end) {
    if (inside && end - begin >= (end == p.value.size() ? kPacketValues / 16 : kPacketValues))
      runs.push_back({begin, end});
    inside = false;
  };
  for (int f = 0; f < p.frames; ++f) {
    if (f > 0 && p.sequence[static_cast<std::size_t>(f)] != p.sequence[static_cast<std::size_t>(f - 1)] + 1) {
      finish(p.at(f, 0));
    }
    for (std::size_t i = 0; i < p.frame_values; ++i) {
      const std::size_t at = p.at(f, i);
      if (p.use[at] && (p.value[at] == 0 || order[i] < 0)) {
        if (!inside) begin = at;
        inside = true;
      } else {
        finish(at);
      }
    }
  }
  finish(p.value.size());
  return runs;
}

/// Position in the recording, modulo a packet.
std::size_t packetPhase(const Payload& p, std::size_t at) {
  const std::size_t frame = at / p.frame_values;
  return (p.sequence[frame] % kPacketValues * (p.frame_values % kPacketValues) + at % p.frame_values) % kPacketValues;
}

/// First position from `begin` on where a packet of the given phase starts.
std::size_t firstPacket(const Payload& p, std::size_t begin, std::size_t phase) {
  return begin + (phase + kPacketValues - packetPhase(p, begin)) % kPacketValues;
}

}  // namespace

std::vector<int> payloadOrder(const RadarConfig& radar) {
  const std::size_t cube =
      static_cast<std::size_t>(radar.chirps_per_frame()) * radar.samples_per_chirp * radar.receivers() * 2;
  // Sends every place's number through the encoder, seven bits at a time, with a bit that tells it from filling.
  std::vector<int> order(radar.bytes_per_frame() / 2, 0);
  std::vector<std::int16_t> digits(cube);
  for (int shift = 0; shift < 28; shift += 7) {
    for (std::size_t i = 0; i < cube; ++i) digits[i] = static_cast<std::int16_t>(128 + ((i >> shift) & 127));
    const std::vector<std::uint8_t> bytes = encodeFrame(radar, digits);
    for (std::size_t i = 0; i < order.size(); ++i) {
      const int digit = bytes[2 * i] + 256 * bytes[2 * i + 1];
      order[i] = digit & 128 ? order[i] + ((digit & 127) << shift) : -1;
    }
  }
  return order;
}

Payload toPayload(const std::vector<AdcCube>& cubes, const std::vector<int>& order) {
  Payload p;
  p.frames = static_cast<int>(cubes.size());
  p.frame_values = order.size();
  p.value.resize(cubes.size() * order.size());
  p.use.assign(p.value.size(), 1);
  for (int f = 0; f < p.frames; ++f) {
    const AdcCube& cube = cubes[static_cast<std::size_t>(f)];
    p.sequence.push_back(cube.sequence);
    const std::size_t per_chirp = cube.data.size() / static_cast<std::size_t>(cube.chirps);
    const bool whole = std::all_of(cube.chirp_valid.begin(), cube.chirp_valid.end(), [](auto v) { return v != 0; });
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i] < 0) continue;
      const auto from = static_cast<std::size_t>(order[i]);
      p.value[p.at(f, i)] = cube.data[from];
      if (!whole && !cube.chirp_valid[from / per_chirp]) p.use[p.at(f, i)] = 0;
    }
  }
  return p;
}

ZeroedPackets markZeroedPackets(Payload& p, const std::vector<int>& order) {
  ZeroedPackets found;
  found.packets = static_cast<long long>((p.value.size() + kPacketValues - 1) / kPacketValues);
  const std::vector<Run> runs = zeroRuns(p, order);
  if (runs.empty()) return found;

  // How often each place of a frame is zero outside of these runs, and any place.
  std::vector<std::uint8_t> in_run(p.value.size(), 0);
  for (const Run& r : runs) std::fill(&in_run[r.begin], &in_run[0] + r.end, std::uint8_t{1});
  std::vector<int> zeros(p.frame_values, 0), counted(p.frame_values, 0);
  for (int f = 0; f < p.frames; ++f) {
    for (std::size_t i = 0; i < p.frame_values; ++i) {
      const std::size_t at = p.at(f, i);
      if (in_run[at] || !p.use[at] || order[i] < 0) continue;
      ++counted[i];
      zeros[i] += p.value[at] == 0;
    }
  }
  const double all = std::accumulate(counted.begin(), counted.end(), 0.0);
  if (all == 0) return found;  // nothing but zeros: no packet is worse than the others
  const double share = std::max(std::accumulate(zeros.begin(), zeros.end(), 0.0) / all, 1.0 / 65536);

  std::vector<Run> lost;
  std::vector<double> gains;
  for (const Run& r : runs) {
    double gain = 0;
    for (std::size_t at = r.begin; at < r.end; ++at) {
      const std::size_t i = at % p.frame_values;
      if (order[i] >= 0) gain -= std::log((zeros[i] + share) / (counted[i] + 1.0));
    }
    if (gain <= kPacketEvidence) continue;
    lost.push_back(r);
    gains.push_back(gain);
  }
  // Packets are counted from arming; a bag may have begun later, then the runs themselves say where packets start.
  const auto packetsAt = [&](std::size_t phase) {
    long long packets = 0;
    for (const Run& r : lost) {
      const std::size_t first = firstPacket(p, r.begin, phase);
      if (first + kPacketValues <= r.end) packets += static_cast<long long>((r.end - first) / kPacketValues);
    }
    return packets;
  };
  std::size_t phase = 0;
  long long best = packetsAt(0), possible = 0;
  for (const Run& r : lost) possible += static_cast<long long>((r.end - r.begin) / kPacketValues);
  for (std::size_t candidate = 1; best < possible && candidate < kPacketValues; ++candidate) {
    const long long packets = packetsAt(candidate);
    if (packets > best) {
      best = packets;
      phase = candidate;
    }
  }
  for (std::size_t i = 0; i < lost.size(); ++i) {
    const std::size_t first = firstPacket(p, lost[i].begin, phase);
    if (first + (lost[i].end == p.value.size() ? 1 : kPacketValues) > lost[i].end) continue;
    const std::size_t whole = (lost[i].end - first) / kPacketValues;
    const std::size_t rest = lost[i].end == p.value.size() ? lost[i].end - first - whole * kPacketValues : 0;
    std::fill(&p.use[first], &p.use[0] + first + whole * kPacketValues + rest, std::uint8_t{0});
    found.lost += static_cast<long long>(whole) + (rest > 0 ? 1 : 0);
    found.log_likelihood_gain += gains[i];
  }
  return found;
}

std::optional<Slip> findSlip(const Payload& p) {
  if (p.frames < 2) return std::nullopt;
  // A slip puts other samples into every place: frames differ from those before by about twice their power, once.
  std::vector<double> jump(static_cast<std::size_t>(p.frames), 0);
  double power = 0;
  for (int f = 1; f < p.frames; ++f) {
    double sum = 0;
    for (std::size_t i = 0; i < p.frame_values; ++i) {
      const std::size_t now = p.at(f, i), before = p.at(f - 1, i);
      if (!p.use[now] || !p.use[before]) continue;
      const double d = static_cast<double>(p.value[now]) - p.value[before];
      sum += d * d;
      power += static_cast<double>(p.value[now]) * p.value[now];
    }
    jump[static_cast<std::size_t>(f)] = sum;
  }
  power /= p.frames - 1;
  std::vector<double> sorted(jump.begin() + 1, jump.end());
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<long>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  // The last packet before the frame's end may be all that jumps: a tenth of the power is below any slip's.
  const double least = 0.1 * power;
  // Where frames change by as much all the time nothing stands that could slip: of a tone that turns from frame to
  // frame some other order of samples explains any change.
  if (p.frames > 3 && usual > least) return std::nullopt;
  std::vector<int> jumps;
  for (int f = 1; f < p.frames; ++f) {
    const double j = jump[static_cast<std::size_t>(f)];
    if (j > least && (p.frames == 2 || j > 4 * usual)) jumps.push_back(f);
  }
  if (jumps.empty()) return std::nullopt;

  // The longest stretch of frames without a jump is the template.
  int first = 0, last = 0;
  jumps.push_back(p.frames);
  for (std::size_t i = 0, begin = 0; i < jumps.size(); begin = static_cast<std::size_t>(jumps[i++])) {
    if (jumps[i] - static_cast<int>(begin) > last - first) {
      first = static_cast<int>(begin);
      last = jumps[i];
    }
  }
  std::vector<double> sum(p.frame_values, 0), weight(p.frame_values, 0);
  double squares = 0;
  for (int f = first; f < last; ++f) {
    for (std::size_t i = 0; i < p.frame_values; ++i) {
      const std::size_t at = p.at(f, i);
      if (!p.use[at]) continue;
      const double v = p.value[at];
      sum[i] += v;
      squares += v * v;
      ++weight[i];
    }
  }
  double residual = squares, freedom = 0;
  for (std::size_t i = 0; i < p.frame_values; ++i) {
    if (weight[i] == 0) return std::nullopt;
    residual -= sum[i] * sum[i] / weight[i];
    freedom += weight[i] - 1;
    sum[i] /= weight[i];
  }
  // Rounding alone leaves 1/12.
  const double variance = std::max(freedom > 0 ? residual / freedom : 0.0, 1.0 / 12);

  // Misfit of every block between packet boundaries to the template shifted by whole packets.
  const std::size_t origin = firstPacket(p, 0, 0);
  const std::size_t blocks = (p.value.size() - origin + kPacketValues - 1) / kPacketValues + 1;
  const auto blockOf = [&](std::size_t at) { return at < origin ? 0 : (at - origin) / kPacketValues + 1; };
  std::optional<Slip> best;
  double best_cost = 0;
  std::vector<double> still(blocks + 1, 0), used(blocks + 1, 0);
  const auto misfit = [&](long shift, std::vector<double>& to, bool count) {
    std::fill(to.begin(), to.end(), 0);
    const long values = static_cast<long>(p.frame_values);
    const auto turn = static_cast<std::size_t>(((shift * static_cast<long>(kPacketValues)) % values + values) % values);
    for (std::size_t at = 0; at < p.value.size(); ++at) {
      if (!p.use[at]) continue;
      const double d = p.value[at] - sum[(at + turn) % p.frame_values];
      to[blockOf(at) + 1] += d * d;
      if (count) ++used[blockOf(at) + 1];
    }
    std::partial_sum(to.begin(), to.end(), to.begin());
  };
  misfit(0, still, true);
  std::partial_sum(used.begin(), used.end(), used.begin());
  std::vector<double> shifted(blocks + 1, 0);
  for (int packets = 1; packets <= kMostPackets; ++packets) {
    for (const bool template_after : {false, true}) {
      misfit(template_after ? -packets : packets, shifted, false);
      for (std::size_t b = 1; b < blocks; ++b) {
        // Blocks before b are original, those from b on have slipped.
        const double fit = template_after ? shifted[b] : shifted[blocks] - shifted[b];
        const double was = template_after ? still[b] : still[blocks] - still[b];
        const double noise = variance * (template_after ? used[b] : used[blocks] - used[b]);
        // What was so is unexplained beyond noise; a slip explains nearly all of that, in whatever frames it is. Of a
        // walker close by, some other order of samples explains half.
        if (was - noise < least || fit - noise > 0.2 * (was - noise)) continue;
        const double gain = (was - fit) / (2 * variance);
        if (!best || gain > best_cost) {
          best_cost = gain;
          best = Slip{origin + (b - 1) * kPacketValues, packets, 0};
        }
      }
    }
  }
  // Every boundary and number of packets was a try, each with a sign.
  const double tries = std::log(2.0 * kMostPackets * static_cast<double>(blocks)) + std::log(1e6);
  if (!best || best_cost <= tries) return std::nullopt;
  best->log_likelihood_gain = best_cost;
  return best;
}

void closeSlip(const Slip& slip, Payload& p) {
  const std::size_t gap =
      std::min(static_cast<std::size_t>(slip.packets) * kPacketValues, p.value.size() - slip.position);
  const auto open = [&](auto& list) {
    std::copy_backward(list.begin() + static_cast<long>(slip.position), list.end() - static_cast<long>(gap),
                       list.end());
    std::fill_n(list.begin() + static_cast<long>(slip.position), gap, 0);
  };
  open(p.value);
  open(p.use);
}

}  // namespace mmradartwin::diagnosis::frames
