#include "mmradartwin_attribution/ros/markers.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/ros/conversions.h"

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

const std_msgs::ColorRGBA kWhite = rgba(1, 1, 1), kBlack = rgba(0, 0, 0), kMismatch = rgba(1, 0.549, 1);

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

geometry_msgs::Point point(double x, double y, double z) {
  geometry_msgs::Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}

geometry_msgs::Point point(const Eigen::Vector3d& p) { return point(p.x(), p.y(), p.z()); }

/// Outline of a polar box on the floor, where the radar's boresight points to `yaw_rad`.
void addOutline(Marker& lines, const Eigen::Vector2d& radar_m, double yaw_rad, double near_m, double far_m,
                double from_rad, double to_rad) {
  constexpr int kSteps = 8;
  constexpr double kAboveFloor_m = 0.04;
  std::vector<geometry_msgs::Point> ring;
  const auto add = [&](double range_m, double azimuth_rad) {
    ring.push_back(point(radar_m.x() + range_m * std::cos(yaw_rad + azimuth_rad),
                         radar_m.y() + range_m * std::sin(yaw_rad + azimuth_rad), kAboveFloor_m));
  };
  for (int i = 0; i <= kSteps; ++i) add(far_m, from_rad + (to_rad - from_rad) * i / kSteps);
  for (int i = kSteps; i >= 0; --i) add(near_m, from_rad + (to_rad - from_rad) * i / kSteps);
  for (std::size_t i = 0; i < ring.size(); ++i) {
    lines.points.push_back(ring[i]);
    lines.points.push_back(ring[(i + 1) % ring.size()]);
  }
}

}  // namespace

MarkerBuilder::MarkerBuilder(const EvaluationField& field, const std::string& map_frame, int max_paths)
    : field_(field), map_frame_(map_frame), max_paths_(max_paths) {}

