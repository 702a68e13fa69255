#include "diagnosis/search/replica_screen.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <set>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/likelihood/profiled_scores.h"

namespace mmradartwin::diagnosis::search {
namespace {

/// Power of an echo whose replicas are searched for, over that of the pose's strongest one.
constexpr double kLeastReplicaPower = 1e-4;
constexpr double kNearest_bins = 1.75;           ///< from an echo: nearer bins belong to its main lobe
constexpr double kFarthest_m = 3;                ///< from an echo
constexpr double kStep_bins = 0.125;             ///< between distances
constexpr double kTypical_db = -15;              ///< of a replica's level
constexpr double kLevels_db[] = {-20, -12, -5};  ///< levels by which distances are scanned
constexpr std::size_t kLevels = std::size(kLevels_db);
constexpr std::ptrdiff_t kApart_steps = 8;  ///< distance between peaks of one scan
constexpr std::size_t kLooks = 4;           ///< peaks that are judged by the whole likelihood
/// Distance of a second face within the main lobe. It shows only in the width of an actor's echoes, which no single bin
/// gives.
constexpr double kSecondFace_bins = 0.6;
constexpr std::size_t kFaces = 16;  ///< actors of highest power, of which a second face is searched for

using Gains = std::array<double, kLevels>;  ///< nats, by level

/// Replica to be judged.
struct Peak {
  std::size_t target;  ///< 0: all echoes, else an actor's index plus one
  double behind_m;
  double rank;  ///< nats; for second faces the received power. The highest are judged.
};

/// One scan of a session.
class ReplicaScan {
 public:
  ReplicaScan(const Twin& base, const ChannelLikelihood& model, const ModelState& null, const std::vector<int>& poses);
  std::size_t targets() const { return targets_; }
  /// Distances of a target with a gain above least_nats and above that of their neighbours.
  std::vector<Peak> peaksOf(std::size_t target, double least_nats) const;
  /// Second faces of the actors that are seen at all.
  std::vector<Peak> secondFaces() const;
  Hypothesis hypothesisOf(const Peak& peak) const;
  double binWidth_m() const { return bin_m_; }

 private:
  /// Gains of one pose: nats that each target's replicas would explain.
  void scan(const Twin& twin, std::size_t j);
  /// Gains of the replicas of one echo, added to its targets.
  void scanEcho(const PathRecord& record, const std::vector<ChannelLikelihood::Whitened>& cells,
                const std::set<std::size_t>& met, std::vector<Gains>& sums) const;

  const Twin& base_;
  const ChannelLikelihood& model_;
  const ModelState& null_;
  const std::vector<int>& poses_;
  std::size_t targets_;  ///< all echoes, and each actor's
  double bin_m_;
  std::vector<double> distances_m_;
  std::array<double, kLevels> levels_;         ///< of power
  std::vector<std::vector<Gains>> sums_;       ///< [poses][targets * distances]
  std::vector<std::vector<double>> received_;  ///< [poses][targets] power, over that of the strongest echo
};

ReplicaScan::ReplicaScan(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                         const std::vector<int>& poses)
    : base_(base),
      model_(model),
      null_(null),
      poses_(poses),
      targets_(1 + base.scene().actors.size()),
      bin_m_(base.radar().range_bin_m()),
      sums_(poses.size()),
      received_(poses.size()) {
  for (double d = kNearest_bins * bin_m_; d <= kFarthest_m; d += kStep_bins * bin_m_) {
    distances_m_.insert(distances_m_.begin(), -d);
    distances_m_.push_back(d);
  }
  std::transform(std::begin(kLevels_db), std::end(kLevels_db), levels_.begin(),
                 [](double db) { return std::pow(10, db / 10); });
  const Twin twin = base.changed(null.mechanisms);
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) { scan(twin, j); });
}

