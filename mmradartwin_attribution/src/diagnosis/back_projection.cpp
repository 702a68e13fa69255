#include "back_projection.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

constexpr double kGrid_m = 0.1;
constexpr double kNearest_m = 0.4;
constexpr double kWidest_sine = 0.95;

}  // namespace

std::optional<ProjectedPlace> projectBack(const Twin& twin, const SessionModel& model, const ModelState& null) {
  const ChannelData& data = model.data();
  const RadarConfig& radar = data.radar;
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  // All that the test needs of a bin.
  std::vector<std::vector<SessionModel::Whitened>> cells(data.poses.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    for (int bin = 0; bin < samples; ++bin) {
      cells[i].push_back(
          model.whitened(null.echoes[i], null.nuisance, static_cast<int>(i), std::max(bin, model.firstBin())));
    }
  });
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : twin.scene().actors) bounds.extend(a.bounds);
  const int nx = static_cast<int>(bounds.sizes().x() / kGrid_m), ny = static_cast<int>(bounds.sizes().y() / kGrid_m);
  if (nx < 1 || ny < 1 || static_cast<double>(nx) * ny > 1e6) return std::nullopt;
  std::vector<ProjectedPlace> places(static_cast<std::size_t>(nx) * ny);
  const double wave = 2 * M_PI / radar.wavelength_m(), gain = std::exp(null.nuisance.log_gain);
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t j) {
    ProjectedPlace& place = places[j];
    place.x_m = bounds.min().x() + kGrid_m * (static_cast<double>(j % static_cast<std::size_t>(nx)) + 0.5);
    place.y_m = bounds.min().y() + kGrid_m * (static_cast<double>(j / static_cast<std::size_t>(nx)) + 0.5);
    Eigen::VectorXd score = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(data.locations.size()));
    double information = 0;
    Eigen::VectorXcd v(channels);
    for (std::size_t i = 0; i < data.poses.size(); ++i) {
      const Eigen::Isometry3d& T = data.poses[i].pose.T_map_radar;
      const Eigen::Vector3d point(place.x_m, place.y_m, T.translation().z());
      const Eigen::Vector3d way = T.inverse() * point;
      const double r = way.norm();
      if (r < kNearest_m || way.x() <= 0 || std::abs(way.y()) > kWidest_sine * r) continue;
      const int bin = static_cast<int>(std::lround(r / radar.range_bin_m()));
      if (bin < model.firstBin() || bin >= samples) continue;
      if (!twin.rays().visible(T.translation(), point)) continue;
      for (int k = 0; k < channels; ++k) v[k] = std::polar(1.0, -wave * radar.virtual_element_m(k).y() * way.y() / r);
      const SessionModel::Whitened& cell = cells[i][static_cast<std::size_t>(bin)];
      const double w = hannResponse(bin - r / radar.range_bin_m());
      // Of a cylinder of 1 m radius: (lambda/(8 pi r))^2 / (1 + r).
      const double level = radar.wavelength_m() / (8 * M_PI * r);
      const double power = gain * w * w * level * level / (1 + r);
      const double noise = v.dot(cell.inverse * v).real();
      score[data.poses[i].location] += power * (cell.weight * std::norm(v.dot(cell.solved)) - noise);
      information += power * noise * power * noise;
    }
    score *= model.weight();
    information *= model.weight();
    const double total = score.sum();
    if (!(total > 0) || !(information > 0)) return;
    const double variance = std::max(information, score.squaredNorm());
    place.promised = 0.5 * total * total / variance;
    place.size_m = 2 * std::clamp(total / information, 1e-3, 0.5);
  });
  const auto best = std::max_element(places.begin(), places.end(),
                                     [](const auto& a, const auto& b) { return a.promised < b.promised; });
  if (!(best->promised > 0)) return std::nullopt;
  return *best;
}

Hypothesis objectAt(const ProjectedPlace& place) {
  Hypothesis h;
  h.mechanism = defaultMechanism("actor_unmodelled");
  h.coordinates = {{"x_m", "m", -1, place.x_m, place.x_m + 0.1, -1000, 1000},
                   {"y_m", "m", -1, place.y_m, place.y_m + 0.1, -1000, 1000},
                   {"size_m", "m", -1, 0, std::max(0.02, place.size_m), 0.002, 5}};
  return h;
}

}  // namespace mmradartwin
