#include "mmradartwin_attribution/ros/markers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>

#include "mmradartwin_attribution/pose_picture.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

using visualization_msgs::Marker;

std_msgs::ColorRGBA rgba(double r, double g, double b, double a = 1) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(r);
  c.g = static_cast<float>(g);
  c.b = static_cast<float>(b);
  c.a = static_cast<float>(a);
  return c;
}

const std_msgs::ColorRGBA kWhite = rgba(1, 1, 1), kMagenta = rgba(1, 0, 1), kGrey = rgba(0.62, 0.62, 0.62),
                          kNoData = rgba(0.22, 0.22, 0.22);

/// The hue that classes have in pictures at full brightness, halfway to white: thin letters of that hue itself cannot
/// be read on viridis.
std_msgs::ColorRGBA letterColor(ResidualClass c) {
  const cv::Scalar bgr = classColor_bgr(c);
  const double most = std::max({bgr[0], bgr[1], bgr[2]});
  return rgba(0.5 + 0.5 * bgr[2] / most, 0.5 + 0.5 * bgr[1] / most, 0.5 + 0.5 * bgr[0] / most);
}

std_msgs::ColorRGBA eventColor(const std::string& event) {
  if (event == "specular") return rgba(0.941, 0.894, 0.259);
  if (event == "corner") return rgba(0.902, 0.624, 0);
  if (event == "diffuse") return rgba(0.337, 0.706, 0.914);
  std::size_t hash = 5381;  // the same colour in every run
  for (char c : event) hash = hash * 33 + static_cast<unsigned char>(c);
  const double hue = static_cast<double>(hash % 360) / 60;
  const double x = 1 - std::abs(std::fmod(hue, 2) - 1);
  const int sector = static_cast<int>(hue);
  const double table[6][3] = {{1, x, 0}, {x, 1, 0}, {0, 1, x}, {0, x, 1}, {x, 0, 1}, {1, 0, x}};
  return rgba(0.3 + 0.7 * table[sector][0], 0.3 + 0.7 * table[sector][1], 0.3 + 0.7 * table[sector][2]);
}

// 256 colours of viridis, as the pictures of the programs have them.
const std::vector<std_msgs::ColorRGBA>& sequential() {
  static const std::vector<std_msgs::ColorRGBA> colors = [] {
    cv::Mat ramp(1, 256, CV_8U), mapped;
    for (int i = 0; i < 256; ++i) ramp.at<unsigned char>(0, i) = static_cast<unsigned char>(i);
    cv::applyColorMap(ramp, mapped, cv::COLORMAP_VIRIDIS);
    std::vector<std_msgs::ColorRGBA> result;
    for (int i = 0; i < 256; ++i) {
      const cv::Vec3b c = mapped.at<cv::Vec3b>(0, i);
      result.push_back(rgba(c[2] / 255.0, c[1] / 255.0, c[0] / 255.0));
    }
    return result;
  }();
  return colors;
}

// Blue where the measurement is stronger, red where the simulation is, as in the pictures.
std_msgs::ColorRGBA diverging(double share) {
  const double t = std::clamp(share, -1.0, 1.0), a = std::abs(t);
  const double end[2][3] = {{0.129, 0.4, 0.675}, {0.698, 0.094, 0.169}};
  const double* e = end[t > 0];
  return rgba(0.97 + (e[0] - 0.97) * a, 0.97 + (e[1] - 0.97) * a, 0.97 + (e[2] - 0.97) * a);
}

geometry_msgs::Point point(double x, double y, double z) {
  geometry_msgs::Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}

geometry_msgs::Point polar(double range_m, double azimuth_rad, double z) {
  return point(range_m * std::cos(azimuth_rad), range_m * std::sin(azimuth_rad), z);
}

geometry_msgs::Point point(const Eigen::Vector3d& p) { return point(p.x(), p.y(), p.z()); }

void addOutline(Marker& lines, double near_m, double far_m, double from_rad, double to_rad, double z) {
  constexpr int kSteps = 8;
  std::vector<geometry_msgs::Point> ring;
  for (int i = 0; i <= kSteps; ++i) ring.push_back(polar(far_m, from_rad + (to_rad - from_rad) * i / kSteps, z));
  for (int i = kSteps; i >= 0; --i) ring.push_back(polar(near_m, from_rad + (to_rad - from_rad) * i / kSteps, z));
  for (std::size_t i = 0; i < ring.size(); ++i) {
    lines.points.push_back(ring[i]);
    lines.points.push_back(ring[(i + 1) % ring.size()]);
  }
}

