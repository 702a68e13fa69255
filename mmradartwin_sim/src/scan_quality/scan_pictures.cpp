#include "scan_quality/scan_pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "mmradartwin_sim/ray_caster.h"
#include "scan_quality/traced_actors.h"

namespace mmradartwin {
namespace {

constexpr int kLetters = cv::FONT_HERSHEY_SIMPLEX;
const cv::Scalar kInk(40, 40, 40), kPaper(255, 255, 255), kFaint(215, 215, 215), kDots(170, 170, 170);

void save(const cv::Mat& picture, const std::string& png) {
  if (!cv::imwrite(png, picture)) throw std::runtime_error(png + " cannot be written; check the free space");
}

void write(cv::Mat& picture, const std::string& text, cv::Point at, double size = 0.45) {
  cv::putText(picture, text, at, kLetters, size, kPaper, 3, cv::LINE_AA);
  cv::putText(picture, text, at, kLetters, size, kInk, 1, cv::LINE_AA);
}

std::string millimetres(double length_m) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1e3 * length_m);
  return text;
}

/// Blue, green, red of an actor: planes by their kind, things each in a colour of its own.
cv::Scalar colorOf(const ScanScene& scene, std::size_t actor) {
  if (actor < scene.planes.size()) {
    switch (scene.planes[actor].kind) {
      case PlaneKind::kFloor:
        return {150, 175, 190};
      case PlaneKind::kCeiling:
        return {220, 220, 220};
      case PlaneKind::kDoor:
        return {60, 105, 160};
      case PlaneKind::kWindow:
        return {215, 190, 120};
      case PlaneKind::kPanel:
        return {150, 130, 105};
      case PlaneKind::kWall:
        break;
    }
    return {200, 195, 180};
  }
  // Hues a golden angle apart, so that neighbours in the list differ.
  const double hue = std::fmod(0.618034 * static_cast<double>(actor - scene.planes.size()), 1.0);
  const auto channel = [hue](double shift) { return 110 + 100 * std::cos(2 * M_PI * (hue - shift)); };
  return {channel(0.667), channel(0.333), channel(0.0)};
}

Eigen::AlignedBox3d boundsOf(const ScanScene& scene) {
  Eigen::AlignedBox3d bounds;
  for (const ScanActor& a : scene.actors) {
    for (const auto& v : a.vertices) bounds.extend(v);
  }
  return bounds;
}

bool isUpright(const ScanPlane& plane) { return std::abs(plane.normal.z()) < std::sqrt(0.5); }

/// A plan: x to the right, y up, a grid of metres.
class Plan {
 public:
  explicit Plan(const ScanScene& scene) : scene_(scene), bounds_(boundsOf(scene)) {
    constexpr double kWidest_px = 1300, kHighest_px = 1000;
    const Eigen::Vector3d size = bounds_.sizes();
    px_per_m_ = std::min(kWidest_px / std::max(size.x(), 1.0), kHighest_px / std::max(size.y(), 1.0));
    picture = cv::Mat(static_cast<int>(size.y() * px_per_m_) + 2 * kMargin_px,
                      static_cast<int>(size.x() * px_per_m_) + 2 * kMargin_px, CV_8UC3, kPaper);
  }

  void drawGrid() {
    for (int x = whole(bounds_.min().x()); x <= bounds_.max().x(); ++x) {
      cv::line(picture, at(x, bounds_.min().y()), at(x, bounds_.max().y()), kFaint);
      write(picture, std::to_string(x), {at(x, 0).x - 4, picture.rows - 15}, 0.4);
    }
    for (int y = whole(bounds_.min().y()); y <= bounds_.max().y(); ++y) {
      cv::line(picture, at(bounds_.min().x(), y), at(bounds_.max().x(), y), kFaint);
      write(picture, std::to_string(y), {12, at(0, y).y + 4}, 0.4);
    }
    write(picture, "x to the right, y up, metres of map", {kMargin_px, 20}, 0.4);
  }

  void drawSamples() {
    const double top = scene_.frame.has_ceiling ? scene_.frame.ceiling_m - 0.2 : 2.2;
    for (std::size_t i = 0; i < scene_.samples.size(); ++i) {
      const Eigen::Vector3f& p = scene_.samples[i];
      if (p.z() < 0.1f || p.z() > top) continue;
      const cv::Point q = at(p.x(), p.y());
      if (!cv::Rect({0, 0}, picture.size()).contains(q)) continue;
      picture.at<cv::Vec3b>(q) = scene_.sample_owner[i] < 0 ? cv::Vec3b(60, 60, 230) : cv::Vec3b(170, 170, 170);
    }
  }

