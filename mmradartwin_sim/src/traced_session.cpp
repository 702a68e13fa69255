#include "mmradartwin_sim/traced_session.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// What the records of one facet have in common, and where on the grid of directions and lengths a node lies.
using Group = std::tuple<const std::string*, std::vector<int>, std::vector<int>>;
using Place = std::tuple<int, int, int>;  // azimuth, elevation, length

struct Node {
  std::vector<std::pair<std::size_t, double>> members;  // record and its share
};

/// Directions as the grid of nodes has them, in steps.
Eigen::Vector2d steps(const Eigen::Vector3d& direction, const CondensedTrace::Options& options) {
  constexpr double kDegrees = 180 / M_PI;
  return {kDegrees * std::atan2(direction.y(), direction.x()) / options.azimuth_step_deg,
          kDegrees * std::asin(std::min(1.0, std::max(-1.0, direction.z()))) / options.elevation_step_deg};
}

Eigen::Vector3d direction(int azimuth, int elevation, const CondensedTrace::Options& options) {
  const double a = azimuth * options.azimuth_step_deg * M_PI / 180,
               e = elevation * options.elevation_step_deg * M_PI / 180;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

}  // namespace

CondensedTrace::CondensedTrace(const RadarConfig& radar, std::vector<PathRecord> records, const Options& options) {
  std::map<Group, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PathRecord& r = records[i];
    if (r.facets.empty() || r.departure != r.arrival) continue;
    groups[{r.event, r.actors, r.facets}].push_back(i);
  }
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  std::vector<char> summed(records.size(), 0);
  std::vector<PathRecord> scaled;
  ComplexGrid x;
  // Groups in the order of their first records: by name and place in the scene, never by address.
  std::vector<const std::pair<const Group, std::vector<std::size_t>>*> in_order;
  for (const auto& group : groups) {
    if (static_cast<int>(group.second.size()) >= options.fewest_records) in_order.push_back(&group);
  }
  std::sort(in_order.begin(), in_order.end(),
            [](const auto* a, const auto* b) { return a->second.front() < b->second.front(); });
  for (const auto* group : in_order) {
    std::map<Place, Node> nodes;
    for (std::size_t i : group->second) {
      summed[i] = 1;
      const Eigen::Vector2d at = steps(records[i].departure, options);
      const int a = static_cast<int>(std::floor(at.x())), e = static_cast<int>(std::floor(at.y()));
      const int l = static_cast<int>(std::floor(records[i].length_m[0] / options.length_step_m));
      for (int da : {0, 1}) {
        for (int de : {0, 1}) {
          const double share = (da ? at.x() - a : 1 - at.x() + a) * (de ? at.y() - e : 1 - at.y() + e);
          if (share > 0) nodes[{a + da, e + de, l}].members.emplace_back(i, share);
        }
      }
    }
    for (const auto& [place, node] : nodes) {
      const PathRecord& first = records[node.members.front().first];
      PathRecord stand_in;
      stand_in.event = first.event;
      stand_in.actors = first.actors;
      stand_in.facets = first.facets;
      stand_in.bounces = first.bounces;
      stand_in.reflection_cosine = first.reflection_cosine;
      stand_in.departure = stand_in.arrival = direction(std::get<0>(place), std::get<1>(place), options);
      stand_in.length_m.assign(static_cast<std::size_t>(channels), 0);
      stand_in.vertices.assign(first.vertices.size(), Eigen::Vector3d::Zero());
      scaled.clear();
      double shares = 0, power = 0;
      for (const auto& [i, share] : node.members) {
        const PathRecord& r = records[i];
        shares += share;
        power += share * share * r.amplitude * r.amplitude;
        for (int k = 0; k < channels; ++k) stand_in.length_m[k] += share * r.length_m[k];
        for (std::size_t v = 0; v < r.vertices.size(); ++v) stand_in.vertices[v] += share * r.vertices[v];
        scaled.emplace_back();
        scaled.back().length_m = r.length_m;
        scaled.back().c = r.c;
        for (auto& c : scaled.back().c) c *= share;
      }
      for (double& length : stand_in.length_m) length /= shares;
      for (auto& v : stand_in.vertices) v /= shares;
      setContribution(radar, std::sqrt(power), stand_in);
      x = ComplexGrid::Zero(channels, samples);
      accumulate(radar, scaled, x);
      for (int k = 0; k < channels; ++k) {
        for (int n = 0; n < samples; ++n) grids_.push_back(static_cast<float>(x(k, n).real()));
        for (int n = 0; n < samples; ++n) grids_.push_back(static_cast<float>(x(k, n).imag()));
      }
      nodes_.push_back(std::move(stand_in));
    }
  }
  grids_.shrink_to_fit();
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!summed[i]) records_.push_back(std::move(records[i]));
  }
}

