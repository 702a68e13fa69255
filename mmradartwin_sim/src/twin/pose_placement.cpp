#include "mmradartwin_sim/pose_placement.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "mesh/far_vertices.h"
#include "mmradartwin_dsp/input_error.h"
#include "scene/declared_frame.h"

namespace mmradartwin {
namespace {

constexpr double kShareOfPoses = 0.9;    ///< some may look out of an open side
constexpr double kBeside_m = 0.3;        ///< a pose may stand so far outside the bounds of a room that it is in
constexpr double kFarOrigin_m = 200;     ///< from the map's origin: a room is modelled about its own
constexpr double kLargestInKm = 0.3;     ///< diagonal of a hall in kilometres
constexpr double kLeastRoom_m = 1.5;     ///< least side of a room
constexpr double kLeastHeight_m = 0.05;  ///< of a radar over the floor, where a wrong unit puts all poses
/// Rays of a look: the field of view of the base mechanisms, by what a room's furniture takes up at its far end.
constexpr double kAzimuth_deg = 84, kElevation_deg = 18, kStep_deg = 6;

/// A guess of how the scene stands to the map: p_map = scale * turn * p_scene, and the poses to it.
struct Placement {
  double scene_scale = 1;
  bool y_up = false;
  double pose_scale = 1;
  std::string advice;

  Eigen::Matrix3d turn() const { return y_up ? uprightFromYUp() : Eigen::Matrix3d::Identity(); }
};

const std::vector<Placement>& guesses() {
  static const std::vector<Placement> all = [] {
    std::vector<Placement> list;
    const std::vector<std::pair<double, std::string>> units = {
        {1e-3, "mm"}, {1e-2, "cm"}, {0.0254, "in"}, {0.3048, "ft"}};
    list.push_back({1, true, 1, "the scene's y axis points up: write up: y in scene.yaml's entries of meshes"});
    for (const auto& [unit_m, name] : units) {
      std::ostringstream text;
      text << "the scene is in " << name << " (scale " << unit_m << "): write unit: " << name
           << " in scene.yaml's entries of meshes";
      list.push_back({unit_m, false, 1, text.str()});
      list.push_back({unit_m, true, 1, text.str() + ", and up: y"});
    }
    // A unit that is too small puts all poses into a corner of the room, where they fit too: the metric ones from
    // above.
    for (const auto& [unit_m, name] : {units[1], units[0], units[2], units[3]}) {
      list.push_back({1, false, unit_m, "the poses are in " + name + ": give x, y and z in metres"});
    }
    list.push_back(
        {1000, false, 1, "the scene is in km (scale 1000): write scale: 1000 in scene.yaml's entries of meshes"});
    return list;
  }();
  return all;
}

bool isMetric(const Placement& guess) { return guess.scene_scale == 1e-3 || guess.scene_scale == 1e-2; }

Eigen::AlignedBox3d boundsOf(const Scene& scene) {
  Eigen::AlignedBox3d bounds;
  for (const Actor& actor : scene.actors) bounds.extend(actor.bounds);
  return bounds;
}

/// What radars see of a scene under guesses of its placement.
class Views {
 public:
  Views(const Scene& scene, const RadarConfig& radar, const std::vector<Eigen::Isometry3d>& poses)
      : scene_(scene), rays_(scene), bounds_(boundsOf(scene)), reach_m_(radar.max_range_m()), poses_(poses) {}

  /// Share of poses from which anything upright is seen, and share that stands within the scene.
  std::pair<double, double> shares(const Placement& placement) const {
    int seeing = 0, within = 0;
    for (const Eigen::Isometry3d& T : poses_) {
      seeing += sees(T, placement);
      within += stands(T, placement);
    }
    const double n = std::max<double>(1, static_cast<double>(poses_.size()));
    return {seeing / n, within / n};
  }

 private:
  Eigen::Vector3d eye(const Eigen::Isometry3d& T, const Placement& p) const {
    return p.turn().transpose() * (p.pose_scale * T.translation()) / p.scene_scale;
  }

