#include "diagnosis/receiver/sample_convention.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/receiver/body_fixed_tone.h"
#include "diagnosis/receiver/channel_errors.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr std::size_t kPoses = 8;  ///< a delivery shows in every pose; so many decide by hundreds of nats
constexpr double kPerPose = 2;     ///< nats per pose below which nothing is claimed
// Enough for latents to settle: of strong echoes three steps were wrong by ten thousand nats, and channels of a clean
// session were called conjugated.
constexpr int kIterations = 30;
constexpr double kPlainlyBehind = 12;                     ///< nats
constexpr int kMostReceivers = 4, kMostTransmitters = 3;  ///< whose orders are all tried

/// What the mechanism of that name does to a grid; each conjugation is its own inverse.
ComplexGrid delivered(const ComplexGrid& x, const NamedParameters& mechanism) {
  ComplexGrid y(x.rows(), x.cols());
  if (mechanism.mechanism == "iq_conjugation") return x.conjugate();
  if (mechanism.mechanism == "channel_conjugation") {
    for (Eigen::Index n = 0; n < x.cols(); ++n) y.col(n) = x.col((x.cols() - n) % x.cols()).conjugate();
    return y;
  }
  // order[i] is the true channel that stands in place i.
  const std::vector<double>& order = mechanism.values.numbers("order");
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    y.row(static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)])) = x.row(i);
  }
  return y;
}

void undo(const NamedParameters& mechanism, const RadarConfig& radar, MovingCell& cell) {
  const Eigen::VectorXcd before = cell.channels;
  if (mechanism.mechanism == "iq_conjugation") {
    cell.channels = before.conjugate();
    cell.bin = (radar.samples_per_chirp - cell.bin) % radar.samples_per_chirp;
    cell.turn_rad = -cell.turn_rad;
  } else if (mechanism.mechanism == "channel_conjugation") {
    cell.channels = before.reverse();  // the same but for a phase of all
  } else {
    const std::vector<double>& order = mechanism.values.numbers("order");
    for (std::size_t i = 0; i < order.size(); ++i) {
      cell.channels[static_cast<Eigen::Index>(order[i])] = before[static_cast<Eigen::Index>(i)];
    }
  }
}

NamedParameters permutation(const std::vector<int>& order) {
  NamedParameters m = defaultMechanism("channel_permutation");
  m.values.set("order", std::vector<double>(order.begin(), order.end()));
  return m;
}

/// Orders that wrong lanes and transmitters in another order make: receivers in any order, the same under every
/// transmitter. None where there are too many.
std::vector<std::vector<int>> ordersOfLanes(const RadarConfig& radar) {
  std::vector<std::vector<int>> all;
  std::vector<int> blocks(static_cast<std::size_t>(radar.slots()));
  std::iota(blocks.begin(), blocks.end(), 0);
  if (radar.receivers() > kMostReceivers || radar.slots() > kMostTransmitters) return all;
  do {
    std::vector<int> lanes(static_cast<std::size_t>(radar.receivers()));
    std::iota(lanes.begin(), lanes.end(), 0);
    do {
      std::vector<int> order;
      for (int block : blocks) {
        for (int lane : lanes) order.push_back(block * radar.receivers() + lane);
      }
      all.push_back(std::move(order));
    } while (std::next_permutation(lanes.begin(), lanes.end()));
  } while (std::next_permutation(blocks.begin(), blocks.end()));
  return all;
}

}  // namespace

void undoSampleConvention(const SampleConvention& delivery, ChannelData& data) {
  const SignalChain chain(data.radar);
  for (PoseChannels& p : data.poses) {
    p.grid.x = delivered(p.grid.x, delivery.mechanism);
    transformGrid(chain, p);
    for (MovingCell& cell : p.moving) undo(delivery.mechanism, data.radar, cell);
  }
}

void undoSampleConvention(const SampleConvention& delivery, const RadarConfig& radar, AdcCube& frame) {
  const auto negative = [](std::int16_t v) { return static_cast<std::int16_t>(v == INT16_MIN ? INT16_MAX : -v); };
  if (delivery.mechanism.mechanism == "iq_conjugation") {
    for (std::size_t i = 1; i < frame.data.size(); i += 2) frame.data[i] = negative(frame.data[i]);
    return;
  }
  const int receivers = radar.receivers(), slots = radar.slots(), channels = radar.channels();
  std::vector<int> order(static_cast<std::size_t>(channels));
  std::iota(order.rbegin(), order.rend(), 0);
  if (delivery.mechanism.mechanism == "channel_permutation") {
    const std::vector<double>& places = delivery.mechanism.values.numbers("order");
    std::transform(places.begin(), places.end(), order.begin(), [](double k) { return static_cast<int>(k); });
  }
  const AdcCube before = frame;
  const auto at = [&](int loop, int channel, int sample) {
    const int chirp = loop * slots + channel / receivers;
    return 2 * static_cast<std::size_t>((chirp * frame.samples + sample) * receivers + channel % receivers);
  };
  for (int loop = 0; loop < frame.chirps / slots; ++loop) {
    for (int i = 0; i < channels; ++i) {
      const int k = order[static_cast<std::size_t>(i)];
      for (int n = 0; n < frame.samples; ++n) {
        for (std::size_t part : {0u, 1u}) frame.data[at(loop, k, n) + part] = before.data[at(loop, i, n) + part];
      }
      frame.chirp_valid[static_cast<std::size_t>(loop * slots + k / receivers)] =
          before.chirp_valid[static_cast<std::size_t>(loop * slots + i / receivers)];
    }
  }
}

