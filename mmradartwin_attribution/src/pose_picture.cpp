#include "mmradartwin_attribution/pose_picture.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

const cv::Scalar kWhite(255, 255, 255), kMagenta(255, 0, 255), kInk(40, 40, 40), kSoft(120, 120, 120),
    kStation(178, 114, 0);
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr int kFanHeight_px = 470;
constexpr int kSmallFanHeight_px = 420;
constexpr double kSmallFanLetters = 2;

std::string format(const char* pattern, double a, double b = 0, double c = 0) {
  char text[160];
  std::snprintf(text, sizeof text, pattern, a, b, c);
  return text;
}

// "bookshelf;wall_west" -> "bookshelf+wall_west": shorter and without the list separator of the files.
std::string spoken(std::string actor) {
  std::replace(actor.begin(), actor.end(), ';', '+');
  return actor;
}

// Keeps labels from covering one another: a label is dropped where an earlier one of the panel stands.
class LabelSpace {
 public:
  explicit LabelSpace(double max_range_m) : unit_m_(max_range_m / 10) {}
  std::string take(const FanBox& box, const std::string& label) {
    // Sizes as the fan draws them, in metres: some 0.14 m a letter and 0.3 m high on a fan of 10 m.
    const double far_m = box.range_m + box.half_range_m;
    const double x = far_m * std::sin(box.azimuth_rad), y = far_m * std::cos(box.azimuth_rad);
    const double half_width = 0.075 * unit_m_ * static_cast<double>(label.size());
    const double height = 0.32 * unit_m_;
    for (const cv::Rect2d& r : taken_) {
      if (x - half_width < r.x + r.width && x + half_width > r.x && y < r.y + r.height && y + height > r.y) return "";
    }
    taken_.emplace_back(x - half_width, y, 2 * half_width, height);
    return label;
  }

 private:
  double unit_m_;
  std::vector<cv::Rect2d> taken_;
};

std::vector<FanBox> boxes(const EvaluationField& field, const PoseAttribution& pose, bool measured,
                          double max_range_m) {
  std::vector<FanBox> result;
  LabelSpace labels(max_range_m);
  const MatchWindow& tight = field.config().tight;
  const auto add = [&](double range_m, double azimuth_rad, const cv::Scalar& color, const std::string& label) {
    FanBox box{range_m, azimuth_rad, field.halfRange_m(tight), field.halfAzimuth_rad(tight, azimuth_rad), color, ""};
    box.label = labels.take(box, label);
    result.push_back(box);
  };
  for (const Residual& r : pose.residuals) {
    if (r.measured_stronger != measured) continue;
    add(r.range_m, r.azimuth_rad, kMagenta,
        className(r.residual_class) + (r.actor.empty() ? "" : " " + spoken(r.actor)));
  }
  for (const ResponseRegion& r : pose.regions) {
    if (r.field == Field::kCentral && r.measured_strong && r.simulated_strong) {
      add(r.range_m, r.azimuth_rad, kWhite, spoken(r.actor));
    }
  }
  // A label stands beyond its box: nearer ones are drawn over farther boxes.
  std::stable_sort(result.begin(), result.end(),
                   [](const FanBox& a, const FanBox& b) { return a.range_m > b.range_m; });
  return result;
}

void put(cv::Mat& picture, const std::string& words, int x, int y, double size, const cv::Scalar& color) {
  cv::putText(picture, words, {x, y}, kFont, size, color, 1, cv::LINE_AA);
}

// One line of the list; "" where the residual is not to be shown.
std::string describe(const Residual& r) {
  std::string line = className(r.residual_class) + " " + classLabel(r.residual_class) + ": " +
                     (r.actor.empty() ? "at no expected region" : spoken(r.actor));
  if (!r.material.empty()) line += " (" + spoken(r.material) + ")";
  line += format(", %.2f m, %+.0f deg: measured %.1f", r.range_m, r.azimuth_rad / kDegree, r.measured_db);
  return line + format(" dB, simulated %.1f dB", r.simulated_db);
}

/// A triangle of the scene as the coverage picture shows it.
struct CoverageTriangle {
  std::array<Eigen::Vector3d, 3> corner;
  double height;  ///< of its highest corner, map
  bool upright;
  cv::Scalar color;
};

/// Materials of a scene with their colours, in order of appearance.
using Legend = std::vector<std::pair<std::string, cv::Scalar>>;

/// The scene from above: x to the right, y up, with a margin for names and a column for the legend.
class CoverageView {
 public:
  static constexpr int kMargin_px = 46, kLegend_px = 190;