std::string spoken(std::string actor) {
  std::replace(actor.begin(), actor.end(), ';', '+');
  return actor;
}

std::string label(const Residual& r) {
  char level[40];
  std::snprintf(level, sizeof level, "%+.1f dB", r.simulated_db - r.measured_db);
  return className(r.residual_class) + " " + classLabel(r.residual_class) + ": " +
         (r.actor.empty() ? "" : spoken(r.actor) + " ") + level;
}

}  // namespace

MarkerBuilder::MarkerBuilder(const EvaluationField& field, const MarkerFrames& frames, const MarkerStyle& style)
    : field_(field), frames_(frames), style_(style) {
  const std::vector<double>&ranges = field_.axes().range_m, &azimuths = field_.axes().azimuth_rad;
  const double range_bin = ranges.size() > 1 ? ranges[1] - ranges[0] : 1;
  max_range_m_ = ranges.back();
  const auto edge = [&](std::size_t a, std::size_t b) {  // bins are uniform in the sine
    return std::asin(std::clamp(0.5 * (std::sin(azimuths[a]) + std::sin(azimuths[b])), -1.0, 1.0));
  };
  for (std::size_t a = 1; a + 1 < azimuths.size(); ++a) {
    if (std::isnan(azimuths[a - 1]) || std::isnan(azimuths[a]) || std::isnan(azimuths[a + 1])) continue;
    const double from = edge(a - 1, a), to = edge(a, a + 1);
    for (std::size_t r = 1; r < ranges.size(); ++r) {
      const double near_m = ranges[r] - range_bin / 2, far_m = ranges[r] + range_bin / 2;
      fan_cells_.emplace_back(static_cast<int>(r), static_cast<int>(a));
      fan_points_.push_back(polar(near_m, from, 0));
      fan_points_.push_back(polar(far_m, from, 0));
      fan_points_.push_back(polar(far_m, to, 0));
      fan_points_.push_back(polar(near_m, from, 0));
      fan_points_.push_back(polar(far_m, to, 0));
      fan_points_.push_back(polar(near_m, to, 0));
    }
  }
}

Marker MarkerBuilder::marker(const std::string& ns, int id, int type, const std::string& frame) const {
  Marker m;
  m.header.frame_id = frame;  // stamp 0: at the latest transform, and locked to the frame
  m.frame_locked = true;
  m.ns = ns;
  m.id = id;
  m.type = type;
  m.action = Marker::ADD;
  m.pose.orientation.w = 1;
  m.scale.x = m.scale.y = m.scale.z = 1;
  m.color = kWhite;
  return m;
}

void MarkerBuilder::addList(const Marker& m, Array& out) const {
  out.markers.push_back(m);
  if (m.points.empty()) out.markers.back().action = Marker::DELETE;
}

void MarkerBuilder::addFans(const PoseAttribution& pose, Array& out) {
  const double floor = style_.map_span_db > 0 ? -style_.map_span_db : field_.config().floor_db;
  const auto fan = [&](const std::string& ns, const std::string& frame, const auto& color) {
    Marker m = marker(ns, 0, Marker::TRIANGLE_LIST, frame);
    m.points = fan_points_;
    m.colors.reserve(2 * fan_cells_.size());
    for (const auto& [r, a] : fan_cells_) {
      const std_msgs::ColorRGBA c = color(r, a);
      m.colors.push_back(c);  // one colour per triangle, two triangles per cell
      m.colors.push_back(c);
    }
    out.markers.push_back(std::move(m));
  };
  const auto level = [&](const RealGrid& map) {
    return [&map, floor](int r, int a) {
      const double share = (map(r, a) - floor) / -floor;
      return sequential()[static_cast<std::size_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)))];
    };
  };
  fan("measured", frames_.measured, level(pose.measured.level_db));
  fan("simulated", frames_.simulated, level(pose.simulated.level_db));
  fan("residual", frames_.residual, [&](int r, int a) {
    const double v = pose.residual_db(r, a);
    return std::isnan(v) ? kNoData : diverging(v / style_.residual_span_db);
  });
}