std::vector<SampleConvention> findSampleConventionByEchoes(const ChannelData& data) {
  std::vector<SampleConvention> all;
  ChannelData undone = data;
  // What leaks from transmitters into receivers lies some centimetres before the radar, not behind it.
  const BodyFixedTone tone = findBodyFixedTone(undone, true);
  if (isPlain(tone) && tone.behind > kPlainlyBehind) {
    all.push_back({defaultMechanism("iq_conjugation"), tone.behind, std::nullopt});
    undoSampleConvention(all.back(), undone);
  }
  if (const std::optional<ChannelOrder> order = findChannelOrder(undone)) {
    all.push_back({permutation(order->order), order->gain, order->margin});
  }
  return all;
}

std::optional<SampleConvention> findSampleConvention(const Twin& twin, const ChannelData& data) {
  ChannelData some = data;
  if (some.poses.size() > kPoses) {
    std::vector<PoseChannels> chosen;
    for (std::size_t i = 0; i < kPoses; ++i) chosen.push_back(data.poses[i * data.poses.size() / kPoses]);
    some.poses = std::move(chosen);
  }
  const PoseAccuracy accuracy;
  ExpectedEchoes source(twin, some, accuracy);
  const std::vector<PoseEchoes> echoes = source.echoes(twin.description().mechanisms);
  const ChannelLikelihood model(some, static_cast<int>(twin.scene().actors.size()), accuracy);
  const SessionLatents start = model.start(echoes);
  const ChannelData as_it_is = some;
  const auto likelihood = [&](const NamedParameters* mechanism, int iterations) {
    some.poses = as_it_is.poses;
    if (mechanism != nullptr) undoSampleConvention({*mechanism, 0, {}}, some);
    SessionLatents nuisance = start;
    if (iterations > 0) return model.fit(echoes, nuisance, iterations);
    return model.logLikelihood(echoes, nuisance);
  };
  std::vector<std::pair<double, NamedParameters>> tried;
  for (const char* name : {"iq_conjugation", "channel_conjugation"}) {
    const NamedParameters m = defaultMechanism(name);
    tried.emplace_back(likelihood(&m, kIterations), m);
  }
  // Orders: two places exchanged, or one channel taken out and put elsewhere, as long as that helps, from the order as
  // it is, from its reverse, and from the best that exchanged lanes make. These stop at an order that is the right one
  // but for a shift of all channels, so that all shifts are tried, too.
  const int channels = data.radar.channels();
  std::vector<int> same(static_cast<std::size_t>(channels));
  std::iota(same.begin(), same.end(), 0);
  std::vector<int> reverse(same.rbegin(), same.rend());
  std::vector<std::vector<int>> starts = {same, reverse};
  std::vector<int> of_lanes;
  double best_of_lanes = -std::numeric_limits<double>::infinity();
  for (const std::vector<int>& order : ordersOfLanes(data.radar)) {
    const NamedParameters m = permutation(order);
    const double value = likelihood(&m, 0);
    if (value <= best_of_lanes) continue;
    best_of_lanes = value;
    of_lanes = order;
  }
  if (!of_lanes.empty()) starts.push_back(of_lanes);
  std::set<std::vector<int>> ends;
  for (std::vector<int> order : starts) {
    NamedParameters m = permutation(order);
    double best = likelihood(&m, 0);
    for (bool better = true; better;) {
      better = false;
      std::vector<int> found = order;
      const auto tryOrder = [&](const std::vector<int>& next) {
        m = permutation(next);
        const double value = likelihood(&m, 0);
        if (value <= best + 1) return;
        best = value;
        found = next;
        better = true;
      };
      for (std::size_t i = 0; i < order.size(); ++i) {
        for (std::size_t j = i + 1; j < order.size(); ++j) {
          const auto first = static_cast<std::ptrdiff_t>(i), last = static_cast<std::ptrdiff_t>(j) + 1;
          std::vector<int> next = order;
          std::swap(next[i], next[j]);
          tryOrder(next);
          if (j == i + 1) continue;  // of neighbours all three are the same
          next = order;
          std::rotate(next.begin() + first, next.begin() + first + 1, next.begin() + last);
          tryOrder(next);
          next = order;
          std::rotate(next.begin() + first, next.begin() + last - 1, next.begin() + last);
          tryOrder(next);
        }
      }
      for (int shift = 1; shift < channels; ++shift) {
        std::vector<int> next = order;
        for (int& k : next) k = (k + shift) % channels;
        tryOrder(next);
      }
      order = found;
    }
    if (order == same || !ends.insert(order).second) continue;
    m = permutation(order);
    tried.emplace_back(likelihood(&m, kIterations), m);
  }
  const double as_said = likelihood(nullptr, kIterations);
  std::stable_sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const double gain = tried.front().first - as_said;
  if (gain < kPerPose * static_cast<double>(some.poses.size())) return std::nullopt;
  SampleConvention d{tried.front().second, gain, std::nullopt};
  if (tried.size() > 1) d.margin = tried[0].first - tried[1].first;
  return d;
}

}  // namespace mmradartwin::diagnosis::receiver