void CondensedTrace::addNodes(const RadarConfig& radar, const std::vector<PathRecord>& weighed, ComplexGrid& x) const {
  if (weighed.size() != nodes_.size()) throw std::invalid_argument("CondensedTrace: one weighed stand-in per node");
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const std::size_t grid_size = static_cast<std::size_t>(2 * channels * samples);
  if (x.rows() != channels || x.cols() != samples) x = ComplexGrid::Zero(channels, samples);
  const double rate_per_m = 2 * M_PI * radar.slope_hz_per_s / kSpeedOfLight_m_per_s;
  // Few enough at a time for sums in single precision.
  constexpr std::size_t kAtOnce = 16;
  std::vector<float> sum(grid_size);
  for (std::size_t first = 0; first < nodes_.size(); first += kAtOnce) {
    std::fill(sum.begin(), sum.end(), 0.0F);
    for (std::size_t i = first; i < std::min(nodes_.size(), first + kAtOnce); ++i) {
      const PathRecord &was = nodes_[i], &is = weighed[i];
      for (int k = 0; k < channels; ++k) {
        const float* re = grids_.data() + i * grid_size + static_cast<std::size_t>(2 * k * samples);
        const float* im = re + samples;
        // As a product: a complex division is a call that guards against overflow.
        const std::complex<double> factor =
            is.c[k] == was.c[k] ? 1.0 : is.c[k] * std::conj(was.c[k]) * (1 / std::norm(was.c[k]));
        const double longer_m = is.length_m[k] - was.length_m[k];
        if (longer_m != 0) {
          for (int n = 0; n < samples; ++n) {
            x(k, n) += factor * std::complex<double>(re[n], im[n]) *
                       std::polar(1.0, rate_per_m * longer_m * (radar.sample_time_s(n) - radar.window_center_s()));
          }
          continue;
        }
        const float fr = static_cast<float>(factor.real()), fi = static_cast<float>(factor.imag());
        float* to_re = sum.data() + 2 * k * samples;
        float* to_im = to_re + samples;
        for (int n = 0; n < samples; ++n) {
          to_re[n] += fr * re[n] - fi * im[n];
          to_im[n] += fr * im[n] + fi * re[n];
        }
      }
    }
    for (int k = 0; k < channels; ++k) {
      const float* re = sum.data() + 2 * k * samples;
      for (int n = 0; n < samples; ++n) x(k, n) += std::complex<double>(re[n], re[samples + n]);
    }
  }
}

std::size_t CondensedTrace::bytes() const {
  std::size_t sum = grids_.capacity() * sizeof grids_[0];
  for (const auto* list : {&records_, &nodes_}) {
    for (const PathRecord& r : *list) {
      sum += sizeof r + r.c.size() * sizeof r.c[0] + r.length_m.size() * sizeof(double) +
             r.vertices.size() * sizeof r.vertices[0] + r.reflection_cosine.size() * sizeof(double) +
             (r.actors.size() + r.facets.size()) * sizeof(int);
    }
  }
  return sum;
}

TracedSession::TracedSession(const Twin& twin, const std::vector<Pose>& poses, const CondensedTrace::Options& options)
    : scene_file_(twin.description().scene_file),
      radar_yaml_(toYaml(twin.radar())),
      poses_(poses),
      usable_(poses.size(), 0),
      traces_(poses.size()) {
  std::vector<std::string> failures(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
    try {
      traces_[i] = CondensedTrace(twin.radar(), twin.trace(poses[i].T_map_radar), options);
      usable_[i] = 1;
    } catch (const InputError& e) {
      failures[i] = e.what();
    }
  });
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!usable_[i]) problems_.push_back({poses[i].name, "pose " + poses[i].name + ": " + failures[i]});
  }
}

Simulation TracedSession::weigh(const Twin& twin, std::size_t pose) const {
  if (!usable(pose)) throw std::invalid_argument("TracedSession: pose " + poses_[pose].name + " was not traced");
  if (twin.description().scene_file != scene_file_ || toYaml(twin.radar()) != radar_yaml_) {
    throw std::invalid_argument("TracedSession: the weighing twin has another scene or radar than the tracing one");
  }
  return twin.weigh(poses_[pose].T_map_radar, traces_[pose], poses_[pose].stamp_ns);
}

std::size_t TracedSession::bytes() const {
  std::size_t sum = 0;
  for (const CondensedTrace& t : traces_) sum += t.bytes();
  return sum;
}

}  // namespace mmradartwin
