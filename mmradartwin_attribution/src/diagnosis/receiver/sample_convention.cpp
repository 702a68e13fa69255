#include "diagnosis/receiver/sample_convention.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/receiver/body_fixed_tone.h"
#include "diagnosis/receiver/channel_errors.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr std::size_t kPoses = 8;  ///< poses that are tried: a convention shows at every one
constexpr int kConventionIterations =
    30;  ///< Fisher steps of the latents; see docs/verification/calibration_of_bounds.md#kiterations
constexpr double kBetter_nats = 1;    ///< gain from which a step to another order is taken
constexpr int kMostReceivers = 4;     ///< receivers up to which all orders are tried
constexpr int kMostTransmitters = 3;  ///< transmitters up to which all orders are tried

/// Grid with a mechanism undone. Each conjugation is its own inverse.
ComplexGrid undone(const ComplexGrid& x, const NamedParameters& mechanism) {
  ComplexGrid y(x.rows(), x.cols());
  if (mechanism.mechanism == "iq_conjugation") return x.conjugate();
  if (mechanism.mechanism == "channel_conjugation") {
    for (Eigen::Index n = 0; n < x.cols(); ++n) y.col(n) = x.col((x.cols() - n) % x.cols()).conjugate();
    return y;
  }
  // order[i] is the true channel at index i.
  const std::vector<double>& order = mechanism.values.numbers("order");
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    y.row(static_cast<Eigen::Index>(order[static_cast<std::size_t>(i)])) = x.row(i);
  }
  return y;
}

/// Undoes a mechanism in a moving cell.
void undo(const NamedParameters& mechanism, const RadarConfig& radar, MovingCell& cell) {
  const Eigen::VectorXcd before = cell.channels;
  if (mechanism.mechanism == "iq_conjugation") {
    cell.channels = before.conjugate();
    cell.bin = (radar.samples_per_chirp - cell.bin) % radar.samples_per_chirp;
    cell.turn_rad = -cell.turn_rad;
  } else if (mechanism.mechanism == "channel_conjugation") {
    cell.channels = before.reverse();  // conjugated up to a common phase
  } else {
    const std::vector<double>& order = mechanism.values.numbers("order");
    for (std::size_t i = 0; i < order.size(); ++i) {
      cell.channels[static_cast<Eigen::Index>(order[i])] = before[static_cast<Eigen::Index>(i)];
    }
  }
}

/// Permutation of channels into this order.
NamedParameters permutation(const std::vector<int>& order) {
  NamedParameters m = defaultMechanism("channel_permutation");
  m.values.set("order", std::vector<double>(order.begin(), order.end()));
  return m;
}

/// Turns the nats by which alike conventions are behind into probabilities.
void setProbabilities(SampleConvention& convention) {
  double sum = 0;
  for (auto& [mechanism, behind] : convention.alike) sum += behind = std::exp(-behind);
  for (auto& [mechanism, weight] : convention.alike) weight /= sum;
}

/// Orders that exchanged lanes and transmitters cause: receivers in any order, the same for every transmitter, and
/// transmitters in any order. Empty where there are too many.
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

void undoSampleConvention(const SampleConvention& convention, ChannelData& data) {
  const SignalChain chain(data.radar);
  for (PoseChannels& p : data.poses) {
    p.grid.x = undone(p.grid.x, convention.mechanism);
    transformGrid(chain, p);
    for (MovingCell& cell : p.moving) undo(convention.mechanism, data.radar, cell);
  }
}

