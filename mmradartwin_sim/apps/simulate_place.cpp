#include "simulate_place.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"
#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr double kNear_m = 0.20;       ///< a surface this near is no place to stand by accident
constexpr double kCutHeight_m = 2.0;   ///< horizontal surfaces above are left out of the picture: a ceiling
constexpr double kShownBelow_db = 40;  ///< paths this far below the strongest are not drawn
constexpr std::size_t kMostPaths = 200;

/// Distance from a point to a triangle, by its nearest point (Ericson, Real-Time Collision Detection, 5.1.5).
double distanceToTriangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                          const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d1 <= 0 && d2 <= 0) return ap.norm();
  if (d3 >= 0 && d4 <= d3) return bp.norm();
  if (d6 >= 0 && d5 <= d6) return cp.norm();
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return (ap - d1 / (d1 - d3) * ab).norm();
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return (ap - d2 / (d2 - d6) * ac).norm();
  if (va <= 0 && d4 >= d3 && d5 >= d6) return (bp - (d4 - d3) / (d4 - d3 + d5 - d6) * (c - b)).norm();
  const double sum = va + vb + vc;
  return sum > 0 ? (ap - vb / sum * ab - vc / sum * ac).norm() : std::numeric_limits<double>::infinity();
}

/// The actor whose surface is nearest to a point, and how far it is.
std::pair<const Actor*, double> nearestSurface(const Scene& scene, const Eigen::Vector3d& point) {
  std::pair<const Actor*, double> nearest{nullptr, std::numeric_limits<double>::infinity()};
  for (const Actor& actor : scene.actors) {
    if (!actor.present || actor.bounds.exteriorDistance(point) >= nearest.second) continue;
    for (const auto& t : actor.triangles) {
      const auto corner = [&](std::size_t i) { return actor.vertices[static_cast<std::size_t>(t[i])]; };
      const double distance = distanceToTriangle(point, corner(0), corner(1), corner(2));
      if (distance < nearest.second) nearest = {&actor, distance};
    }
  }
  return nearest;
}

/// The scene from above: x to the right, y up.
class RoomPicture {
 public:
  explicit RoomPicture(const Eigen::AlignedBox2d& bounds)
      : bounds_(bounds),
        px_per_m_(
            std::min(kWidth_px / std::max(0.5, bounds.sizes().x()), kHeight_px / std::max(0.5, bounds.sizes().y()))),
        picture_(cvRound(bounds.sizes().y() * px_per_m_) + 2 * kMargin_px,
                 cvRound(bounds.sizes().x() * px_per_m_) + 2 * kMargin_px, CV_8UC3, cv::Scalar::all(255)) {}

  void drawScene(const Scene& scene) {
    for (const Actor& actor : scene.actors) {
      if (!actor.present) continue;
      const auto& c = actor.material.color;
      const cv::Scalar color(255 * c[2], 255 * c[1], 255 * c[0]);
      for (const auto& t : actor.triangles) drawTriangle(actor, t, color);
    }
  }
  /// From the radar over the path's points and back to the radar; the stronger, the darker.
  void drawPath(const PathRecord& path, const Eigen::Vector3d& radar, double below_db) {
    const double light = std::min(1.0, std::max(0.0, below_db / kShownBelow_db));
    const cv::Scalar color(60 + 170 * light, 60 + 170 * light, 220);
    Eigen::Vector3d from = radar;
    for (const Eigen::Vector3d& to : path.vertices) {
      cv::line(picture_, at(from), at(to), color, 1, cv::LINE_AA, kShift);
      from = to;
    }
    cv::line(picture_, at(from), at(radar), color, 1, cv::LINE_AA, kShift);
  }
  void drawRadar(const Eigen::Isometry3d& T_map_radar) {
    const Eigen::Vector3d p = T_map_radar.translation(), tip = p + 0.4 * T_map_radar.linear().col(0);
    const cv::Scalar blue(178, 114, 0);
    cv::circle(picture_, at(p), 6 << kShift, blue, cv::FILLED, cv::LINE_AA, kShift);
    cv::arrowedLine(picture_, whole(p), whole(tip), blue, 2, cv::LINE_AA, 0, 0.3);
  }
  void write(const std::string& words, int line) {
    cv::putText(picture_, words, {kMargin_px, 18 + 18 * line}, cv::FONT_HERSHEY_SIMPLEX, 0.45, cv::Scalar::all(40), 1,
                cv::LINE_AA);
  }
  void drawScale() {
    const int y = picture_.rows - 14, metre = cvRound(px_per_m_);
    cv::line(picture_, {kMargin_px, y}, {kMargin_px + metre, y}, cv::Scalar::all(40), 2);
    cv::putText(picture_, "1 m  (x to the right, y up, map)", {kMargin_px + metre + 8, y + 5}, cv::FONT_HERSHEY_SIMPLEX,
                0.45, cv::Scalar::all(40), 1, cv::LINE_AA);
  }
  const cv::Mat& picture() const { return picture_; }

 private:
  static constexpr int kMargin_px = 46, kShift = 4;
  static constexpr double kWidth_px = 900, kHeight_px = 700;

