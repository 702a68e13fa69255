#include "diagnosis/search/hiding_places.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "diagnosis/search/places_apart.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kHidingGrid_m = 0.1;        ///< spacing of the places, at least
constexpr double kMostHidingPlaces = 20000;  ///< places of a grid; that of a hall is coarser
constexpr double kWidths_m[] = {0.2, 0.35, 0.6};
constexpr double kBesideRadar_m = 0.1;  ///< nothing stands nearer to where the radar stood
constexpr int kBinsOfEcho = 2;          ///< bins to each side that an echo fills
constexpr double kHolds = 0.7;          ///< share of an echo's power, of a path that stands for it
constexpr std::size_t kKept = 2;        ///< places that are kept

/// Echo that stands out where it is expected, or would.
struct ExpectedPath {
  const MeasuredPose* pose;
  const PathRecord* record;
  double missing_nats;
};

/// Adds the paths that hold most of the power of a cell's strongest echo.
void addPaths(const ChannelLikelihood& model, const PoseEchoes& echoes, const MeasuredPose& pose,
              const std::vector<ChannelLikelihood::MissingEcho>& missing, std::vector<ExpectedPath>& to) {
  const double bin_m = model.data().radar.range_bin_m();
  const auto channels = static_cast<std::size_t>(model.data().radar.channels());
  for (const MeasuredPath& path : pose.paths) {
    const double place = 0.5 * meanLength_m(path.record) / bin_m, amplitude = path.record.amplitude;
    const int middle = static_cast<int>(std::lround(place));
    ExpectedPath expected{&pose, &path.record, 0};
    bool holds = false;
    for (int bin = middle - kBinsOfEcho; bin <= middle + kBinsOfEcho; ++bin) {
      if (bin < model.firstBin() || bin >= static_cast<int>(missing.size())) continue;
      const ChannelLikelihood::MissingEcho& echo = missing[static_cast<std::size_t>(bin)];
      if (echo.group < 0) continue;
      const EchoGroup& group = echoes.at(static_cast<std::size_t>(echo.group));
      const auto fields = group.bins.at(bin, channels * (channels + 1) / 2);
      if (group.actors != actorsOf(path.record) || !fields) continue;
      const double response = hannResponse(bin - place), own = amplitude * amplitude * response * response;
      if (own < kHolds * fields->mean) continue;
      expected.missing_nats += echo.nats;
      holds = holds || bin == middle;
    }
    if (holds) to.push_back(expected);
  }
}

}  // namespace

std::vector<HidingPlace> hidingPlaces(const Scene& scene, const ChannelLikelihood& model, const ModelState& null,
                                      const std::vector<int>& poses, const std::vector<MeasuredPose>& measured) {
  std::vector<ExpectedPath> paths;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const int pose = poses[i];
    const PoseEchoes& echoes = null.echoes[static_cast<std::size_t>(pose)];
    addPaths(model, echoes, measured[i], model.withoutStrongest(echoes, null.latents, pose), paths);
  }
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : scene.actors) bounds.extend(a.bounds);
  if (paths.empty() || bounds.isEmpty()) return {};
  const Eigen::Vector2d first = bounds.min().head<2>(), size = bounds.sizes().head<2>();
  const double grid_m = std::max(kHidingGrid_m, std::sqrt(size.prod() / kMostHidingPlaces));
  const int nx = static_cast<int>(size.x() / grid_m), ny = static_cast<int>(size.y() / grid_m);
  std::vector<HidingPlace> places(static_cast<std::size_t>(std::max(0, nx)) *
                                  static_cast<std::size_t>(std::max(0, ny)));
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t j) {
    HidingPlace& place = places[j];
    place.x_m = first.x() + grid_m * (static_cast<double>(j % static_cast<std::size_t>(nx)) + 0.5);
    place.y_m = first.y() + grid_m * (static_cast<double>(j / static_cast<std::size_t>(nx)) + 0.5);
    const LawVariable passing("passing_m", {place.x_m, place.y_m});
    double free_m = INFINITY;
    for (const MeasuredPose& pose : measured) {
      const Eigen::Vector2d radar = pose.where.T_map_radar.translation().head<2>();
      free_m = std::min(free_m, (radar - Eigen::Vector2d(place.x_m, place.y_m)).norm() - kBesideRadar_m);
    }
    std::vector<std::pair<double, const ExpectedPath*>> passed;
    for (const ExpectedPath& path : paths) {
      const LawVariable::Values v = passing.of(path.pose->where, *path.record);
      if (v.count > 0) passed.emplace_back(v.value[0], &path);
    }
    for (double width_m : kWidths_m) {
      if (0.5 * width_m > free_m) continue;
      std::vector<double> by_location(model.data().locations.size(), 0.0);
      double nats = 0;
      for (const auto& [distance_m, path] : passed) {
        if (distance_m > 0.5 * width_m) continue;
        nats += path->missing_nats;
        by_location[static_cast<std::size_t>(path->pose->location)] += path->missing_nats;
      }
      // What only one location misses is no object.
      nats -= std::max(0.0, *std::max_element(by_location.begin(), by_location.end()));
      if (nats <= place.screened_nats) continue;
      place.screened_nats = nats;
      place.width_m = width_m;
    }
  });
  std::stable_sort(places.begin(), places.end(),
                   [](const HidingPlace& a, const HidingPlace& b) { return a.screened_nats > b.screened_nats; });
  return placesApart(places, {}, kKept);
}

}  // namespace mmradartwin::diagnosis::search