void undoSampleConvention(const SampleConvention& convention, const RadarConfig& radar, AdcCube& frame) {
  const auto negative = [](std::int16_t v) { return static_cast<std::int16_t>(v == INT16_MIN ? INT16_MAX : -v); };
  if (convention.mechanism.mechanism == "iq_conjugation") {
    for (std::size_t i = 1; i < frame.data.size(); i += 2) frame.data[i] = negative(frame.data[i]);
    return;
  }
  const int receivers = radar.receivers(), slots = radar.slots(), channels = radar.channels();
  std::vector<int> order(static_cast<std::size_t>(channels));
  std::iota(order.rbegin(), order.rend(), 0);
  if (convention.mechanism.mechanism == "channel_permutation") {
    const std::vector<double>& places = convention.mechanism.values.numbers("order");
    std::transform(places.begin(), places.end(), order.begin(), [](double k) { return static_cast<int>(k); });
  }
  const AdcCube before = frame;
  const auto place = [&](int loop, int channel, int sample) {
    const int chirp = loop * slots + channel / receivers;
    return 2 * static_cast<std::size_t>((chirp * frame.samples + sample) * receivers + channel % receivers);
  };
  for (int loop = 0; loop < frame.chirps / slots; ++loop) {
    for (int i = 0; i < channels; ++i) {
      const int k = order[static_cast<std::size_t>(i)];
      for (int n = 0; n < frame.samples; ++n) {
        for (std::size_t part : {0u, 1u}) frame.data[place(loop, k, n) + part] = before.data[place(loop, i, n) + part];
      }
      frame.chirp_valid[static_cast<std::size_t>(loop * slots + k / receivers)] =
          before.chirp_valid[static_cast<std::size_t>(loop * slots + i / receivers)];
    }
  }
}

std::vector<SampleConvention> findSampleConventionByEchoes(const ChannelData& data) {
  std::vector<SampleConvention> all;
  ChannelData as_meant = data;
  // Leakage from transmitters to receivers lies some centimetres before the radar, not behind it.
  const BodyFixedTone tone = findBodyFixedTone(as_meant, true);
  if (isUnambiguous(tone) && tone.behind > bounds::kLeastNatsBehind) {
    all.push_back({defaultMechanism("iq_conjugation"), tone.behind, std::nullopt});
    undoSampleConvention(all.back(), as_meant);
  }
  if (const std::optional<ChannelOrder> order = findChannelOrder(as_meant)) {
    all.push_back({permutation(order->order), order->gain, order->margin});
    for (const auto& [other, behind] : order->alike) all.back().alike.emplace_back(permutation(other), behind);
    setProbabilities(all.back());
  }
  return all;
}

namespace {

/// Some poses of a session, evenly spread.
ChannelData somePoses(const ChannelData& data) {
  ChannelData some = data;
  if (some.poses.size() > kPoses) {
    std::vector<PoseChannels> chosen;
    for (std::size_t i = 0; i < kPoses; ++i) chosen.push_back(data.poses[i * data.poses.size() / kPoses]);
    some.poses = std::move(chosen);
  }
  return some;
}

/// Likelihood of some poses under a twin, for any convention of their samples.
class ConventionLikelihood {
 public:
  ConventionLikelihood(const Twin& twin, const ChannelData& data)
      : data_(somePoses(data)),
        source_(twin, data_, accuracy_),
        echoes_(source_.echoes(twin.description().mechanisms)),
        model_(data_, static_cast<int>(twin.scene().actors.size()), accuracy_),
        start_(model_.start(echoes_)),
        as_it_is_(data_) {}
  double poses() const { return static_cast<double>(as_it_is_.poses.size()); }
  /// Log-likelihood with the mechanism undone (null: samples as delivered) after that many steps of the latents.
  double operator()(const NamedParameters* mechanism, int iterations) {
    data_.poses = as_it_is_.poses;
    if (mechanism != nullptr) undoSampleConvention({*mechanism, 0, {}}, data_);
    SessionLatents latents = start_;
    if (iterations > 0) return model_.fit(echoes_, latents, iterations);
    return model_.logLikelihood(echoes_, latents);
  }
  double of(const std::vector<int>& order) {
    const NamedParameters m = permutation(order);
    return (*this)(&m, 0);
  }