void ReplicaScan::scan(const Twin& twin, std::size_t j) {
  sums_[j].assign(targets_ * distances_m_.size(), Gains{});
  received_[j].assign(targets_, 0.0);
  const auto pose = static_cast<std::size_t>(poses_[j]);
  const PoseChannels& p = model_.data().poses[pose];
  const Eigen::Isometry3d& T = p.pose.T_map_radar;
  const std::vector<PathRecord> records = twin.receivedPaths(T, twin.trace(T, p.pose.stamp_ns), p.pose.stamp_ns);
  const std::vector<ChannelLikelihood::Whitened> cells = model_.whitened(null_.echoes[pose], null_.latents, poses_[j]);
  double strongest = 0;
  for (const PathRecord& r : records) strongest = std::max(strongest, r.amplitude);
  for (const PathRecord& r : records) {
    if (r.bounces == 0 || r.amplitude * r.amplitude < kLeastReplicaPower * strongest * strongest) continue;
    std::set<std::size_t> met = {0};
    for (int a : r.actors) {
      if (a >= 0) met.insert(1 + static_cast<std::size_t>(a));
    }
    for (std::size_t target : met) received_[j][target] += std::pow(r.amplitude / strongest, 2);
    scanEcho(r, cells, met, sums_[j]);
  }
}

void ReplicaScan::scanEcho(const PathRecord& record, const std::vector<ChannelLikelihood::Whitened>& cells,
                           const std::set<std::size_t>& met, std::vector<Gains>& sums) const {
  const int channels = base_.radar().channels(), samples = base_.radar().samples_per_chirp;
  const SessionLatents& latents = null_.latents;
  double own = std::exp(latents.log_gain);
  for (int a : record.actors) own *= std::exp(latents.actor_gain[errorOf(a, latents.actor_gain.size())]);
  const Eigen::Map<const Eigen::VectorXcd> c(record.c.data(), channels);
  Eigen::VectorXd found(samples), noise(samples);
  for (int bin = 0; bin < samples; ++bin) {
    const ChannelLikelihood::Whitened& cell = cells[static_cast<std::size_t>(bin)];
    noise[bin] = c.dot(cell.inverse * c).real();
    found[bin] = std::norm(c.dot(cell.solved));
  }
  for (std::size_t d = 0; d < distances_m_.size(); ++d) {
    const double place = (0.5 * meanLength_m(record) + distances_m_[d]) / bin_m_;
    const int first = std::max(model_.firstBin(), static_cast<int>(std::ceil(place - 1)));
    const int last = std::min(samples - 1, static_cast<int>(std::floor(place + 1)));
    Gains gains{};
    for (int bin = first; bin <= last; ++bin) {
      const double w = hannResponse(bin - place), power = own * w * w;
      for (std::size_t level = 0; level < kLevels; ++level) {
        gains[level] +=
            model_.gainOfPoint(cells[static_cast<std::size_t>(bin)], power * levels_[level], noise[bin], found[bin]);
      }
    }
    for (std::size_t target : met) {
      Gains& sum = sums[target * distances_m_.size() + d];
      for (std::size_t level = 0; level < kLevels; ++level) sum[level] += gains[level];
    }
  }
}

std::vector<Peak> ReplicaScan::peaksOf(std::size_t target, double least_nats) const {
  const ChannelData& data = model_.data();
  std::vector<double> screened_nats(distances_m_.size(), 0);
  for (std::size_t d = 0; d < distances_m_.size(); ++d) {
    for (std::size_t level = 0; level < kLevels; ++level) {
      std::vector<double> by_location(data.locations.size(), 0.0);
      for (std::size_t j = 0; j < poses_.size(); ++j) {
        const int location = data.poses[static_cast<std::size_t>(poses_[j])].location;
        by_location[static_cast<std::size_t>(location)] += sums_[j][target * distances_m_.size() + d][level];
      }
      const double gain = std::accumulate(by_location.begin(), by_location.end(), 0.0);
      screened_nats[d] = std::max(screened_nats[d], gain / overdispersionOfPresence(gain, by_location));
    }
  }
  std::vector<Peak> peaks;
  const auto count = static_cast<std::ptrdiff_t>(distances_m_.size());
  for (std::ptrdiff_t d = 0; d < count; ++d) {
    const auto around = screened_nats.begin() + d;
    const auto low = screened_nats.begin() + std::max<std::ptrdiff_t>(0, d - kApart_steps);
    const auto high = screened_nats.begin() + std::min(count, d + kApart_steps + 1);
    if (*around > least_nats && around == std::max_element(low, high)) {
      peaks.push_back({target, distances_m_[static_cast<std::size_t>(d)], *around});
    }
  }
  return peaks;
}