void MarkerBuilder::addGrid(const std::string& frame, const std::string& title, Array& out) {
  Marker lines = marker("grid " + title, 0, Marker::LINE_LIST, frame);
  lines.scale.x = 0.012;
  lines.color = kGrey;
  const int last_m = static_cast<int>(max_range_m_ + 0.5);
  const double from = field_.axes().azimuth_rad.size() ? -field_.config().outer_azimuth_rad : 0, to = -from;
  constexpr int kSteps = 48;
  for (int range = 1; range <= last_m; ++range) {
    for (int i = 0; i < kSteps; ++i) {
      lines.points.push_back(polar(range, from + (to - from) * i / kSteps, 0.01));
      lines.points.push_back(polar(range, from + (to - from) * (i + 1) / kSteps, 0.01));
    }
  }
  for (int spoke = -90; spoke <= 90; spoke += 15) {
    if (std::abs(spoke * kDegree) > to + 1e-9) continue;
    lines.points.push_back(polar(1, spoke * kDegree, 0.01));
    lines.points.push_back(polar(last_m, spoke * kDegree, 0.01));
  }
  out.markers.push_back(std::move(lines));
  int id = 1;
  const auto text = [&](const geometry_msgs::Point& at, const std::string& words, double height) {
    Marker m = marker("grid " + title, id++, Marker::TEXT_VIEW_FACING, frame);
    m.pose.position = at;
    m.scale.z = height;
    m.text = words;
    out.markers.push_back(std::move(m));
  };
  text(point(last_m + 1.0, 0, 0.05), title, 0.6);
  for (int range = 2; range <= last_m; range += 2) text(point(-0.3, range, 0.05), std::to_string(range) + " m", 0.32);
  for (int spoke = -60; spoke <= 60; spoke += 30) {
    text(polar(last_m + 0.4, spoke * kDegree, 0.05), std::to_string(spoke) + "°", 0.32);
  }
}

void MarkerBuilder::addBoxes(const PoseAttribution& pose, Array& out) {
  const MatchWindow& tight = field_.config().tight;
  const auto outline = [&](Marker& lines, double range_m, double azimuth_rad) {
    const double dr = field_.halfRange_m(tight), da = field_.halfAzimuth_rad(tight, azimuth_rad);
    addOutline(lines, std::max(0.0, range_m - dr), range_m + dr, azimuth_rad - da, azimuth_rad + da, 0.03);
  };
  for (int branch = 0; branch < 2; ++branch) {
    const std::string& frame = branch == 0 ? frames_.measured : frames_.simulated;
    Marker matched = marker("matched", branch, Marker::LINE_LIST, frame);
    Marker mismatch = marker("mismatch", branch, Marker::LINE_LIST, frame);
    matched.scale.x = mismatch.scale.x = 0.05;
    mismatch.color = kMagenta;
    for (const ResponseRegion& r : pose.regions) {
      if (r.field == Field::kCentral && r.measured_strong && r.simulated_strong)
        outline(matched, r.range_m, r.azimuth_rad);
    }
    for (const Residual& r : pose.residuals) {
      if (r.measured_stronger == (branch == 0)) outline(mismatch, r.range_m, r.azimuth_rad);
    }
    addList(matched, out);
    addList(mismatch, out);
  }
}

