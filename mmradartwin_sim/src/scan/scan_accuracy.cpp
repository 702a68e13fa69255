#include "scan/scan_accuracy.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kSharpEdge = 0.85;      // cosine of the angle between faces that meet at an edge
constexpr double kTooLevel = 0.7;        // |cosine| between normal and up: faces beyond return nothing to a radar
constexpr double kLeastScene_m = 0.001;  // a scanner's own scale, to a ten-thousandth over a room
constexpr double kNoPlane_m = 0.05;      // stated where nothing upright was measured: an effort

/// Share of a mesh's area that lies within a reach of its sharp edges.
double shareAtEdges(const ScanThing& thing, double reach_m) {
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> sides;
  double area_m2 = 0;
  for (const auto& t : thing.triangles) {
    const auto at = [&](std::size_t k) { return thing.vertices[static_cast<std::size_t>(t[k])]; };
    const Eigen::Vector3d across = (at(1) - at(0)).cross(at(2) - at(0));
    area_m2 += across.norm() / 2;
    for (std::size_t k = 0; k < 3; ++k) sides[std::minmax(t[k], t[(k + 1) % 3])].push_back(across.normalized());
  }
  double length_m = 0;
  for (const auto& [ends, normals] : sides) {
    if (normals.size() == 2 && normals[0].dot(normals[1]) > kSharpEdge) continue;
    length_m +=
        (thing.vertices[static_cast<std::size_t>(ends.first)] - thing.vertices[static_cast<std::size_t>(ends.second)])
            .norm();
  }
  return area_m2 > 0 ? std::min(1.0, 2 * reach_m * length_m / area_m2) : 1.0;
}

bool returnsEchoes(const ScanPlane& plane) { return std::abs(plane.normal.z()) < kTooLevel; }

double square(double x) { return x * x; }

/// What its shape leaves of its points beyond the noise; and at its edges, where normals of both faces mix, a face may
/// be taken anywhere within three sigma of the noise. Surfaces are off by bow_m over half a metre, too.
double rangeStd_m(const ScanThing& thing, const ScanFrame& frame, double bow_m) {
  const double beyond_noise = std::max(0.0, square(thing.rms_m) - square(frame.noise_m));
  const double at_edges = shareAtEdges(thing, bounds::kReachOfNormals_voxels * frame.spacing_m);
  // Even over three sigma to both sides: its standard deviation is sqrt(3) sigma.
  return std::sqrt(square(bow_m) + beyond_noise + 3 * square(at_edges * frame.noise_m));
}

}  // namespace

double levelAccuracy_db(const std::vector<MaterialProposal>& materials) {
  const double known_db = StatedAccuracy{}.level_db;
  if (materials.empty()) return known_db;
  double squares = 0;
  for (const MaterialProposal& p : materials) squares += square(p.level_std_db);
  return std::min(10.0, std::sqrt(square(known_db) + squares / static_cast<double>(materials.size())));
}

StatedAccuracy accuracyOf(ScanScene& scene) {
  StatedAccuracy accuracy;
  double squares = 0, area = 0;
  for (const ScanPlane& p : scene.planes) squares += p.covered_m2 * square(p.bow_m), area += p.covered_m2;
  const double bow_m = area > 0 ? std::sqrt(squares / area) : kNoPlane_m;
  double sum = 0, count = 0;
  for (const ScanPlane& p : scene.planes) {
    if (returnsEchoes(p)) sum += square(p.bow_m), ++count;
  }
  for (ScanThing& t : scene.things) {
    t.range_std_m = rangeStd_m(t, scene.frame, bow_m);
    sum += square(t.range_std_m), ++count;
  }
  accuracy.scene_m = count > 0 ? std::max(kLeastScene_m, std::sqrt(sum / count)) : kNoPlane_m;
  // A surface whose heights have the rms b and are alike as exp(-(r/L)^2) has slopes of rms sqrt(2) b / L.
  accuracy.path_range_m = std::max(accuracy.path_range_m, bow_m);
  accuracy.path_angle_deg =
      std::max(accuracy.path_angle_deg, std::sqrt(2.0) * bow_m / bounds::kDriftPatch_m * 180 / M_PI);
  accuracy.level_db = levelAccuracy_db(scene.materials);
  return accuracy;
}

}  // namespace mmradartwin