Marker MarkerBuilder::marker(const std::string& ns, int id, int type) const {
  Marker m;
  m.header.frame_id = map_frame_;  // stamp 0: at the latest transform, and locked to the frame
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

void MarkerBuilder::addList(const Marker& m, Array& out) {
  out.markers.push_back(m);
  if (m.points.empty()) out.markers.back().action = Marker::DELETE;
}

void MarkerBuilder::addBoxes(const PoseAttribution& pose, const Eigen::Isometry3d& T_map_radar, Array& out) const {
  constexpr double kLine_m = 0.03, kRim_m = 0.08;
  const MatchWindow& tight = field_.config().tight;
  const Eigen::Vector3d ahead = T_map_radar.linear().col(0);
  const double yaw = std::atan2(ahead.y(), ahead.x());
  const auto outline = [&](Marker& lines, double range_m, double azimuth_rad) {
    const double dr = field_.halfRange_m(tight), da = field_.halfAzimuth_rad(tight, azimuth_rad);
    addOutline(lines, T_map_radar.translation().head<2>(), yaw, std::max(0.0, range_m - dr), range_m + dr,
               azimuth_rad - da, azimuth_rad + da);
  };
  std::vector<Marker> boxes = {marker("matched", 1, Marker::LINE_LIST)};
  for (int k = 1; k <= 5; ++k) {
    boxes.push_back(marker(className(static_cast<ResidualClass>(k)), 1, Marker::LINE_LIST));
    boxes.back().color = kMismatch;
  }
  for (const ResponseRegion& r : pose.regions) {
    if (r.field == Field::kCentral && r.measured_strong && r.simulated_strong)
      outline(boxes[0], r.range_m, r.azimuth_rad);
  }
  for (const Residual& r : pose.residuals) {
    outline(boxes[static_cast<std::size_t>(r.residual_class)], r.range_m, r.azimuth_rad);
  }
  for (Marker& box : boxes) {
    box.scale.x = kLine_m;
    Marker rim = box;  // dark, so that the box stands out on bright cells
    rim.id = 0;
    rim.scale.x = kRim_m;
    rim.color = kBlack;
    for (geometry_msgs::Point& p : rim.points) p.z -= 0.01;
    addList(rim, out);
    addList(box, out);
  }
}

void MarkerBuilder::addPaths(const std::vector<PathRecord>& records, const Eigen::Isometry3d& T_map_radar, Array& out) {
  std::vector<const PathRecord*> strongest;
  for (const PathRecord& r : records) {
    if (!r.vertices.empty() && r.event) strongest.push_back(&r);
  }
  const std::size_t count = std::min<std::size_t>(strongest.size(), static_cast<std::size_t>(max_paths_));
  std::partial_sort(strongest.begin(), strongest.begin() + static_cast<std::ptrdiff_t>(count), strongest.end(),
                    [](const PathRecord* a, const PathRecord* b) { return a->amplitude > b->amplitude; });
  strongest.resize(count);
  const Eigen::Vector3d radar = T_map_radar.translation();
  std::map<std::string, Marker> by_event;
  for (const std::string& event : events_shown_) {
    by_event.emplace(event, marker("paths " + event, 0, Marker::LINE_LIST));
  }
  for (const PathRecord* r : strongest) {
    auto [entry, added] = by_event.emplace(*r->event, marker("paths " + *r->event, 0, Marker::LINE_LIST));
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

void MarkerBuilder::addRadar(const Eigen::Isometry3d& T_map_radar, const std::string& caption, Array& out) const {
  Marker arrow = marker("radar", 0, Marker::ARROW);
  arrow.pose = toMsg(T_map_radar);
  arrow.scale.x = 0.8;
  arrow.scale.y = arrow.scale.z = 0.12;
  arrow.color = rgba(0, 0.447, 0.698);
  out.markers.push_back(std::move(arrow));
  Marker text = marker("radar", 1, Marker::TEXT_VIEW_FACING);
  const Eigen::Vector3d p = T_map_radar.translation();
  text.pose.position = point(p.x(), p.y(), p.z() + 0.4);
  text.scale.z = 0.35;
  text.text = caption.empty() ? "radar" : "pose " + caption;
  out.markers.push_back(std::move(text));
}

visualization_msgs::MarkerArray MarkerBuilder::build(const PoseAttribution& pose,
                                                     const std::vector<PathRecord>& records,
                                                     const Eigen::Isometry3d& T_map_radar, const std::string& caption) {
  Array out;
  if (first_) {
    Marker clear = marker("", 0, Marker::ARROW);
    clear.action = Marker::DELETEALL;
    out.markers.push_back(clear);
    first_ = false;
  }
  addBoxes(pose, T_map_radar, out);
  addPaths(records, T_map_radar, out);
  addRadar(T_map_radar, caption, out);
  return out;
}

visualization_msgs::MarkerArray sceneMarkers(const Scene& scene, const std::string& map_frame) {
  constexpr double kUprightAlpha = 0.6, kLevelAlpha = 0.3;
  constexpr double kUprightWhite = 0.35, kLevelWhite = 0.5;  // walls that are lit from behind would be black
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
      const double white = level ? kLevelWhite : kUprightWhite;
      const auto part = [&](int i) { return white + (1 - white) * c[i]; };
      m.color = rgba(part(0), part(1), part(2), level ? kLevelAlpha : kUprightAlpha);
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
  constexpr double kLeastRadius_m = 0.15, kAbove_m = 2.2, kLetters_m = 0.4;
  constexpr double kApart_m = 2.5;  // labels nearer to each other would overlap: the later one stands higher
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
      label.scale.z = kLetters_m;
      label.pose.position = point(*place.x_m, *place.y_m + 0.5, kAbove_m);
      for (const Marker& other : out.markers) {
        if (other.type != Marker::TEXT_VIEW_FACING || other.action != Marker::ADD) continue;
        const double away_m = std::hypot(other.pose.position.x - *place.x_m, other.pose.position.y - *place.y_m - 0.5);
        if (away_m >= kApart_m) continue;
        label.pose.position.z = std::max(label.pose.position.z, other.pose.position.z + 1.3 * kLetters_m);
      }
      label.text = f.cause + (place.actors.empty() ? "" : " " + place.actors.front());
      out.markers.push_back(label);
    }
  }
  return out;
}

}  // namespace mmradartwin
