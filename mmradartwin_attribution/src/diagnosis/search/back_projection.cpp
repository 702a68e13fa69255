#include "diagnosis/search/back_projection.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "diagnosis/search/places_apart.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kGrid_m = 0.1, kLateGrid_m = 0.2;  ///< spacing of the places, of those of late points
constexpr double kNearest_m = 0.4;                  ///< distance from the radar at which a pose sees a place
constexpr double kWidest_sine = 0.95;               ///< limit of the sine of the azimuth at which a pose sees a place
constexpr double kSizes_m[] = {0.04, 0.15, 0.3, 0.5};  ///< diameters that are tried
constexpr double kLeastLate_m = 0.4, kMostLate_m = 3;  ///< delay of a late echo, as one-way range
constexpr double kLateRcs_dbsm[] = {-15, -5, 5};       ///< levels of late points that are tried
constexpr double kFacing = 0.1;                        ///< share of poses that a flat side faces
constexpr std::size_t kMostFaced = 5;                  ///< poses that are kept of them
constexpr double kLeastRcs_dbsm = -25;                 ///< unlisted small things have less
constexpr double kWide_m[] = {0.12, 0.25};             ///< radii of a wide object
constexpr std::size_t kMostPlaces = 4;                 ///< places that are kept
constexpr double kMostCells = 1e6;                     ///< cells of a room that is searched
constexpr double kNearby_m = 0.6;                      ///< distance of an actor that may have been moved to a place
constexpr double kLargest_m = 2.5;                     ///< diagonal of an actor that can be moved
constexpr double kOffset_m = 0.1;                      ///< typical change of a place that is fitted

std::string placeName(const ProjectedPlace& place) {
  std::ostringstream at;
  at << std::fixed << std::setprecision(1) << "at " << place.x_m << ", " << place.y_m << " m";
  return at.str();
}

/// Object that may stand at a place.
struct Source {
  double size_m = 0;                  ///< diameter of an upright metal cylinder, whose nearest line echoes; 0: a point
  double behind_m = 0, rcs_dbsm = 0;  ///< of a point: delay as one-way range, and radar cross-section
  bool side = false;                  ///< a flat side, which echoes as a mirror to the poses that it faces
};

}  // namespace

Eigen::Vector2d awayFromRadar(const ChannelData& data, const Eigen::Vector2d& place) {
  Eigen::Vector2d radar = Eigen::Vector2d::Zero();
  for (const PoseChannels& p : data.poses) radar += p.pose.T_map_radar.translation().head<2>();
  return (place - radar / static_cast<double>(data.poses.size())).normalized();
}

