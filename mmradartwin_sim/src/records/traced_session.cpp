#include "mmradartwin_sim/traced_session.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

#include "mmradartwin_dsp/input_error.h"
#include "records/record_group.h"

namespace mmradartwin {
namespace {

/// Where on the grid of directions and lengths a node lies.
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
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  std::vector<char> summed(records.size(), 0);
  std::vector<PathRecord> scaled;
  ComplexGrid x;
  Eigen::ArrayXf sum(2 * channels * samples);
  for (const std::vector<std::size_t>& group : groupByFacetOrActor(records, options.fewest_records)) {
    const std::size_t begin = nodes_.size();
    sum.setZero();
    std::map<Place, Node> nodes;
    for (std::size_t i : group) {
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
      PathRecord stand_in = standIn(first);
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
      sum += Eigen::Map<const Eigen::ArrayXf>(grids_.data() + grids_.size() - sum.size(), sum.size());
      for (const auto& c : stand_in.c) inverse_.push_back(std::conj(c) / std::norm(c));
      nodes_.push_back(std::move(stand_in));
    }
    stretches_.push_back({begin, nodes_.size()});
    sums_.insert(sums_.end(), sum.data(), sum.data() + sum.size());
  }
  grids_.shrink_to_fit();
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (!summed[i]) records_.push_back(std::move(records[i]));
  }
}

void CondensedTrace::addNodes(const RadarConfig& radar, const std::function<void(PathRecord&)>& weigh,
                              ComplexGrid& x) const {
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const auto grid_size = static_cast<std::size_t>(2 * channels * samples);
  if (x.rows() != channels || x.cols() != samples) x = ComplexGrid::Zero(channels, samples);
  const double rate_per_m = 2 * M_PI * radar.slope_hz_per_s / kSpeedOfLight_m_per_s;
  std::vector<float> sum(grid_size, 0.0F);
  const auto add = [&](const std::complex<double>& factor, const float* re, int channel) {
    const float fr = static_cast<float>(factor.real()), fi = static_cast<float>(factor.imag());
    // As array expressions, which work on four numbers at once.
    const Eigen::Map<const Eigen::ArrayXf> from_re(re, samples), from_im(re + samples, samples);
    float* to = sum.data() + static_cast<std::size_t>(2 * channel * samples);
    Eigen::Map<Eigen::ArrayXf>(to, samples) += fr * from_re - fi * from_im;
    Eigen::Map<Eigen::ArrayXf>(to + samples, samples) += fr * from_im + fi * from_re;
  };
  // Few enough at a time for sums in single precision.
  constexpr std::size_t kAtOnce = 16;
  std::size_t added = 0;
  const auto flush = [&] {
    for (int k = 0; k < channels; ++k) {
      const float* re = sum.data() + static_cast<std::size_t>(2 * k * samples);
      for (int n = 0; n < samples; ++n) x(k, n) += std::complex<double>(re[n], re[samples + n]);
    }
    std::fill(sum.begin(), sum.end(), 0.0F);
    added = 0;
  };
  PathRecord is;  // one for all: its lists keep their memory
  std::vector<std::complex<double>> factor;
  for (std::size_t s = 0; s < stretches_.size(); ++s) {
    const Stretch& stretch = stretches_[s];
    factor.clear();
    bool alike = true, as_long = true;
    for (std::size_t i = stretch.begin; i < stretch.end; ++i) {
      const PathRecord& was = nodes_[i];
      is = was;
      weigh(is);
      for (std::size_t k = 0; k < is.c.size(); ++k) {
        factor.push_back(is.c[k] * inverse_[i * is.c.size() + k]);
        alike = alike && std::norm(factor.back() - factor[k]) <= 1e-15 * std::norm(factor[k]);
        const double longer_m = is.length_m[k] - was.length_m[k];
        if (longer_m == 0) continue;
        as_long = false;
        const float* re = grids_.data() + i * grid_size + 2 * k * static_cast<std::size_t>(samples);
        for (int n = 0; n < samples; ++n) {
          x(static_cast<Eigen::Index>(k), n) +=
              factor.back() * std::complex<double>(re[n], re[samples + n]) *
              std::polar(1.0, rate_per_m * longer_m * (radar.sample_time_s(n) - radar.window_center_s()));
        }
        factor.back() = 0;  // it is in x already
      }
    }
    const bool as_one = alike && as_long;
    for (std::size_t i = stretch.begin; i < (as_one ? stretch.begin + 1 : stretch.end); ++i) {
      const float* grid = as_one ? sums_.data() + s * grid_size : grids_.data() + i * grid_size;
      const std::complex<double>* by = factor.data() + (i - stretch.begin) * static_cast<std::size_t>(channels);
      const auto plain = [by](const std::complex<double>& f) {
        return std::norm(f - by[0].real()) <= 1e-15 * std::norm(f);
      };
      if (std::all_of(by, by + channels, plain)) {
        // Levels and patterns are one real factor for all channels.
        const auto size = static_cast<Eigen::Index>(grid_size);
        Eigen::Map<Eigen::ArrayXf>(sum.data(), size) +=
            static_cast<float>(by[0].real()) * Eigen::Map<const Eigen::ArrayXf>(grid, size);
      } else {
        for (int k = 0; k < channels; ++k) add(by[k], grid + static_cast<std::size_t>(2 * k * samples), k);
      }
      if (++added == kAtOnce) flush();
    }
  }
  flush();
}

std::size_t CondensedTrace::bytes() const {
  std::size_t sum =
      (grids_.capacity() + sums_.capacity()) * sizeof grids_[0] + inverse_.capacity() * sizeof inverse_[0];
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
      traces_[i] = CondensedTrace(twin.radar(), twin.trace(poses[i].T_map_radar, poses[i].stamp_ns), options);
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