  bool stands(const Eigen::Isometry3d& T, const Placement& p) const {
    const Eigen::Vector3d at = eye(T, p);
    if (p.pose_scale != 1 && at.z() < bounds_.min().z() + kLeastHeight_m) return false;
    return bounds_.exteriorDistance(at) * p.scene_scale <= kBeside_m;
  }

  bool sees(const Eigen::Isometry3d& T, const Placement& p) const {
    const Eigen::Vector3d from = eye(T, p);
    if (!from.allFinite() || bounds_.exteriorDistance(from) * p.scene_scale > reach_m_) return false;
    for (double azimuth = -kAzimuth_deg; azimuth <= kAzimuth_deg; azimuth += kStep_deg) {
      for (double elevation = -kElevation_deg; elevation <= kElevation_deg; elevation += kStep_deg) {
        const double a = azimuth * M_PI / 180, e = elevation * M_PI / 180;
        const Eigen::Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
        const Eigen::Vector3d way = p.turn().transpose() * (T.linear() * ray);
        const auto hit = rays_.firstHit(from, way, reach_m_ / p.scene_scale);
        if (!hit || hit->facet < 0) continue;
        const Eigen::Vector3d normal = p.turn() * scene_.facets[static_cast<std::size_t>(hit->facet)].normal;
        if (std::abs(normal.z()) < std::sqrt(0.5)) return true;
      }
    }
    return false;
  }

  const Scene& scene_;
  const RayCaster rays_;
  const Eigen::AlignedBox3d bounds_;
  const double reach_m_;
  const std::vector<Eigen::Isometry3d>& poses_;
};

std::string sizeText(const Eigen::AlignedBox3d& bounds) {
  std::ostringstream text;
  text.precision(3);
  const Eigen::Vector3d size = bounds.sizes();
  for (int i = 0; i < 3; ++i) text << (i ? " x " : "") << (size[i] < 1000 ? size[i] : std::round(size[i] / 10) * 10);
  text << " m";
  return text.str();
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(value < 1000 ? 3 : 9);
  text << (value < 1000 ? value : std::round(value));
  return text.str();
}

/// Greatest distance between poses along an axis.
double spread_m(const std::vector<Eigen::Isometry3d>& poses) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Isometry3d& T : poses) box.extend(T.translation());
  return poses.empty() ? 0 : box.sizes().maxCoeff();
}

/// The advice for a scene that lies apart from the poses as a whole.
std::optional<std::string> originOf(const Scene& scene, const std::vector<Eigen::Isometry3d>& poses) {
  const Eigen::AlignedBox3d bounds = boundsOf(scene);
  Eigen::AlignedBox3d radars;
  for (const Eigen::Isometry3d& T : poses) radars.extend(T.translation());
  const double apart_m = std::sqrt(bounds.squaredExteriorDistance(radars));
  if (poses.empty() || apart_m < kFarOrigin_m || apart_m < bounds.diagonal().norm()) return std::nullopt;
  if (bounds.center().norm() > radars.center().norm()) {
    return "the scene lies " + number(apart_m) + " m from the poses: take its origin off" + originAdvice(bounds.min());
  }
  return "the poses lie " + number(apart_m) + " m from the scene: take the map's origin off x, y and z of the poses";
}

/// "" where a scene's size is no reason to doubt its unit: the largest halls are some 110 m high, and a room in
/// centimetres is 150 m and more, with all radars in one corner.
std::string sizeDoubt(const Scene& scene, const RadarConfig& radar, const std::vector<Eigen::Isometry3d>& poses) {
  const Eigen::AlignedBox3d bounds = boundsOf(scene);
  for (const Placement& guess : guesses()) {
    if (!isMetric(guess) || guess.scene_scale * bounds.sizes().minCoeff() < kLeastRoom_m) continue;
    const auto [seeing, within] = Views(scene, radar, poses).shares(guess);
    if (within < 1 || seeing < kShareOfPoses) continue;
    return "the scene is " + sizeText(bounds) + ", the poses lie within " + number(spread_m(poses)) +
           " m; they fit if " + guess.advice;
  }
  return "";
}