namespace {

/// Nats of a flat side that a pose may face or not, from those that it has where it does.
double mayFace(double nats) {
  return nats > 0 ? nats + std::log(kFacing + (1 - kFacing) * std::exp(-nats)) : std::log1p(kFacing * std::expm1(nats));
}

/// Nats of one more source at every place of a grid over the scene, over all poses and with nothing refitted; best
/// first.
std::vector<ProjectedPlace> project(const Twin& twin, const ChannelLikelihood& model, const ModelState& null,
                                    const std::vector<Source>& sources, double grid_m) {
  const ChannelData& data = model.data();
  const RadarConfig& radar = data.radar;
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  // Inverse covariances of all bins.
  std::vector<std::vector<ChannelLikelihood::Whitened>> cells(data.poses.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t i) {
    cells[i] = model.whitened(null.echoes[i], null.latents, static_cast<int>(i));
  });
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : twin.scene().actors) bounds.extend(a.bounds);
  const int nx = static_cast<int>(bounds.sizes().x() / grid_m), ny = static_cast<int>(bounds.sizes().y() / grid_m);
  if (nx < 1 || ny < 1 || static_cast<double>(nx) * ny > kMostCells) return {};
  std::vector<ProjectedPlace> places(static_cast<std::size_t>(nx) * ny);
  const double wave = 2 * M_PI / radar.wavelength_m(), gain = std::exp(null.latents.log_gain);
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t j) {
    ProjectedPlace& place = places[j];
    place.x_m = bounds.min().x() + grid_m * (static_cast<double>(j % static_cast<std::size_t>(nx)) + 0.5);
    place.y_m = bounds.min().y() + grid_m * (static_cast<double>(j / static_cast<std::size_t>(nx)) + 0.5);
    // [locations][sources] nats
    Eigen::ArrayXXd gained = Eigen::ArrayXXd::Zero(static_cast<Eigen::Index>(data.locations.size()),
                                                   static_cast<Eigen::Index>(sources.size()));
    Eigen::VectorXcd v(channels);
    std::vector<std::pair<double, int>> facing;
    for (std::size_t i = 0; i < data.poses.size(); ++i) {
      const Eigen::Isometry3d& T = data.poses[i].pose.T_map_radar;
      const Eigen::Vector3d point(place.x_m, place.y_m, T.translation().z());
      const Eigen::Vector3d way = T.inverse() * point;
      const double r = way.norm();
      if (r < kNearest_m || way.x() <= 0 || std::abs(way.y()) > kWidest_sine * r) continue;
      for (int k = 0; k < channels; ++k) v[k] = std::polar(1.0, -wave * radar.virtual_element_m(k).y() * way.y() / r);
      double looked_m = -1;  // radius for which `visible` holds
      bool visible = false;
      for (std::size_t k = 0; k < sources.size(); ++k) {
        const Source& source = sources[k];
        const double radius_m = 0.5 * source.size_m, near_m = r - radius_m, at_m = near_m + source.behind_m;
        const int bin = static_cast<int>(std::lround(at_m / radar.range_bin_m()));
        if (near_m < kNearest_m || bin < model.firstBin() || bin >= samples) continue;
        if (radius_m != looked_m) {
          looked_m = radius_m;
          visible = twin.rays().visible(T.translation(), T.translation() + near_m / r * (point - T.translation()));
        }
        if (!visible) continue;
        const ChannelLikelihood::Whitened& cell = cells[i][static_cast<std::size_t>(bin)];
        const double w = hannResponse(bin - at_m / radar.range_bin_m());
        // Power of a metal cylinder: (lambda/(8 pi r))^2 a/(a + r); of a point: lambda^2 sigma/((4 pi)^3 r^4).
        const double level = radar.wavelength_m() / (8 * M_PI * near_m);
        const double spread = source.side    ? 1
                              : radius_m > 0 ? radius_m / (radius_m + near_m)
                                             : std::pow(10.0, source.rcs_dbsm / 10) / (M_PI * near_m * near_m);
        const double nats = model.gainOfPoint(cell, gain * w * w * level * level * spread,
                                              v.dot(cell.inverse * v).real(), std::norm(v.dot(cell.solved)));
        gained(data.poses[i].location, static_cast<Eigen::Index>(k)) += source.side ? mayFace(nats) : nats;
        if (source.side && nats > 0) facing.emplace_back(-nats, static_cast<int>(i));
      }
    }
    for (std::size_t k = 0; k < sources.size(); ++k) {
      // The location that gains most is left out: what only one location sees is no object.
      const auto nats = gained.col(static_cast<Eigen::Index>(k));
      const double without_best = nats.sum() - std::max(0.0, nats.maxCoeff());
      if (without_best <= place.screened_nats) continue;
      place.screened_nats = without_best;
      place.size_m = sources[k].size_m;
      place.behind_m = sources[k].behind_m;
      place.rcs_dbsm = sources[k].rcs_dbsm;
    }
    std::sort(facing.begin(), facing.end());
    for (std::size_t i = 0; i < std::min(kMostFaced, facing.size()); ++i) place.faced.push_back(facing[i].second);
  });
  std::stable_sort(places.begin(), places.end(),
                   [](const ProjectedPlace& a, const ProjectedPlace& b) { return a.screened_nats > b.screened_nats; });
  return places;
}

/// The best places that lie apart from each other and from the twin's own objects of that mechanism, whose residuals
/// follow from their shape.
std::vector<ProjectedPlace> apart(const std::vector<ProjectedPlace>& places, const ModelState& null,
                                  const std::string& mechanism) {
  std::vector<ProjectedPlace> known;
  for (const NamedParameters& m : null.mechanisms) {
    if (m.mechanism == mechanism) known.push_back({m.values.number("x_m"), m.values.number("y_m")});
  }
  return placesApart(places, known, kMostPlaces);
}

}  // namespace