  void drawThings() {
    cv::Mat filled = picture.clone();
    std::vector<std::vector<cv::Point>> outlines;
    for (std::size_t i = 0; i < scene_.things.size(); ++i) {
      std::vector<cv::Point> points, outline;
      for (const auto& v : scene_.things[i].vertices) points.push_back(at(v.x(), v.y()));
      if (points.empty()) continue;
      cv::convexHull(points, outline);
      cv::fillPoly(filled, std::vector<std::vector<cv::Point>>{outline}, colorOf(scene_, scene_.planes.size() + i));
      outlines.push_back(outline);
    }
    cv::addWeighted(filled, 0.5, picture, 0.5, 0, picture);
    cv::polylines(picture, outlines, true, kInk, 1, cv::LINE_AA);
  }

  void drawPlanes() {
    for (std::size_t i = 0; i < scene_.planes.size(); ++i) {
      const ScanPlane& plane = scene_.planes[i];
      if (!isUpright(plane)) continue;
      std::vector<cv::Point> outline;
      for (const auto& p : plane.outline) outline.push_back(atPoint(plane.at(p)));
      const int width = plane.kind == PlaneKind::kWall ? 3 : 5;
      cv::polylines(picture, outline, true, plane.kind == PlaneKind::kWall ? kInk : colorOf(scene_, i), width,
                    cv::LINE_AA);
    }
  }

  void drawNames() {
    for (const ScanPlane& plane : scene_.planes) {
      if (!isUpright(plane)) continue;
      Eigen::AlignedBox3d box;
      for (const auto& p : plane.outline) box.extend(plane.at(p));
      name(plane.name, box.center() + 0.12 * plane.normal);
    }
    // Of very many things the small ones would hide each other's names.
    constexpr std::size_t kMany = 40;
    constexpr double kSmall_m = 0.5;
    for (const ScanThing& thing : scene_.things) {
      const bool small = thing.bounds.sizes().head<2>().maxCoeff() < kSmall_m;
      if (scene_.things.size() < kMany || !small) name(thing.name, thing.bounds.center());
    }
  }

  cv::Mat picture;

 private:
  static constexpr int kMargin_px = 45;

  static int whole(double x) { return static_cast<int>(std::ceil(x)); }
  cv::Point at(double x, double y) const {
    return {kMargin_px + static_cast<int>(std::lround((x - bounds_.min().x()) * px_per_m_)),
            kMargin_px + static_cast<int>(std::lround((bounds_.max().y() - y) * px_per_m_))};
  }
  cv::Point atPoint(const Eigen::Vector3d& p) const { return at(p.x(), p.y()); }

  /// Names do not lie on each other: a later one moves down.
  void name(const std::string& text, const Eigen::Vector3d& place) {
    int base = 0;
    const cv::Size size = cv::getTextSize(text, kLetters, 0.42, 1, &base);
    cv::Point corner = atPoint(place) - cv::Point(size.width / 2, 0);
    corner.x = std::clamp(corner.x, 2, std::max(2, picture.cols - size.width - 2));
    cv::Rect box(corner - cv::Point(0, size.height), size + cv::Size(2, 5));
    const auto taken = [&](const cv::Rect& other) { return (other & box).area() > 0; };
    for (int tries = 0; tries < 30 && std::any_of(names_.begin(), names_.end(), taken); ++tries)
      box.y += size.height + 3;
    names_.push_back(box);
    write(picture, text, {box.x, box.y + size.height}, 0.42);
  }

  const ScanScene& scene_;
  Eigen::AlignedBox3d bounds_;
  double px_per_m_ = 1;
  std::vector<cv::Rect> names_;
};

constexpr double kTileCell_m = 0.04;

/// An upright plane as one sees it from within the room: to the right, and up.
class Elevation {
 public:
  explicit Elevation(const ScanPlane& plane) : plane_(plane) {
    const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(plane.normal).normalized();
    const Eigen::Vector3d up = plane.normal.cross(right);
    turn_ << right.dot(plane.u), right.dot(plane.v), up.dot(plane.u), up.dot(plane.v);
    for (const auto& p : plane.outline) bounds.extend(at(p));
  }

  Eigen::Vector2d at(const Eigen::Vector2d& uv) const { return turn_ * uv; }