 private:
  const PoseAccuracy accuracy_;
  ChannelData data_;  ///< data that the likelihood refers to
  ExpectedEchoes source_;
  const std::vector<PoseEchoes> echoes_;
  const ChannelLikelihood model_;
  const SessionLatents start_;
  const ChannelData as_it_is_;
};

/// Orders one step from another: two channels exchanged, one channel moved elsewhere, or all channels shifted. Only a
/// shift leads from a shifted order to the right one.
std::vector<std::vector<int>> ordersBeside(const std::vector<int>& order) {
  std::vector<std::vector<int>> all;
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      const auto first = static_cast<std::ptrdiff_t>(i), last = static_cast<std::ptrdiff_t>(j) + 1;
      std::vector<int> next = order;
      std::swap(next[i], next[j]);
      all.push_back(next);
      if (j == i + 1) continue;  // all three are the same for neighbours
      next = order;
      std::rotate(next.begin() + first, next.begin() + first + 1, next.begin() + last);
      all.push_back(next);
      next = order;
      std::rotate(next.begin() + first, next.begin() + last - 1, next.begin() + last);
      all.push_back(next);
    }
  }
  const int channels = static_cast<int>(order.size());
  for (int shift = 1; shift < channels; ++shift) {
    std::vector<int> next = order;
    for (int& k : next) k = (k + shift) % channels;
    all.push_back(next);
  }
  return all;
}

/// Best order that steps reach from an order.
std::vector<int> climb(std::vector<int> order, ConventionLikelihood& likelihood) {
  double best = likelihood.of(order);
  for (bool better = true; better;) {
    better = false;
    std::vector<int> found = order;
    for (const std::vector<int>& next : ordersBeside(order)) {
      const double value = likelihood.of(next);
      if (value <= best + kBetter_nats) continue;
      best = value;
      found = next;
      better = true;
    }
    order = found;
  }
  return order;
}

/// Orders from which steps begin: as delivered, reversed, and the best one of exchanged lanes.
std::vector<std::vector<int>> startOrders(const RadarConfig& radar, ConventionLikelihood& likelihood) {
  std::vector<int> same(static_cast<std::size_t>(radar.channels()));
  std::iota(same.begin(), same.end(), 0);
  std::vector<std::vector<int>> starts = {same, std::vector<int>(same.rbegin(), same.rend())};
  std::vector<int> of_lanes;
  double best = -std::numeric_limits<double>::infinity();
  for (const std::vector<int>& order : ordersOfLanes(radar)) {
    const double value = likelihood.of(order);
    if (value <= best) continue;
    best = value;
    of_lanes = order;
  }
  if (!of_lanes.empty()) starts.push_back(of_lanes);
  return starts;
}

}  // namespace

std::optional<SampleConvention> findSampleConvention(const Twin& twin, const ChannelData& data) {
  ConventionLikelihood likelihood(twin, data);
  std::vector<std::pair<double, NamedParameters>> tried;
  for (const char* name : {"iq_conjugation", "channel_conjugation"}) {
    const NamedParameters m = defaultMechanism(name);
    tried.emplace_back(likelihood(&m, kConventionIterations), m);
  }
  const std::vector<std::vector<int>> starts = startOrders(data.radar, likelihood);
  const std::vector<int>& same = starts.front();
  std::set<std::vector<int>> ends;
  for (const std::vector<int>& start : starts) {
    const std::vector<int> order = climb(start, likelihood);
    if (order == same || !ends.insert(order).second) continue;
    const NamedParameters m = permutation(order);
    tried.emplace_back(likelihood(&m, kConventionIterations), m);
  }
  const double as_said = likelihood(nullptr, kConventionIterations);
  std::stable_sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const double gain = tried.front().first - as_said;
  if (gain < bounds::kLeastConventionNatsPerPose * likelihood.poses()) return std::nullopt;
  SampleConvention convention{tried.front().second, gain, std::nullopt};
  if (tried.size() > 1) convention.margin = tried[0].first - tried[1].first;
  for (const auto& [nats, mechanism] : tried) {
    const double behind = tried.front().first - nats;
    if (behind <= bounds::kNotToldApart_nats) convention.alike.emplace_back(mechanism, behind);
  }
  setProbabilities(convention);
  return convention;
}

}  // namespace mmradartwin::diagnosis::receiver