void MarkerBuilder::addLabels(const PoseAttribution& pose, Array& out) {
  std::map<std::string, int> shown;
  // A dark copy just behind each text keeps it legible on bright cells.
  const auto add = [&](const std::string& ns, const std::string& frame, const geometry_msgs::Point& at,
                       const std::string& words, const std_msgs::ColorRGBA& color) {
    for (bool shadow : {true, false}) {
      Marker m = marker(ns, shown[ns]++, Marker::TEXT_VIEW_FACING, frame);
      m.pose.position = at;
      m.scale.z = 0.5;
      m.color = color;
      m.text = words;
      if (shadow) {
        m.pose.position = point(at.x - 0.04, at.y - 0.04, at.z - 0.05);
        m.color = rgba(0, 0, 0);
      }
      out.markers.push_back(std::move(m));
    }
  };
  for (const Residual& r : pose.residuals) {
    add(className(r.residual_class), r.measured_stronger ? frames_.measured : frames_.simulated,
        polar(r.range_m + field_.halfRange_m(field_.config().tight) + 0.35, r.azimuth_rad, 0.2), label(r),
        letterColor(r.residual_class));
  }
  for (const ResponseRegion& r : pose.regions) {
    if (r.field != Field::kCentral || !r.measured_strong || !r.simulated_strong) continue;
    for (const std::string& frame : {frames_.measured, frames_.simulated}) {
      add("matched actors", frame, polar(std::max(0.2, r.range_m - 0.45), r.azimuth_rad, 0.2), spoken(r.actor), kWhite);
    }
  }
  for (const auto& [ns, count] : labels_shown_) {
    for (int id = shown[ns]; id < count; ++id) {
      Marker m = marker(ns, id, Marker::TEXT_VIEW_FACING, frames_.measured);
      m.action = Marker::DELETE;
      out.markers.push_back(std::move(m));
    }
  }
  labels_shown_ = shown;
}

void MarkerBuilder::addPaths(const std::vector<PathRecord>& records, const Eigen::Isometry3d& T_map_radar, Array& out) {
  std::vector<const PathRecord*> strongest;
  for (const PathRecord& r : records) {
    if (!r.vertices.empty() && r.event) strongest.push_back(&r);
  }
  const std::size_t count = std::min<std::size_t>(strongest.size(), static_cast<std::size_t>(style_.max_paths));
  std::partial_sort(strongest.begin(), strongest.begin() + static_cast<std::ptrdiff_t>(count), strongest.end(),
                    [](const PathRecord* a, const PathRecord* b) { return a->amplitude > b->amplitude; });
  strongest.resize(count);
  const Eigen::Vector3d radar = T_map_radar.translation();
  std::map<std::string, Marker> by_event;
  for (const std::string& event : events_shown_) {
    by_event.emplace(event, marker("paths " + event, 0, Marker::LINE_LIST, frames_.map));
  }
  for (const PathRecord* r : strongest) {
    auto [entry, added] = by_event.emplace(*r->event, marker("paths " + *r->event, 0, Marker::LINE_LIST, frames_.map));
    if (added) events_shown_.push_back(*r->event);
    Marker& m = entry->second;
    m.scale.x = 0.015;
    // Fades to 40 dB below the strongest path.
    std_msgs::ColorRGBA color = eventColor(*r->event);
    const double below_db = 20 * std::log10(std::max(r->amplitude / strongest.front()->amplitude, 1e-9));
    color.a = static_cast<float>(std::clamp(1 + below_db / 40, 0.08, 1.0));
    Eigen::Vector3d from = radar;
    for (std::size_t i = 0; i <= r->vertices.size(); ++i) {
      const Eigen::Vector3d to = i < r->vertices.size() ? r->vertices[i] : radar;
      m.points.push_back(point(from));
      m.points.push_back(point(to));
      m.colors.push_back(color);
      m.colors.push_back(color);
      from = to;
      if (r->vertices.size() == 1) break;  // back along the same line
    }
  }
  for (const auto& [event, m] : by_event) addList(m, out);
}

void MarkerBuilder::addRadar(const Eigen::Isometry3d& T_map_radar, const std::string& caption, Array& out) {
  Marker arrow = marker("radar", 0, Marker::ARROW, frames_.map);
  arrow.pose = toMsg(T_map_radar);
  arrow.scale.x = 0.8;
  arrow.scale.y = arrow.scale.z = 0.12;
  arrow.color = rgba(0, 0.447, 0.698);
  out.markers.push_back(std::move(arrow));
  Marker text = marker("radar", 1, Marker::TEXT_VIEW_FACING, frames_.map);
  const Eigen::Vector3d p = T_map_radar.translation();
  text.pose.position = point(p.x(), p.y(), p.z() + 0.4);
  text.scale.z = 0.5;
  text.text = caption.empty() ? "radar" : "pose " + caption;
  out.markers.push_back(std::move(text));
}