  /// Mean residual of cells, the highest first; NaN where the scan has nothing.
  cv::Mat meanResiduals() const {
    const cv::Size size(static_cast<int>(bounds.sizes().x() / kTileCell_m) + 1,
                        static_cast<int>(bounds.sizes().y() / kTileCell_m) + 1);
    cv::Mat sum(size, CV_32F, cv::Scalar(0)), count(size, CV_32F, cv::Scalar(0));
    for (const Eigen::Vector3f& r : plane_.residuals) {
      const Eigen::Vector2d p = at({r.x(), r.y()});
      const int x = static_cast<int>((p.x() - bounds.min().x()) / kTileCell_m);
      const int y = static_cast<int>((bounds.max().y() - p.y()) / kTileCell_m);
      if (x < 0 || y < 0 || x >= size.width || y >= size.height) continue;
      sum.at<float>(y, x) += r.z();
      count.at<float>(y, x) += 1;
    }
    cv::Mat mean(size, CV_32F, cv::Scalar(std::numeric_limits<float>::quiet_NaN()));
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        if (count.at<float>(y, x) > 0) mean.at<float>(y, x) = sum.at<float>(y, x) / count.at<float>(y, x);
      }
    }
    return mean;
  }

  Eigen::AlignedBox2d bounds;

 private:
  const ScanPlane& plane_;
  Eigen::Matrix2d turn_;
};

/// Blue behind the plane, white on it, red before it.
cv::Vec3b diverging(double t) {
  const cv::Vec3d blue(172, 102, 33), white(247, 247, 247), red(43, 24, 178);
  const cv::Vec3d c = white + (t < 0 ? blue - white : red - white) * std::min(std::abs(t), 1.0);
  return {cv::saturate_cast<uchar>(c[0]), cv::saturate_cast<uchar>(c[1]), cv::saturate_cast<uchar>(c[2])};
}

/// One plane's map with its outline, its name and its numbers.
cv::Mat residualTile(const ScanPlane& plane, double limit_m, cv::Size size) {
  constexpr int kHead_px = 46, kSide_px = 10;
  cv::Mat tile(size, CV_8UC3, kPaper);
  const Elevation seen(plane);
  const Eigen::AlignedBox2d& bounds = seen.bounds;
  const cv::Mat mean = seen.meanResiduals();
  const double px_per_m = std::min((size.width - 2.0 * kSide_px) / std::max(bounds.sizes().x(), 0.5),
                                   (size.height - 1.0 * kHead_px - kSide_px) / std::max(bounds.sizes().y(), 0.5));
  const auto at = [&](const Eigen::Vector2d& p) {
    return cv::Point(kSide_px + static_cast<int>((p.x() - bounds.min().x()) * px_per_m),
                     kHead_px + static_cast<int>((bounds.max().y() - p.y()) * px_per_m));
  };
  for (int y = 0; y < mean.rows; ++y) {
    for (int x = 0; x < mean.cols; ++x) {
      const float value = mean.at<float>(y, x);
      const Eigen::Vector2d corner(bounds.min().x() + x * kTileCell_m, bounds.max().y() - y * kTileCell_m);
      const cv::Vec3b color = std::isnan(value) ? cv::Vec3b(214, 214, 214) : diverging(value / limit_m);
      cv::rectangle(tile, at(corner), at(corner + Eigen::Vector2d(kTileCell_m, -kTileCell_m)),
                    cv::Scalar(color[0], color[1], color[2]), cv::FILLED);
    }
  }
  std::vector<std::vector<cv::Point>> loops(1);
  for (const auto& p : plane.outline) loops[0].push_back(at(seen.at(p)));
  for (const auto& hole : plane.holes) {
    loops.emplace_back();
    for (const auto& p : hole) loops.back().push_back(at(seen.at(p)));
  }
  cv::polylines(tile, loops, true, kInk, 1, cv::LINE_AA);
  write(tile, plane.name, {kSide_px, 18}, 0.5);
  write(tile,
        "rms " + millimetres(plane.rms_m) + ", 99 % within " + millimetres(plane.largest_m) + ", bow " +
            millimetres(plane.bow_m),
        {kSide_px, 38}, 0.4);
  return tile;
}

