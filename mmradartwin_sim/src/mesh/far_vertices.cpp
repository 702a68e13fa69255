#include "mesh/far_vertices.h"

#include <cmath>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr double kFar_m = 1e4;       ///< single precision tells millimetres apart up to here
constexpr double kFarBySize = 1000;  ///< a map of a town is as wide as it is far

}  // namespace

std::string originAdvice(const Eigen::Vector3d& far_vertex) {
  std::ostringstream text;
  text.precision(12);
  const auto whole = [](double v) { return std::abs(v) < 100 ? 0.0 : 100 * std::floor(v / 100); };
  text << " by origin: [" << whole(far_vertex.x()) << ", " << whole(far_vertex.y()) << ", " << whole(far_vertex.z())
       << "] (metres, z up) in scene.yaml's entry of the mesh, and the same off the poses";
  return text.str();
}

void refuseFarVertices(const std::string& file, const std::vector<Actor>& actors, const Eigen::Vector3d& origin) {
  Eigen::AlignedBox3d bounds;
  for (const Actor& actor : actors) {
    for (const Eigen::Vector3d& v : actor.vertices) bounds.extend(v + origin);
  }
  const double away_m = bounds.min().cwiseAbs().cwiseMax(bounds.max().cwiseAbs()).maxCoeff();
  if (away_m < kFar_m || away_m < kFarBySize * bounds.sizes().maxCoeff()) return;
  std::ostringstream text;
  text << file << ": lies " << std::round(away_m / 1000) << " km from its origin, where ";
  if (origin.isZero(0)) {
    text << "millimetres are lost; take an origin off" << originAdvice(bounds.min());
  } else {
    text << "its single precision has lost millimetres; export it as OBJ, whose digits are read in full";
  }
  throw InputError(text.str());
}

}  // namespace mmradartwin
