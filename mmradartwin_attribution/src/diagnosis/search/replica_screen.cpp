#include "diagnosis/search/replica_screen.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>

#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kLeastPower = 1e-4;    ///< of the pose's strongest echo's, of those whose replicas are looked for
constexpr double kNearest_bins = 1.75;  ///< from an echo: nearer ones are its own main lobe
constexpr double kFarthest_m = 3;
constexpr double kStep_bins = 0.125;
constexpr double kTypical_db = -15;
constexpr double kLevels_db[] = {-20, -12, -5};  ///< that distances are looked for by
constexpr std::size_t kLevels = std::size(kLevels_db);
constexpr std::ptrdiff_t kApart_steps = 8;  ///< between distances that are looked at
constexpr std::size_t kLooks = 4;
/// A second face within the main lobe shows in how wide the echoes of an actor are, which no bin tells by itself.
constexpr double kSecondFace_bins = 0.6;
constexpr std::size_t kFaces = 16;  ///< actors with most power, of which one is looked for
constexpr double kWorthAFace = 50;  ///< nats: none promised up to 43, those that were there 62 to 171

}  // namespace

std::vector<Screened> screenReplicas(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                                     const std::vector<int>& poses, double least,
                                     const std::function<Screened(const Hypothesis&)>& look) {
  for (const NamedParameters& m : null.mechanisms) {
    if (m.mechanism == "echo_replica") return {};  // what it leaves is of its own shape
  }
  const ChannelData& data = model.data();
  const RadarConfig& radar = base.radar();
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const double bin_m = radar.range_bin_m(), gain = std::exp(null.nuisance.log_gain);
  std::vector<double> distances_m;
  for (double d = kNearest_bins * bin_m; d <= kFarthest_m; d += kStep_bins * bin_m) {
    distances_m.insert(distances_m.begin(), -d);
    distances_m.push_back(d);
  }
  const std::size_t targets = 1 + base.scene().actors.size();  // all, and each actor's
  const Twin twin = base.changed(null.mechanisms);

  // A strong replica is far from what slopes about nothing reach: the likelihood itself, of each echo's alone.
  using Gains = std::array<double, kLevels>;  // nats
  std::array<double, kLevels> levels;         // of power
  std::transform(std::begin(kLevels_db), std::end(kLevels_db), levels.begin(),
                 [](double db) { return std::pow(10, db / 10); });
  std::vector<std::vector<Gains>> sums(poses.size());       // [poses][targets][distances]
  std::vector<std::vector<double>> received(poses.size());  // [poses][targets], of the strongest echo's power
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) {
    std::vector<Gains>& sum = sums[j];
    sum.assign(targets * distances_m.size(), Gains{});
    received[j].assign(targets, 0.0);
    const auto pose = static_cast<std::size_t>(poses[j]);
    const PoseChannels& p = data.poses[pose];
    const Eigen::Isometry3d& T = p.pose.T_map_radar;
    const std::vector<PathRecord> records = twin.receivedPaths(T, twin.trace(T, p.pose.stamp_ns), p.pose.stamp_ns);
    const std::vector<ChannelLikelihood::Whitened> cells = model.whitened(null.echoes[pose], null.nuisance, poses[j]);
    double strongest = 0;
    for (const PathRecord& r : records) strongest = std::max(strongest, r.amplitude);
    Eigen::VectorXd found(samples), noise(samples);
    for (const PathRecord& r : records) {
      if (r.bounces == 0 || r.amplitude * r.amplitude < kLeastPower * strongest * strongest) continue;
      double own = gain;
      for (int a : r.actors) own *= std::exp(null.nuisance.actor_gain[errorOf(a, null.nuisance.actor_gain.size())]);
      std::set<std::size_t> met = {0};
      for (int a : r.actors) {
        if (a >= 0) met.insert(1 + static_cast<std::size_t>(a));
      }
      for (std::size_t target : met) received[j][target] += std::pow(r.amplitude / strongest, 2);
      const Eigen::Map<const Eigen::VectorXcd> c(r.c.data(), channels);
      for (int bin = 0; bin < samples; ++bin) {
        const ChannelLikelihood::Whitened& cell = cells[static_cast<std::size_t>(bin)];
        noise[bin] = c.dot(cell.inverse * c).real();
        found[bin] = std::norm(c.dot(cell.solved));
      }
      for (std::size_t d = 0; d < distances_m.size(); ++d) {
        const double place = (0.5 * meanLength_m(r) + distances_m[d]) / bin_m;
        const int first = std::max(model.firstBin(), static_cast<int>(std::ceil(place - 1)));
        const int last = std::min(samples - 1, static_cast<int>(std::floor(place + 1)));
        Gains gains{};
        for (int bin = first; bin <= last; ++bin) {
          const double w = hannResponse(bin - place), power = own * w * w;
          for (std::size_t level = 0; level < kLevels; ++level) {
            gains[level] +=
                model.gainOfPoint(cells[static_cast<std::size_t>(bin)], power * levels[level], noise[bin], found[bin]);
          }
        }
        for (std::size_t target : met) {
          Gains& to = sum[target * distances_m.size() + d];
          for (std::size_t level = 0; level < kLevels; ++level) to[level] += gains[level];
        }
      }
    }
  });

  const auto made = [&](std::size_t target, double behind_m) {
    Hypothesis h;
    h.mechanism = defaultMechanism("echo_replica");
    if (target > 0) {
      h.subject = base.scene().actors[target - 1].name;
      h.mechanism.values.set("actor", h.subject);
    }
    h.mechanism.values.set("behind_m", behind_m);
    h.coordinates = {{"level_db", "dB", -1, -200, kTypical_db, -60, 10}};
    h.searched = target > 0 ? 1 : 0;  // whose
    return h;
  };
  struct Peak {
    std::size_t target;
    double behind_m;
    double rank;  ///< nats promised; of second faces the power received: the highest are looked at
  };
  const auto peaksOf = [&](std::size_t target) {
    std::vector<double> screened_nats(distances_m.size(), 0);
    for (std::size_t d = 0; d < distances_m.size(); ++d) {
      for (std::size_t level = 0; level < kLevels; ++level) {
        std::vector<double> by_location(data.locations.size(), 0.0);
        for (std::size_t j = 0; j < poses.size(); ++j) {
          const int location = data.poses[static_cast<std::size_t>(poses[j])].location;
          by_location[static_cast<std::size_t>(location)] += sums[j][target * distances_m.size() + d][level];
        }
        const double gain = std::accumulate(by_location.begin(), by_location.end(), 0.0);
        screened_nats[d] = std::max(screened_nats[d], gain / overdispersionOfPresence(gain, by_location));
      }
    }
    std::vector<Peak> peaks;
    const auto count = static_cast<std::ptrdiff_t>(distances_m.size());
    for (std::ptrdiff_t d = 0; d < count; ++d) {
      const auto around = screened_nats.begin() + d;
      const auto low = screened_nats.begin() + std::max<std::ptrdiff_t>(0, d - kApart_steps);
      const auto high = screened_nats.begin() + std::min(count, d + kApart_steps + 1);
      if (*around > least && around == std::max_element(low, high)) {
        peaks.push_back({target, distances_m[static_cast<std::size_t>(d)], *around});
      }
    }
    return peaks;
  };
  // Of one level and of echoes by themselves, that says little of all together: the whole likelihood is asked.
  const auto bestOf = [&](std::vector<Peak> peaks, std::size_t looks) -> std::optional<Screened> {
    std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.rank > b.rank; });
    if (peaks.size() > looks) peaks.resize(looks);
    std::optional<Screened> best;
    double behind_m = 0;
    for (const Peak& p : peaks) {
      Screened s = look(made(p.target, p.behind_m));
      if (best && s.screened_nats <= best->screened_nats) continue;
      best = std::move(s);
      behind_m = p.behind_m;
    }
    if (!best) return best;
    // From here on the distance is a number to be fitted.
    best->hypothesis.coordinates.push_back({"behind_m", "m", -1, behind_m, behind_m + 0.5 * bin_m, -50, 50});
    for (std::vector<double>& start : best->starts) start.push_back(0);
    return best;
  };
  std::vector<Screened> result;
  if (auto of_all = bestOf(peaksOf(0), kLooks)) result.push_back(std::move(*of_all));
  std::vector<Peak> peaks;
  for (std::size_t target = 1; target < targets; ++target) {
    for (const Peak& p : peaksOf(target)) peaks.push_back(p);
  }
  if (auto of_one = bestOf(std::move(peaks), kLooks)) result.push_back(std::move(*of_one));
  std::vector<Peak> faces;
  for (std::size_t target = 1; target < targets; ++target) {
    const double power = std::accumulate(received.begin(), received.end(), 0.0,
                                         [&](double sum, const auto& of_pose) { return sum + of_pose[target]; });
    if (power > 0) faces.push_back({target, kSecondFace_bins * bin_m, power});
  }
  std::optional<Screened> face = bestOf(std::move(faces), kFaces);
  if (face && face->screened_nats > kWorthAFace) result.push_back(std::move(*face));
  return result;
}

}  // namespace mmradartwin::diagnosis::search