std::vector<Peak> ReplicaScan::secondFaces() const {
  std::vector<Peak> faces;
  for (std::size_t target = 1; target < targets_; ++target) {
    const double power = std::accumulate(received_.begin(), received_.end(), 0.0,
                                         [&](double sum, const auto& of_pose) { return sum + of_pose[target]; });
    if (power > 0) faces.push_back({target, kSecondFace_bins * bin_m_, power});
  }
  return faces;
}

Hypothesis ReplicaScan::hypothesisOf(const Peak& peak) const {
  Hypothesis hypothesis;
  hypothesis.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kReplica));
  if (peak.target > 0) {
    hypothesis.subject = base_.scene().actors[peak.target - 1].name;
    hypothesis.mechanism.values.set("actor", hypothesis.subject);
  }
  hypothesis.mechanism.values.set("behind_m", peak.behind_m);
  hypothesis.coordinates = {{"level_db", "dB", -1, -200, kTypical_db, -60, 10}};
  hypothesis.searched = peak.target > 0 ? 1 : 0;  // one more for the actor
  return hypothesis;
}

/// The best of the highest peaks by `look`. The scan has few levels and takes echoes one by one, so that the whole
/// likelihood decides. The distance becomes a coordinate to be fitted.
std::optional<Screened> bestReplica(const ReplicaScan& scan, std::vector<Peak> peaks, std::size_t looks,
                                    const std::function<Screened(const Hypothesis&)>& look) {
  std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.rank > b.rank; });
  if (peaks.size() > looks) peaks.resize(looks);
  std::optional<Screened> best;
  double behind_m = 0;
  for (const Peak& p : peaks) {
    Screened s = look(scan.hypothesisOf(p));
    if (best && s.screened_nats <= best->screened_nats) continue;
    best = std::move(s);
    behind_m = p.behind_m;
  }
  if (!best) return best;
  best->hypothesis.coordinates.push_back({"behind_m", "m", -1, behind_m, behind_m + 0.5 * scan.binWidth_m(), -50, 50});
  for (std::vector<double>& start : best->starts) start.push_back(0);
  return best;
}

}  // namespace

std::vector<Screened> screenReplicas(const Twin& base, const ChannelLikelihood& model, const ModelState& null,
                                     const std::vector<int>& poses, double least_nats,
                                     const std::function<Screened(const Hypothesis&)>& look) {
  for (const NamedParameters& m : null.mechanisms) {
    if (traitsOf(m.mechanism).form == MechanismForm::kReplica) return {};  // residuals of one replica resemble another
  }
  const ReplicaScan scan(base, model, null, poses);
  std::vector<Screened> result;
  if (auto of_all = bestReplica(scan, scan.peaksOf(0, least_nats), kLooks, look)) result.push_back(std::move(*of_all));
  std::vector<Peak> peaks;
  for (std::size_t target = 1; target < scan.targets(); ++target) {
    for (const Peak& p : scan.peaksOf(target, least_nats)) peaks.push_back(p);
  }
  if (auto of_one = bestReplica(scan, std::move(peaks), kLooks, look)) result.push_back(std::move(*of_one));
  std::optional<Screened> face = bestReplica(scan, scan.secondFaces(), kFaces, look);
  if (face && face->screened_nats > bounds::kLeastNatsOfSecondFace) result.push_back(std::move(*face));
  return result;
}

}  // namespace mmradartwin::diagnosis::search