std::vector<ProjectedPlace> projectBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null) {
  std::vector<Source> cylinders;
  for (double size_m : kSizes_m) cylinders.push_back({size_m, 0, 0});
  return apart(project(twin, model, null, cylinders, kGrid_m), null, mechanismOfForm(MechanismForm::kUnmodelledObject));
}

std::vector<ProjectedPlace> projectSidesBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null) {
  Source side;
  side.side = true;
  return apart(project(twin, model, null, {side}, kGrid_m), null, mechanismOfForm(MechanismForm::kUnmodelledObject));
}

std::vector<ProjectedPlace> projectLateBack(const Twin& twin, const ChannelLikelihood& model, const ModelState& null) {
  std::vector<Source> points;
  const double step_m = model.data().radar.range_bin_m();
  for (double behind_m = std::max(kLeastLate_m, 2 * step_m); behind_m < kMostLate_m; behind_m += step_m) {
    for (double rcs_dbsm : kLateRcs_dbsm) points.push_back({0, behind_m, rcs_dbsm});
  }
  return apart(project(twin, model, null, points, kLateGrid_m), null, mechanismOfForm(MechanismForm::kLateEcho));
}

Hypothesis lateEchoAt(const ProjectedPlace& place) {
  Hypothesis h;
  h.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kLateEcho));
  h.mechanism.values.set("x_m", place.x_m);
  h.mechanism.values.set("y_m", place.y_m);
  h.mechanism.values.set("behind_m", place.behind_m);
  h.coordinates = {{"rcs_dbsm", "dBsm", -1, -200, place.rcs_dbsm, kLeastRcs_dbsm, 60}};
  h.variant = placeName(place);
  return h;
}

Hypothesis objectAt(const ProjectedPlace& place) {
  Hypothesis h;
  h.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kUnmodelledObject));
  h.mechanism.values.set("x_m", place.x_m);
  h.mechanism.values.set("y_m", place.y_m);
  h.coordinates = {{"size_m", "m", -1, 0, std::max(0.02, place.size_m), 0.002, 5}};
  h.variant = placeName(place);
  return h;
}

void freePlace(const ChannelData& data, Screened& object) {
  Hypothesis& hypothesis = object.hypothesis;
  const Eigen::Vector2d place(hypothesis.mechanism.values.number("x_m"), hypothesis.mechanism.values.number("y_m"));
  const bool late = hypothesis.form() == MechanismForm::kLateEcho;
  std::vector<std::pair<const char*, double>> free = {{"y_m", kOffset_m}, {"x_m", kOffset_m}};
  if (late) free.insert(free.begin(), {"behind_m", 0.5 * data.radar.range_bin_m()});
  for (const auto& [key, step_m] : free) {
    const double at_m = hypothesis.mechanism.values.number(key);
    const double least_m = std::string(key) == "behind_m" ? 0.5 * kLeastLate_m : -1000;
    hypothesis.coordinates.insert(hypothesis.coordinates.begin(), {key, "m", -1, at_m, at_m + step_m, least_m, 1000});
    for (std::vector<double>& start : object.starts) start.insert(start.begin(), 0.0);
  }
  if (late) return;
  // The side that faces the radar echoes: the axis of a wide object stands behind the place.
  const Eigen::Vector2d away = awayFromRadar(data, place);
  for (double radius_m : kWide_m) {
    const Eigen::Vector2d axis = place + radius_m * away;
    object.starts.push_back({hypothesis.coordinates[0].scaled(axis.x()), hypothesis.coordinates[1].scaled(axis.y()),
                             hypothesis.coordinates[2].scaled(2 * radius_m)});
  }
}

std::vector<int> objectsNear(const Scene& scene, double x_m, double y_m) {
  std::vector<std::pair<double, int>> near;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const Actor& actor = scene.actors[a];
    const Eigen::AlignedBox2d plan(actor.bounds.min().head<2>(), actor.bounds.max().head<2>());
    const double apart_m = plan.exteriorDistance(Eigen::Vector2d(x_m, y_m));
    if (!actor.present || plan.diagonal().norm() > kLargest_m || apart_m >= kNearby_m) continue;
    near.emplace_back(apart_m, static_cast<int>(a));
  }
  std::sort(near.begin(), near.end());
  std::vector<int> actors;
  for (const auto& [apart_m, actor] : near) actors.push_back(actor);
  return actors;
}

}  // namespace mmradartwin::diagnosis::search