  explicit CoverageView(const Eigen::AlignedBox2d& bounds)
      : bounds_(bounds),
        size_m_(bounds.sizes().cwiseMax(0.5)),
        px_per_m_(std::min(900.0 / size_m_.x(), 700.0 / size_m_.y())),
        picture_(cvRound(size_m_.y() * px_per_m_) + 2 * kMargin_px + 24,
                 cvRound(size_m_.x() * px_per_m_) + 2 * kMargin_px + kLegend_px, CV_8UC3, kWhite) {}

  void drawSurfaces(std::vector<CoverageTriangle> triangles) {
    std::stable_sort(triangles.begin(), triangles.end(),
                     [](const CoverageTriangle& a, const CoverageTriangle& b) { return a.height < b.height; });
    for (const CoverageTriangle& t : triangles) {
      std::vector<cv::Point> corners;
      for (const Eigen::Vector3d& v : t.corner) corners.push_back(fine(v.head<2>()));
      // An upright surface is a line from above: drawn as one, darker.
      if (t.upright) {
        cv::polylines(picture_, corners, true, t.color * 0.7, 3, cv::LINE_AA, kShift);
      } else {
        cv::fillConvexPoly(picture_, corners, t.color * 0.35 + cv::Scalar(255, 255, 255) * 0.65, cv::LINE_AA, kShift);
      }
    }
  }

  /// Names of what stands in the room; surfaces as large as the room itself go without.
  void drawNames(const Scene& scene, double cut_height_m) {
    for (const Actor& actor : scene.actors) {
      const Eigen::Vector3d extent = actor.bounds.sizes();
      if (extent.head<2>().maxCoeff() > 0.6 * size_m_.maxCoeff() || actor.bounds.min().z() > cut_height_m) continue;
      int baseline = 0;
      const cv::Size words = cv::getTextSize(actor.name, kFont, 0.36, 1, &baseline);
      const cv::Point2d p = at(actor.bounds.center().head<2>());
      put(picture_, actor.name, cvRound(p.x) - words.width / 2, cvRound(p.y) + 4, 0.36, kSoft);
    }
  }

  void drawStations(const std::vector<Pose>& poses) {
    std::vector<std::string> locations;
    for (const Pose& pose : poses) {
      const Eigen::Vector2d p = pose.T_map_radar.translation().head<2>();
      const Eigen::Vector2d heading = pose.T_map_radar.linear().col(0).head<2>();
      if (heading.norm() > 1e-6) {
        cv::arrowedLine(picture_, at(p), at(p + 0.42 * heading.normalized()), kStation, 1, cv::LINE_AA, 0, 0.25);
      }
    }
    for (const Pose& pose : poses) {
      if (std::find(locations.begin(), locations.end(), pose.location) != locations.end()) continue;
      locations.push_back(pose.location);
      const cv::Point2d p = at(pose.T_map_radar.translation().head<2>());
      cv::circle(picture_, p, 6, kStation, cv::FILLED, cv::LINE_AA);
      cv::circle(picture_, p, 6, kWhite, 1, cv::LINE_AA);
      put(picture_, pose.location, cvRound(p.x) + 9, cvRound(p.y) - 8, 0.42, kInk);
    }
    put(picture_,
        format("coverage: %.0f poses at %.0f locations", static_cast<double>(poses.size()),
               static_cast<double>(locations.size())),
        kMargin_px, 26, 0.6, kInk);
  }

  void drawLegend(const Legend& legend) {
    const int x = picture_.cols - kLegend_px + 6;
    int y = kMargin_px + 8;
    for (const auto& [name, color] : legend) {
      cv::rectangle(picture_, {x, y - 10}, {x + 14, y + 2}, color, cv::FILLED);
      cv::rectangle(picture_, {x, y - 10}, {x + 14, y + 2}, kInk, 1);
      put(picture_, name, x + 22, y, 0.45, kInk);
      y += 20;
    }
    cv::circle(picture_, {x + 7, y - 4}, 6, kStation, cv::FILLED, cv::LINE_AA);
    put(picture_, "radar, heading", x + 22, y, 0.45, kInk);
    const int bar = picture_.rows - 22, metre = cvRound(px_per_m_);
    cv::line(picture_, {kMargin_px, bar}, {kMargin_px + metre, bar}, kInk, 2);
    put(picture_, "1 m   (x to the right, y up, map)", kMargin_px + metre + 8, bar + 5, 0.45, kInk);
  }

  const cv::Mat& picture() const { return picture_; }

