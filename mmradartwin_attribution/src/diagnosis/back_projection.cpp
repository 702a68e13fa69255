#include "back_projection.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace mmradartwin {
namespace {

constexpr double kGrid_m = 0.1;
constexpr double kNearest_m = 0.4;
constexpr double kWidest_sine = 0.95;
constexpr double kSizes_m[] = {0.04, 0.15, 0.3, 0.5};  // diameters that are tried
constexpr int kSizes = 4;
constexpr double kWide_m[] = {0.12, 0.25};  // radii of something wide
constexpr double kApart_m = 0.5;
constexpr std::size_t kMostPlaces = 4;
constexpr double kNearby_m = 0.6, kLargest_m = 2.5;  // of an actor that may have been moved to a place

}  // namespace

Eigen::Vector2d awayFromRadar(const ChannelData& data, const Eigen::Vector2d& place) {
  Eigen::Vector2d radar = Eigen::Vector2d::Zero();
  for (const PoseChannels& p : data.poses) radar += p.pose.T_map_radar.translation().head<2>();
  return (place - radar / static_cast<double>(data.poses.size())).normalized();
}

std::vector<ProjectedPlace> projectBack(const Twin& twin, const SessionModel& model, const ModelState& null) {
  const ChannelData& data = model.data();
  const RadarConfig& radar = data.radar;
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  // All that the test needs of a bin.
  std::vector<std::vector<SessionModel::Whitened>> cells(data.poses.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    cells[i] = model.whitened(null.echoes[i], null.nuisance, static_cast<int>(i));
  });
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : twin.scene().actors) bounds.extend(a.bounds);
  const int nx = static_cast<int>(bounds.sizes().x() / kGrid_m), ny = static_cast<int>(bounds.sizes().y() / kGrid_m);
  if (nx < 1 || ny < 1 || static_cast<double>(nx) * ny > 1e6) return {};
  std::vector<ProjectedPlace> places(static_cast<std::size_t>(nx) * ny);
  const double wave = 2 * M_PI / radar.wavelength_m(), gain = std::exp(null.nuisance.log_gain);
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t j) {
    ProjectedPlace& place = places[j];
    place.x_m = bounds.min().x() + kGrid_m * (static_cast<double>(j % static_cast<std::size_t>(nx)) + 0.5);
    place.y_m = bounds.min().y() + kGrid_m * (static_cast<double>(j / static_cast<std::size_t>(nx)) + 0.5);
    // [locations][sizes] nats
    Eigen::ArrayXXd gained = Eigen::ArrayXXd::Zero(static_cast<Eigen::Index>(data.locations.size()), kSizes);
    Eigen::VectorXcd v(channels);
    for (std::size_t i = 0; i < data.poses.size(); ++i) {
      const Eigen::Isometry3d& T = data.poses[i].pose.T_map_radar;
      const Eigen::Vector3d point(place.x_m, place.y_m, T.translation().z());
      const Eigen::Vector3d way = T.inverse() * point;
      const double r = way.norm();
      if (r < kNearest_m || way.x() <= 0 || std::abs(way.y()) > kWidest_sine * r) continue;
      for (int k = 0; k < channels; ++k) v[k] = std::polar(1.0, -wave * radar.virtual_element_m(k).y() * way.y() / r);
      for (int k = 0; k < kSizes; ++k) {
        // The line of a cylinder that faces the radar echoes.
        const double radius_m = 0.5 * kSizes_m[k], near_m = r - radius_m;
        const int bin = static_cast<int>(std::lround(near_m / radar.range_bin_m()));
        if (near_m < kNearest_m || bin < model.firstBin() || bin >= samples) continue;
        if (!twin.rays().visible(T.translation(), T.translation() + near_m / r * (point - T.translation()))) continue;
        const SessionModel::Whitened& cell = cells[i][static_cast<std::size_t>(bin)];
        const double w = hannResponse(bin - near_m / radar.range_bin_m());
        // Of a metal cylinder: (lambda/(8 pi r))^2 a/(a + r).
        const double level = radar.wavelength_m() / (8 * M_PI * near_m);
        const double power = gain * w * w * level * level * radius_m / (radius_m + near_m);
        gained(data.poses[i].location, k) +=
            model.gainOfPoint(cell, power, v.dot(cell.inverse * v).real(), std::norm(v.dot(cell.solved)));
      }
    }
    for (int k = 0; k < kSizes; ++k) {
      // What one place sees alone is no object.
      const double all = gained.col(k).sum(), broad = all - std::max(0.0, gained.col(k).maxCoeff());
      if (broad <= place.promised) continue;
      place.promised = broad;
      place.size_m = kSizes_m[k];
    }
  });
  std::stable_sort(places.begin(), places.end(),
                   [](const ProjectedPlace& a, const ProjectedPlace& b) { return a.promised > b.promised; });
  // What remains around an object that the twin has by now is of its shape.
  std::vector<ProjectedPlace> known;
  for (const NamedParameters& m : null.mechanisms) {
    if (m.mechanism != "actor_unmodelled") continue;
    known.push_back({m.values.number("x_m"), m.values.number("y_m")});
  }
  std::vector<ProjectedPlace> best;
  for (const ProjectedPlace& p : places) {
    if (best.size() == kMostPlaces || !(p.promised > 0)) break;
    const auto near = [&](const ProjectedPlace& other) {
      return std::hypot(p.x_m - other.x_m, p.y_m - other.y_m) < kApart_m;
    };
    const bool taken = std::any_of(best.begin(), best.end(), near) || std::any_of(known.begin(), known.end(), near);
    if (!taken) best.push_back(p);
  }
  return best;
}