visualization_msgs::MarkerArray MarkerBuilder::build(const PoseAttribution& pose,
                                                     const std::vector<PathRecord>& records,
                                                     const Eigen::Isometry3d& T_map_radar, const std::string& caption) {
  Array out;
  if (first_) {
    Marker clear = marker("", 0, Marker::ARROW, frames_.map);
    clear.action = Marker::DELETEALL;
    out.markers.push_back(clear);
    first_ = false;
  }
  addFans(pose, out);
  addGrid(frames_.measured, "measured", out);
  addGrid(frames_.simulated, "simulated", out);
  addGrid(frames_.residual, "residual", out);
  addBoxes(pose, out);
  addLabels(pose, out);
  addPaths(records, T_map_radar, out);
  addRadar(T_map_radar, caption, out);
  return out;
}

visualization_msgs::MarkerArray sceneMarkers(const Scene& scene, const std::string& map_frame) {
  constexpr double kUprightAlpha = 0.75, kLevelAlpha = 0.3;
  std::map<std::string, Marker> by_material;
  const auto list = [&](const Actor& actor, bool level) -> Marker& {
    Marker& m = by_material[actor.material_tag + (level ? " level" : "")];
    if (m.ns.empty()) {
      m.header.frame_id = map_frame;
      m.frame_locked = true;
      m.ns = actor.material_tag + (level ? " level" : "");
      m.type = Marker::TRIANGLE_LIST;
      m.action = Marker::ADD;
      m.pose.orientation.w = 1;
      m.scale.x = m.scale.y = m.scale.z = 1;
      const auto& c = actor.material.color;
      // Half way to white.
      m.color = level ? rgba(0.5 + 0.5 * c[0], 0.5 + 0.5 * c[1], 0.5 + 0.5 * c[2], kLevelAlpha)
                      : rgba(c[0], c[1], c[2], kUprightAlpha);
    }
    return m;
  };
  for (const Actor& actor : scene.actors) {
    for (const auto& t : actor.triangles) {
      // A horizontal surface above head height (a ceiling) would hide everything from above.
      const Eigen::Vector3d &a = actor.vertices[t[0]], &b = actor.vertices[t[1]], &c = actor.vertices[t[2]];
      const bool level = std::abs((b - a).cross(c - a).normalized().z()) > 0.7;
      if (level && std::min({a.z(), b.z(), c.z()}) > 2.0) continue;
      Marker& m = list(actor, level);
      for (int corner : t) m.points.push_back(point(actor.vertices[corner]));
    }
  }
  visualization_msgs::MarkerArray out;
  for (auto& [name, m] : by_material) out.markers.push_back(std::move(m));
  return out;
}

visualization_msgs::MarkerArray findingMarkers(const Findings& findings, const std::string& map_frame) {
  constexpr double kLeastRadius_m = 0.15, kAbove_m = 2.2;
  constexpr int kCorners = 36;
  const std_msgs::ColorRGBA color = rgba(1, 0.45, 0.45, 1);
  visualization_msgs::MarkerArray out;
  Marker m;
  m.header.frame_id = map_frame;
  m.action = Marker::DELETEALL;
  out.markers.push_back(m);
  m.action = Marker::ADD;
  m.frame_locked = true;
  m.pose.orientation.w = 1;
  m.color = color;
  for (const Finding& f : findings.findings) {
    const auto [x_m, y_m] = f.placeError_m();
    for (const FindingPlace& place : f.where) {
      if (!place.x_m || !place.y_m) continue;
      m.id += 1;
      m.ns = "rings";
      m.type = Marker::LINE_STRIP;
      m.scale.x = 0.08;
      m.points.clear();
      for (int k = 0; k <= kCorners; ++k) {
        const double angle = 2 * M_PI * k / kCorners;
        m.points.push_back(point(*place.x_m + std::max(kLeastRadius_m, x_m) * std::cos(angle),
                                 *place.y_m + std::max(kLeastRadius_m, y_m) * std::sin(angle), kAbove_m));
      }
      out.markers.push_back(m);
      Marker label = m;
      label.ns = "causes";
      label.type = Marker::TEXT_VIEW_FACING;
      label.points.clear();
      label.scale.x = label.scale.y = 1;
      label.scale.z = 0.55;
      label.pose.position = point(*place.x_m, *place.y_m + 0.5, kAbove_m);
      label.text = f.cause + (place.actors.empty() ? "" : " " + place.actors.front());
      out.markers.push_back(label);
    }
  }
  return out;
}

}  // namespace mmradartwin