 private:
  static constexpr int kShift = 4;  ///< of fine(): 1/16 pixel
  cv::Point2d at(const Eigen::Vector2d& p_m) const {
    return {kMargin_px + (p_m.x() - bounds_.min().x()) * px_per_m_,
            kMargin_px + (bounds_.max().y() - p_m.y()) * px_per_m_};
  }
  cv::Point fine(const Eigen::Vector2d& p_m) const {
    const cv::Point2d q = at(p_m);
    return cv::Point(cvRound(q.x * (1 << kShift)), cvRound(q.y * (1 << kShift)));
  }

  Eigen::AlignedBox2d bounds_;
  Eigen::Vector2d size_m_;
  double px_per_m_;
  cv::Mat picture_;
};

/// Surfaces below the cut and upright ones; bounds grows by all of the scene.
std::vector<CoverageTriangle> coverageTriangles(const Scene& scene, double cut_height_m, Legend& legend,
                                                Eigen::AlignedBox2d& bounds) {
  std::vector<CoverageTriangle> triangles;
  for (const Actor& actor : scene.actors) {
    const auto& c = actor.material.color;
    const cv::Scalar color(255 * c[2], 255 * c[1], 255 * c[0]);
    const bool listed =
        std::any_of(legend.begin(), legend.end(), [&](const auto& l) { return l.first == actor.material_tag; });
    if (!listed) legend.emplace_back(actor.material_tag, color);
    for (const auto& t : actor.triangles) {
      CoverageTriangle triangle{{actor.vertices[t[0]], actor.vertices[t[1]], actor.vertices[t[2]]}, 0, false, color};
      const Eigen::Vector3d n =
          (triangle.corner[1] - triangle.corner[0]).cross(triangle.corner[2] - triangle.corner[0]).normalized();
      triangle.upright = std::abs(n.z()) < std::sqrt(0.5);
      triangle.height = std::max({triangle.corner[0].z(), triangle.corner[1].z(), triangle.corner[2].z()});
      for (const Eigen::Vector3d& v : triangle.corner) bounds.extend(v.head<2>());
      if (!triangle.upright && triangle.height > cut_height_m) continue;
      triangles.push_back(triangle);
    }
  }
  return triangles;
}

}  // namespace

cv::Scalar classColor_bgr(ResidualClass c) {
  static const cv::Scalar colors[] = {{0, 94, 213}, {0, 159, 230}, {167, 121, 204}, {233, 180, 86}, {115, 158, 0}};
  return colors[static_cast<int>(c) - 1];
}

double shownRange_m(const EvaluationField& field, const PoseResult& result) {
  const PoseAttribution& pose = result.attribution;
  double last = 0;
  for (const NormalisedMap* map : {&pose.measured, &pose.simulated}) {
    for (const Response& r : map->responses) {
      if (r.level_db >= field.config().weak_db) last = std::max(last, r.range_m);
    }
  }
  for (const ResponseRegion& r : pose.regions) {
    if (r.measured_strong) last = std::max(last, r.range_m);
  }
  return std::clamp(std::ceil(last + 1), 4.0, std::max(4.0, std::ceil(field.axes().range_m.back())));
}