  void drawTriangle(const Actor& actor, const std::array<int, 3>& t, const cv::Scalar& color) {
    std::array<Eigen::Vector3d, 3> corner;
    for (std::size_t i = 0; i < 3; ++i) corner[i] = actor.vertices[static_cast<std::size_t>(t[i])];
    const Eigen::Vector3d n = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    const bool upright = std::abs(n.z()) < std::sqrt(0.5);
    if (!upright && std::max({corner[0].z(), corner[1].z(), corner[2].z()}) > kCutHeight_m) return;
    const std::vector<cv::Point> points = {at(corner[0]), at(corner[1]), at(corner[2])};
    if (upright) {
      cv::polylines(picture_, points, true, color * 0.7, 2, cv::LINE_AA, kShift);
    } else {
      cv::fillConvexPoly(picture_, points, color * 0.35 + cv::Scalar::all(165), cv::LINE_AA, kShift);
    }
  }
  cv::Point2d place(const Eigen::Vector3d& p_m) const {
    return {kMargin_px + (p_m.x() - bounds_.min().x()) * px_per_m_,
            kMargin_px + (bounds_.max().y() - p_m.y()) * px_per_m_};
  }
  cv::Point at(const Eigen::Vector3d& p_m) const {
    const cv::Point2d p = place(p_m);
    return {cvRound(p.x * (1 << kShift)), cvRound(p.y * (1 << kShift))};
  }
  cv::Point whole(const Eigen::Vector3d& p_m) const {
    const cv::Point2d p = place(p_m);
    return {cvRound(p.x), cvRound(p.y)};
  }

  Eigen::AlignedBox2d bounds_;
  double px_per_m_;
  cv::Mat picture_;
};

cv::Mat drawRoom(const Twin& twin, const Simulation& s, const std::string& title) {
  Eigen::AlignedBox2d bounds;
  for (const Actor& actor : twin.scene().actors) {
    for (const Eigen::Vector3d& v : actor.vertices) bounds.extend(Eigen::Vector2d(v.head<2>()));
  }
  const Eigen::Vector3d radar = s.T_map_radar.translation();
  bounds.extend(Eigen::Vector2d(radar.head<2>()));
  RoomPicture room(bounds);
  room.drawScene(twin.scene());
  std::vector<const PathRecord*> paths;
  for (const PathRecord& record : s.records) {
    if (!record.vertices.empty() && record.amplitude > 0) paths.push_back(&record);
  }
  std::sort(paths.begin(), paths.end(), [](const auto* a, const auto* b) { return a->amplitude > b->amplitude; });
  if (paths.size() > kMostPaths) paths.resize(kMostPaths);
  for (auto path = paths.rbegin(); path != paths.rend(); ++path) {  // the strongest last, on top
    const double below_db = 20 * std::log10(paths.front()->amplitude / (*path)->amplitude);
    if (below_db <= kShownBelow_db) room.drawPath(**path, radar, below_db);
  }
  room.drawRadar(s.T_map_radar);
  room.write(title, 0);
  room.drawScale();
  return room.picture();
}

void writeRequest(const PlaceOptions& options, const TwinDescription& twin, const std::string& file) {
  std::ofstream out(file);
  out << "# One place that was simulated: simulate --at\nscene: " << yamlText(options.scene_file)
      << "\nradar: " << yamlText(fs::absolute(options.radar_file).lexically_normal().string()) << "\nposition_m: ["
      << formatExact(options.position_m.x()) << ", " << formatExact(options.position_m.y()) << ", "
      << formatExact(options.position_m.z()) << "]\nyaw_deg: " << formatExact(options.yaw_deg)
      << "\nseed: " << options.seed << "\n"
      << twin.toYaml().substr(twin.toYaml().find("mechanisms:"));
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

}  // namespace

PlaceResult simulatePlace(const PlaceOptions& options, const std::string& folder) {
  if (!options.position_m.allFinite() || !std::isfinite(options.yaw_deg)) {
    throw InputError("--at: a value is no number; give X Y Z in m and YAW in deg");
  }
  Pose pose;
  pose.name = pose.location = "place";
  pose.T_map_radar = Eigen::Translation3d(options.position_m) *
                     Eigen::AngleAxisd(options.yaw_deg * M_PI / 180, Eigen::Vector3d::UnitZ());
  const TwinDescription description =
      loadTwin(options.twin_file, options.scene_file, loadRadarConfig(options.radar_file));
  Twin twin = placedTwin(description, {pose}, "--at", options.seed);
  twin.prepare({pose.T_map_radar});
  const Simulation s = twin.simulate(pose.T_map_radar);

  PlaceResult result;
  const auto [surface, distance_m] = nearestSurface(twin.scene(), options.position_m);
  if (surface && distance_m < kNear_m) {
    result.warnings.push_back("the radar stands " + fixedNumber(100 * distance_m, 1) + " cm from the surface of " +
                              surface->name);
  }
  const std::vector<PathRecord> records = exportedRecords(twin.radar(), s.records, options.diffuse_records);
  result.paths = records.size();
  const fs::path to(folder);
  writePathsCsv(records, twin.scene(), (to / "paths.csv").string());
  const RangeAngleMap map = SignalChain(twin.radar()).map(s.grid);
  writeMapCsv(map, (to / "map.csv").string());
  const std::string title = "radar at " + fixedNumber(options.position_m.x(), 2) + ", " +
                            fixedNumber(options.position_m.y(), 2) + ", " + fixedNumber(options.position_m.z(), 2) +
                            " m, yaw " + fixedNumber(options.yaw_deg, 1) + " deg";
  FanStyle style;
  style.max_range_m = twin.radar().max_range_m() - twin.radar().range_bin_m() / 2;  // edge of the last bin
  style.title = "simulated, " + title;
  writePicture(drawFan(map.axes, map.power_db, style), (to / "map.png").string());
  writePicture(drawRoom(twin, s, title), (to / "room.png").string());
  writeRequest(options, twin.description(), (to / "place.yaml").string());
  result.notes = twin.notes();
  for (const std::string& note : meshNotes(twin.scene())) result.notes.push_back(note);
  return result;
}

}  // namespace mmradartwin