/// Where the picture's eye is, and what it sees.
class Camera {
 public:
  Camera(const Eigen::AlignedBox3d& bounds, cv::Size size) : size_(size) {
    const double turn = -M_PI / 2 - M_PI / 6, rise = 42 * M_PI / 180;
    const Eigen::Vector3d back(std::cos(rise) * std::cos(turn), std::cos(rise) * std::sin(turn), std::sin(rise));
    forward_ = -back;
    right_ = forward_.cross(Eigen::Vector3d::UnitZ()).normalized();
    up_ = right_.cross(forward_);
    place = bounds.center() + 1.3 * bounds.diagonal().norm() * back;
    // As large as fits, with a rim.
    double across = 0, along = 0;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d d = bounds.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i)) - place;
      across = std::max(across, std::abs(d.dot(right_) / d.dot(forward_)));
      along = std::max(along, std::abs(d.dot(up_) / d.dot(forward_)));
    }
    focal_px_ = 0.94 * std::min(size.width / 2.0 / across, size.height / 2.0 / along);
  }

  Eigen::Vector3d ray(int x, int y) const {
    return ((x - size_.width / 2.0) * right_ - (y - size_.height / 2.0) * up_ + focal_px_ * forward_).normalized();
  }
  /// Column, row and distance; behind the eye the distance is negative.
  Eigen::Vector3d project(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d d = p - place;
    const double depth = d.dot(forward_);
    return {size_.width / 2.0 + focal_px_ * d.dot(right_) / depth, size_.height / 2.0 - focal_px_ * d.dot(up_) / depth,
            depth};
  }
  double pixels(double length_m, double depth_m) const { return focal_px_ * length_m / depth_m; }

  Eigen::Vector3d place;

 private:
  cv::Size size_;
  Eigen::Vector3d forward_, right_, up_;
  double focal_px_;
};

/// Seen from behind, or the ceiling: left out so that one looks into the room.
bool isInTheWay(const ScanPlane& plane, const Eigen::Vector3d& direction) {
  return plane.kind == PlaneKind::kCeiling || plane.normal.dot(direction) > 0;
}

bool isInTheWay(const ScanScene& scene, int actor, const Eigen::Vector3d& direction) {
  return actor >= 0 && static_cast<std::size_t>(actor) < scene.planes.size() &&
         isInTheWay(scene.planes[static_cast<std::size_t>(actor)], direction);
}

/// Likewise of a sample that belongs to nothing: beside such a plane, or behind it.
bool isBesideOneInTheWay(const ScanScene& scene, const Eigen::Vector3d& p, const Eigen::Vector3d& direction) {
  constexpr double kBeside_m = 0.15;
  return std::any_of(scene.planes.begin(), scene.planes.end(), [&](const ScanPlane& plane) {
    return isInTheWay(plane, direction) && plane.area_m2 > 1 && plane.normal.dot(p) - plane.offset_m < kBeside_m;
  });
}

cv::Vec3b shaded(const cv::Scalar& color, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d light = Eigen::Vector3d(0.35, -0.5, 0.8).normalized();
  const double bright = 0.55 + 0.45 * std::abs(normal.dot(light));
  return {cv::saturate_cast<uchar>(bright * color[0]), cv::saturate_cast<uchar>(bright * color[1]),
          cv::saturate_cast<uchar>(bright * color[2])};
}

cv::Mat drawScan(const ScanScene& scene, const Camera& camera, const Eigen::AlignedBox3d& bounds, cv::Size size) {
  cv::Mat picture(size, CV_8UC3, kPaper), depth(size, CV_32F, cv::Scalar(1e9));
  for (std::size_t i = 0; i < scene.samples.size(); ++i) {
    const Eigen::Vector3d p = scene.samples[i].cast<double>();
    const int owner = scene.sample_owner[i];
    if (isInTheWay(scene, owner, p - camera.place)) continue;
    if (owner < 0 && isBesideOneInTheWay(scene, p, p - camera.place)) continue;
    if (bounds.exteriorDistance(p) > 1.0) continue;
    const Eigen::Vector3d q = camera.project(p);
    if (q.z() <= 0) continue;
    const int half = std::max(0, static_cast<int>(std::lround(0.6 * camera.pixels(scene.frame.spacing_m, q.z()))));
    const cv::Scalar color = owner < 0 ? cv::Scalar(60, 60, 230) : cv::Scalar(215, 215, 215);
    const cv::Vec3b dot = shaded(color, scene.sample_normals[i].cast<double>());
    for (int y = static_cast<int>(q.y()) - half; y <= static_cast<int>(q.y()) + half; ++y) {
      for (int x = static_cast<int>(q.x()) - half; x <= static_cast<int>(q.x()) + half; ++x) {
        if (x < 0 || y < 0 || x >= size.width || y >= size.height || depth.at<float>(y, x) <= q.z()) continue;
        depth.at<float>(y, x) = static_cast<float>(q.z());
        picture.at<cv::Vec3b>(y, x) = dot;
      }
    }
  }
  return picture;
}