cv::Mat drawPose(const EvaluationField& field, const PoseResult& result) {
  const PoseAttribution& pose = result.attribution;
  FanStyle style;
  style.min_db = field.config().floor_db;
  style.height_px = kFanHeight_px;
  style.max_range_m = shownRange_m(field, result);
  style.title = "measured";
  const cv::Mat measured =
      drawFan(field.axes(), pose.measured.level_db, style, boxes(field, pose, true, style.max_range_m));
  style.title = "simulated";
  const cv::Mat simulated =
      drawFan(field.axes(), pose.simulated.level_db, style, boxes(field, pose, false, style.max_range_m));
  style.title = "residual: simulated - measured";
  style.diverging = true;
  style.min_db = -30;
  style.max_db = 30;
  const cv::Mat residual = drawFan(field.axes(), pose.residual_db, style);

  constexpr int kHead = 34, kLine = 20, kMaxLines = 8;
  const int shown = std::min<int>(kMaxLines, static_cast<int>(pose.residuals.size()));
  const int lines = shown + (static_cast<int>(pose.residuals.size()) > shown ? 1 : 0) + 1;
  cv::Mat picture(kHead + kFanHeight_px + lines * kLine + 12, measured.cols * 3, CV_8UC3, kWhite);
  measured.copyTo(picture(cv::Rect(0, kHead, measured.cols, kFanHeight_px)));
  simulated.copyTo(picture(cv::Rect(measured.cols, kHead, simulated.cols, kFanHeight_px)));
  residual.copyTo(picture(cv::Rect(measured.cols * 2, kHead, residual.cols, kFanHeight_px)));

  const Eigen::Vector3d p = result.pose.T_map_radar.translation();
  const Eigen::Vector3d x = result.pose.T_map_radar.linear().col(0);
  put(picture,
      "pose " + result.pose.name + ", location " + result.pose.location +
          format(": radar at %.2f, %.2f, %.2f m", p.x(), p.y(), p.z()) +
          format(", heading %+.1f deg", std::atan2(x.y(), x.x()) / kDegree),
      14, 23, 0.6, kInk);
  int y = kHead + kFanHeight_px + 10;
  int matched = 0, active = 0;
  for (const ResponseRegion& r : pose.regions) {
    if (r.field != Field::kCentral || !r.measured_strong) continue;
    ++active;
    matched += r.simulated_strong;
  }
  put(picture,
      std::to_string(matched) + " of " + std::to_string(active) + " measured expected regions matched (white); " +
          std::to_string(pose.residuals.size()) + " residuals (magenta)",
      14, y, 0.45, kInk);
  for (int i = 0; i < shown; ++i) {
    y += kLine;
    cv::rectangle(picture, {14, y - 9}, {24, y + 1}, classColor_bgr(pose.residuals[i].residual_class), cv::FILLED);
    put(picture, describe(pose.residuals[i]), 32, y, 0.45, kInk);
  }
  if (static_cast<int>(pose.residuals.size()) > shown) {
    put(picture, "and " + std::to_string(pose.residuals.size() - shown) + " more in residuals.csv", 32, y + kLine, 0.45,
        kSoft);
  }
  return picture;
}

std::array<cv::Mat, 3> drawPoseFans(const EvaluationField& field, const PoseResult& result,
                                    const PoseFanStyle& fan_style) {
  const PoseAttribution& pose = result.attribution;
  std::array<std::vector<FanBox>, 3> boxes_of;  // of matches, then of residuals: these are drawn over those
  const MatchWindow& tight = field.config().tight;
  const auto box = [&](double range_m, double azimuth_rad, const cv::Scalar& color, const std::string& label) {
    return FanBox{range_m, azimuth_rad, field.halfRange_m(tight), field.halfAzimuth_rad(tight, azimuth_rad),
                  color,   label};
  };
  for (const ResponseRegion& r : pose.regions) {
    if (r.field != Field::kCentral || !r.measured_strong || !r.simulated_strong) continue;
    for (std::size_t fan : {0U, 1U}) boxes_of[fan].push_back(box(r.range_m, r.azimuth_rad, kWhite, ""));
  }
  for (std::size_t i = 0; i < pose.residuals.size(); ++i) {
    const Residual& r = pose.residuals[i];
    const std::string number = fan_style.numbers ? std::to_string(i + 1) : "";
    boxes_of[r.measured_stronger ? 0 : 1].push_back(box(r.range_m, r.azimuth_rad, kMagenta, number));
    boxes_of[2].push_back(box(r.range_m, r.azimuth_rad, kInk, number));
  }
  FanStyle style;
  style.height_px = kSmallFanHeight_px;
  style.letters = kSmallFanLetters;
  style.min_db = field.config().floor_db;
  style.max_range_m = fan_style.range_m > 0 ? fan_style.range_m : shownRange_m(field, result);
  std::array<cv::Mat, 3> fans;
  fans[0] = drawFan(field.axes(), pose.measured.level_db, style, boxes_of[0]);
  fans[1] = drawFan(field.axes(), pose.simulated.level_db, style, boxes_of[1]);
  style.diverging = true;
  style.min_db = -30;
  style.max_db = 30;
  fans[2] = drawFan(field.axes(), pose.residual_db, style, boxes_of[2]);
  return fans;
}

cv::Mat drawCoverage(const Scene& scene, const std::vector<Pose>& poses, double cut_height_m) {
  Legend legend;
  Eigen::AlignedBox2d bounds;
  const std::vector<CoverageTriangle> triangles = coverageTriangles(scene, cut_height_m, legend, bounds);
  for (const Pose& pose : poses) bounds.extend(Eigen::Vector2d(pose.T_map_radar.translation().head<2>()));
  if (bounds.isEmpty()) {
    return cv::Mat(2 * CoverageView::kMargin_px, 2 * CoverageView::kMargin_px, CV_8UC3, kWhite);
  }
  CoverageView view(bounds);
  view.drawSurfaces(triangles);
  view.drawNames(scene, cut_height_m);
  view.drawStations(poses);
  view.drawLegend(legend);
  return view.picture();
}

}  // namespace mmradartwin