std::vector<Eigen::Isometry3d> placesOf(const std::vector<Pose>& poses) {
  std::vector<Eigen::Isometry3d> places;
  for (const Pose& pose : poses) places.push_back(pose.T_map_radar);
  return places;
}

/// What is wrong between scene and poses by their sizes and places alone; "" where nothing is.
std::string misplaced(const Scene& scene, const RadarConfig& radar, const std::vector<Pose>& poses) {
  const std::vector<Eigen::Isometry3d> places = placesOf(poses);
  const Eigen::AlignedBox3d bounds = boundsOf(scene);
  const double limit_m = std::max(radar.max_range_m(), 2 * bounds.diagonal().norm());
  for (const Pose& pose : poses) {
    const double outside_m = bounds.exteriorDistance(pose.T_map_radar.translation());
    if (!(outside_m > limit_m)) continue;
    return "pose '" + pose.name + "' stands " + number(outside_m) + " m outside the scene, which is " +
           sizeText(bounds) + "; poses are in metres in the scene's map, z up: " +
           placementAdvice(scene, radar, places).value_or("check units, axes and origin");
  }
  return sizeDoubt(scene, radar, places);
}

}  // namespace

std::optional<std::string> placementAdvice(const Scene& scene, const RadarConfig& radar,
                                           const std::vector<Eigen::Isometry3d>& poses) {
  const Views views(scene, radar, poses);
  const Placement* best = nullptr;
  double best_within = -1;
  for (const Placement& guess : guesses()) {
    const auto [seeing, within] = views.shares(guess);
    if (seeing < kShareOfPoses || within <= best_within) continue;
    // Any poses come near by some scale. A part of a room may be in mm or cm, with the radars outside of it.
    const bool part = guess.pose_scale == 1 && (guess.scene_scale == 1 || isMetric(guess));
    if (!part && within < kShareOfPoses) continue;
    if (guess.scene_scale > 1 && boundsOf(scene).diagonal().norm() > kLargestInKm) continue;
    best = &guess;
    best_within = within;
  }
  if (best) return "they fit if " + best->advice;
  return originOf(scene, poses);
}

void requirePlaced(const Twin& twin, const std::vector<Pose>& poses, const std::string& source) {
  const std::string wrong = misplaced(twin.scene(), twin.radar(), poses);
  if (!wrong.empty()) throw InputError(source + ": " + wrong);
  bool traced = false;
  for (const Pose& pose : poses) {
    try {
      if (!twin.trace(pose.T_map_radar, pose.stamp_ns).empty()) return;
      traced = true;
    } catch (const InputError&) {
      // A pose inside something is reported where it is used.
    }
  }
  if (!traced) return;
  throw InputError(source + ": the twin has no echo at any pose; poses and scene " + twin.scene().file +
                   " share one map, in metres, z up: " +
                   placementAdvice(twin.scene(), twin.radar(), placesOf(poses))
                       .value_or("check units, axes and origin, and where the radar looks"));
}

Twin twinAt(const TwinDescription& description, const std::vector<Pose>& poses, const std::string& source,
            std::uint64_t seed) {
  try {
    Twin twin(description, seed);
    twin.setSession(poses);
    return twin;
  } catch (const InputError&) {
    // A scene in millimetres has too many scatter points, say. The scene's own errors come again here.
    const Scene scene = loadScene(description.scene_file, description.radar.center_frequency_hz());
    const std::string wrong = misplaced(scene, description.radar, poses);
    if (!wrong.empty()) throw InputError(source + ": " + wrong);
    throw;
  }
}

Twin placedTwin(const TwinDescription& description, const std::vector<Pose>& poses, const std::string& source,
                std::uint64_t seed) {
  Twin twin = twinAt(description, poses, source, seed);
  requirePlaced(twin, poses, source);
  return twin;
}

}  // namespace mmradartwin