cv::Mat drawScene(const ScanScene& scan, const Camera& camera, cv::Size size) {
  constexpr int kMostLayers = 12;
  cv::Mat picture(size, CV_8UC3, kPaper);
  const Scene scene = tracedActors(scan);
  const RayCaster rays(scene);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const Eigen::Vector3d direction = camera.ray(x, y);
      Eigen::Vector3d from = camera.place;
      for (int layer = 0; layer < kMostLayers; ++layer) {
        const auto hit = rays.firstHit(from, direction, 1000);
        if (!hit || hit->facet < 0) break;
        if (isInTheWay(scan, hit->actor, direction)) {
          from = hit->point + 1e-3 * direction;
          continue;
        }
        picture.at<cv::Vec3b>(y, x) = shaded(colorOf(scan, static_cast<std::size_t>(hit->actor)),
                                             scene.facets[static_cast<std::size_t>(hit->facet)].normal);
        break;
      }
    }
  }
  return picture;
}

}  // namespace

void drawTopView(const ScanScene& scene, const std::string& png) {
  Plan plan(scene);
  plan.drawGrid();
  plan.drawThings();
  plan.drawSamples();
  plan.drawPlanes();
  plan.drawNames();
  save(plan.picture, png);
}

void drawResiduals(const ScanScene& scene, const std::string& png) {
  constexpr int kColumns = 3, kFoot_px = 40;
  constexpr std::size_t kMostTiles = 24;
  std::vector<const ScanPlane*> planes;
  for (const ScanPlane& p : scene.planes) {
    if (isUpright(p) && !p.outline.empty()) planes.push_back(&p);
  }
  std::stable_sort(planes.begin(), planes.end(),
                   [](const ScanPlane* a, const ScanPlane* b) { return a->area_m2 > b->area_m2; });
  if (planes.size() > kMostTiles) planes.resize(kMostTiles);
  // One scale for all: twice the rms of the planes' cells, of 5 mm at least.
  double square = 0, cells = 0;
  for (const ScanPlane* p : planes) {
    const cv::Mat mean = Elevation(*p).meanResiduals();
    for (auto value = mean.begin<float>(); value != mean.end<float>(); ++value) {
      if (std::isnan(*value)) continue;
      square += *value * *value;
      ++cells;
    }
  }
  const double limit_m = std::max(0.005, 1e-3 * std::ceil(2e3 * std::sqrt(square / std::max(cells, 1.0))));
  const cv::Size size(470, 270);
  const int rows = (static_cast<int>(planes.size()) + kColumns - 1) / kColumns;
  cv::Mat sheet(std::max(rows, 1) * size.height + kFoot_px, kColumns * size.width, CV_8UC3, kPaper);
  for (std::size_t i = 0; i < planes.size(); ++i) {
    const cv::Point corner(static_cast<int>(i) % kColumns * size.width, static_cast<int>(i) / kColumns * size.height);
    residualTile(*planes[i], limit_m, size).copyTo(sheet(cv::Rect(corner, size)));
  }
  const int y = sheet.rows - kFoot_px + 8;
  for (int x = 0; x < 300; ++x) {
    const cv::Vec3b c = diverging((x - 150) / 150.0);
    cv::line(sheet, {100 + x, y}, {100 + x, y + 14}, cv::Scalar(c[0], c[1], c[2]));
  }
  write(sheet, "-" + millimetres(limit_m), {10, y + 12}, 0.42);
  write(sheet, "+" + millimetres(limit_m) + " into the room; grey: the scan has nothing there", {410, y + 12}, 0.42);
  save(sheet, png);
}

void drawBeforeAfter(const ScanScene& scene, const std::string& png) {
  const cv::Size size(800, 620);
  const Eigen::AlignedBox3d bounds = boundsOf(scene);
  const Camera camera(bounds, size);
  cv::Mat both(size.height, 2 * size.width, CV_8UC3, kPaper);
  drawScan(scene, camera, bounds, size).copyTo(both(cv::Rect({0, 0}, size)));
  drawScene(scene, camera, size).copyTo(both(cv::Rect({size.width, 0}, size)));
  write(both, "scan (red: left out)", {12, 22}, 0.55);
  write(both, "scene", {size.width + 12, 22}, 0.55);
  save(both, png);
}

}  // namespace mmradartwin
