#include "mmradartwin_attribution/ros/actor_handles.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mmradartwin {
namespace {

/// Whether an actor goes along a wall, floor or ceiling, or is one: it is as wide as most of the room.
bool encloses(const Actor& actor, const Eigen::AlignedBox3d& room) {
  const Eigen::Vector3d size = actor.bounds.sizes(), whole = room.sizes();
  return size.x() > 0.6 * whole.x() || size.y() > 0.6 * whole.y();
}

geometry_msgs::Pose poseOf(const Eigen::Vector3d& center, const WhatIf::Placement& placement) {
  geometry_msgs::Pose pose;
  const Eigen::Vector3d at = center + placement.shift_m;
  pose.position.x = at.x();
  pose.position.y = at.y();
  pose.position.z = at.z();
  pose.orientation.w = std::cos(placement.yaw_deg * M_PI / 360);
  pose.orientation.z = std::sin(placement.yaw_deg * M_PI / 360);
  return pose;
}

/// The actor's triangles about its centroid, in a colour that shows through its own.
visualization_msgs::Marker bodyOf(const Actor& actor, const Eigen::Vector3d& center) {
  visualization_msgs::Marker body;
  body.type = visualization_msgs::Marker::TRIANGLE_LIST;
  body.scale.x = body.scale.y = body.scale.z = 1;
  body.pose.orientation.w = 1;
  body.color.r = 1;
  body.color.g = 0.75F;
  body.color.b = 0.2F;
  body.color.a = 0.55F;
  for (const auto& triangle : actor.triangles) {
    for (int v : triangle) {
      const Eigen::Vector3d p = actor.vertices[static_cast<std::size_t>(v)] - center;
      geometry_msgs::Point point;
      point.x = p.x();
      point.y = p.y();
      point.z = p.z();
      body.points.push_back(point);
    }
  }
  return body;
}

}  // namespace

Eigen::Vector3d surfaceCentroid(const Actor& actor) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double area = 0;
  for (const auto& t : actor.triangles) {
    const auto at = [&](int i) -> const Eigen::Vector3d& {
      return actor.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(i)])];
    };
    const double weight = (at(1) - at(0)).cross(at(2) - at(0)).norm();
    sum += weight * (at(0) + at(1) + at(2)) / 3;
    area += weight;
  }
  return area > 0 ? Eigen::Vector3d(sum / area) : actor.bounds.center();
}

ActorHandles::ActorHandles(const std::string& topic, const std::string& map_frame,
                           std::function<void(const HandleMove&)> on_move)
    : map_frame_(map_frame), on_move_(std::move(on_move)), server_(topic) {}

void ActorHandles::show(const WhatIf& what_if) {
  clear();
  Eigen::AlignedBox3d room;
  for (const Actor& actor : what_if.given().scene().actors) room.extend(actor.bounds);
  for (const Actor& actor : what_if.given().scene().actors) {
    if (encloses(actor, room)) continue;
    const Eigen::Vector3d center = surfaceCentroid(actor);
    centers_[actor.name] = center;
    visualization_msgs::InteractiveMarker handle;
    handle.header.frame_id = map_frame_;
    handle.name = actor.name;
    handle.description = actor.name;
    handle.pose = poseOf(center, what_if.placement(actor.name));
    handle.scale = static_cast<float>(std::clamp(0.7 * actor.bounds.sizes().head<2>().maxCoeff(), 0.25, 0.8));
    visualization_msgs::InteractiveMarkerControl control;
    control.name = "move";
    control.orientation.w = control.orientation.y = std::sqrt(0.5);  // its x axis, the plane's normal, is map's z
    control.orientation_mode = visualization_msgs::InteractiveMarkerControl::INHERIT;
    control.interaction_mode = visualization_msgs::InteractiveMarkerControl::MOVE_PLANE;
    control.always_visible = true;
    control.markers.push_back(bodyOf(actor, center));
    handle.controls.push_back(control);
    control.markers.clear();
    control.always_visible = false;
    control.name = "turn";
    control.interaction_mode = visualization_msgs::InteractiveMarkerControl::ROTATE_AXIS;
    handle.controls.push_back(control);
    server_.insert(handle, [this](const visualization_msgs::InteractiveMarkerFeedbackConstPtr& f) { onFeedback(*f); });
  }
  server_.applyChanges();
}

void ActorHandles::place(const WhatIf& what_if) {
  for (const auto& [actor, center] : centers_) {
    if (actor != held_) server_.setPose(actor, poseOf(center, what_if.placement(actor)));
  }
  server_.applyChanges();
}

void ActorHandles::clear() {
  centers_.clear();
  held_.clear();
  server_.clear();
  server_.applyChanges();
}

void ActorHandles::onFeedback(const visualization_msgs::InteractiveMarkerFeedback& feedback) {
  using Feedback = visualization_msgs::InteractiveMarkerFeedback;
  const auto center = centers_.find(feedback.marker_name);
  if (center == centers_.end()) return;
  if (feedback.event_type == Feedback::MOUSE_DOWN) {
    held_ = feedback.marker_name;
    fresh_ = true;
  }
  if (feedback.event_type == Feedback::MOUSE_UP) held_.clear();
  if (feedback.event_type != Feedback::POSE_UPDATE) return;
  const auto& p = feedback.pose.position;
  const auto& q = feedback.pose.orientation;
  HandleMove move{feedback.marker_name, Eigen::Vector3d(p.x, p.y, p.z) - center->second,
                  2 * std::atan2(q.z, q.w) * 180 / M_PI, !std::exchange(fresh_, false)};
  move.shift_m.z() = 0;
  on_move_(move);
}

}  // namespace mmradartwin