Hypothesis objectAt(const ProjectedPlace& place) {
  Hypothesis h;
  h.mechanism = defaultMechanism("actor_unmodelled");
  h.mechanism.values.set("x_m", place.x_m);
  h.mechanism.values.set("y_m", place.y_m);
  h.coordinates = {{"size_m", "m", -1, 0, std::max(0.02, place.size_m), 0.002, 5}};
  std::ostringstream at;
  at << std::fixed << std::setprecision(1) << "at " << place.x_m << ", " << place.y_m << " m";
  h.variant = at.str();
  return h;
}

void freePlace(const ChannelData& data, Screened& object) {
  Hypothesis& h = object.hypothesis;
  const Eigen::Vector2d place(h.mechanism.values.number("x_m"), h.mechanism.values.number("y_m"));
  for (const char* key : {"y_m", "x_m"}) {
    const double at_m = h.mechanism.values.number(key);
    h.coordinates.insert(h.coordinates.begin(), {key, "m", -1, at_m, at_m + 0.1, -1000, 1000});
    for (std::vector<double>& start : object.starts) start.insert(start.begin(), 0.0);
  }
  // What echoes is the side that faces the radar: of something wide the axis stands behind it.
  const Eigen::Vector2d away = awayFromRadar(data, place);
  for (double radius_m : kWide_m) {
    const Eigen::Vector2d axis = place + radius_m * away;
    object.starts.push_back(
        {h.coordinates[0].scaled(axis.x()), h.coordinates[1].scaled(axis.y()), h.coordinates[2].scaled(2 * radius_m)});
  }
}

int nearestObject(const Scene& scene, double x_m, double y_m) {
  int nearest = -1;
  double least_m = kNearby_m;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const Actor& actor = scene.actors[a];
    const Eigen::AlignedBox2d plan(actor.bounds.min().head<2>(), actor.bounds.max().head<2>());
    const double apart_m = plan.exteriorDistance(Eigen::Vector2d(x_m, y_m));
    if (!actor.present || plan.diagonal().norm() > kLargest_m || apart_m >= least_m) continue;
    least_m = apart_m;
    nearest = static_cast<int>(a);
  }
  return nearest;
}

}  // namespace mmradartwin
