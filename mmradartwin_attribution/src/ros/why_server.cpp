#include "mmradartwin_attribution/ros/why_server.h"

#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"

namespace mmradartwin {
namespace {

constexpr double kAnewEvery_s = 0.5;    // an answer about maps that stream
constexpr std::size_t kMostPaths = 20;  // of thousands that a rough surface has
constexpr int kRingSteps = 12;

geometry_msgs::Point pointOf(const Eigen::Vector3d& p) {
  geometry_msgs::Point msg;
  msg.x = p.x();
  msg.y = p.y();
  msg.z = p.z();
  return msg;
}

visualization_msgs::Marker highlight(const std::string& frame, const std::string& ns, int type) {
  visualization_msgs::Marker m;
  m.header.frame_id = frame;
  m.frame_locked = true;
  m.ns = ns;
  m.type = type;
  m.action = visualization_msgs::Marker::ADD;
  m.pose.orientation.w = 1;
  m.scale.x = m.scale.y = m.scale.z = 1;
  m.color.r = 0.2F;
  m.color.g = 1;
  m.color.b = 1;
  m.color.a = 1;
  return m;
}

/// The place on the floor, as the fan is drawn there.
Eigen::Vector3d onFloor(const Eigen::Isometry3d& T_map_radar, double range_m, double azimuth_rad) {
  const Eigen::Vector3d ahead = T_map_radar.linear().col(0);
  const double heading = std::atan2(ahead.y(), ahead.x()) + azimuth_rad;
  constexpr double kAboveFloor_m = 0.06;
  return {T_map_radar.translation().x() + range_m * std::cos(heading),
          T_map_radar.translation().y() + range_m * std::sin(heading), kAboveFloor_m};
}

void addLine(visualization_msgs::Marker& lines, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  lines.points.push_back(pointOf(from));
  lines.points.push_back(pointOf(to));
}

}  // namespace

WhyServer::WhyServer(ros::NodeHandle& nh, const std::string& map_frame) : map_frame_(map_frame) {
  explanation_ = nh.advertise<mmradartwin_msgs::Explanation>("attribution/explanation", 1, true);
  markers_ = nh.advertise<visualization_msgs::MarkerArray>("attribution/explanation_markers", 1, true);
  points_ = nh.subscribe("clicked_point", 5, &WhyServer::onPoint, this);
  why_ = nh.advertiseService("attribution/why", &WhyServer::onWhy, this);
}

void WhyServer::setPose(AskedPose pose) {
  constexpr double kSame_m = 0.02, kSame = 0.02;
  const bool moved = pose_ && ((pose_->T_map_radar.translation() - pose.T_map_radar.translation()).norm() > kSame_m ||
                               (pose_->T_map_radar.linear() - pose.T_map_radar.linear()).norm() > kSame);
  pose_ = std::move(pose);
  if (!asked_) return;
  if (moved) {
    forget();
  } else if ((ros::WallTime::now() - answered_).toSec() > kAnewEvery_s) {
    try {
      show(explain(asked_->x(), asked_->y()));
    } catch (const InputError&) {  // other thresholds leave the place out
      forget();
    }
  }
}

void WhyServer::forget() {
  asked_.reset();
  mmradartwin_msgs::Explanation none;
  none.header = pose_->header;
  explanation_.publish(none);
  visualization_msgs::MarkerArray clear;
  clear.markers.push_back(highlight(map_frame_, "", visualization_msgs::Marker::ARROW));
  clear.markers.back().action = visualization_msgs::Marker::DELETEALL;
  markers_.publish(clear);
}

void WhyServer::onPoint(const geometry_msgs::PointStamped::ConstPtr& point) {
  try {
    answer(*point);
  } catch (const InputError& error) {
    ROS_WARN("why: %s", error.what());
    mmradartwin_msgs::Explanation none;
    none.header = point->header;
    none.note = error.what();
    explanation_.publish(none);
  }
}

bool WhyServer::onWhy(mmradartwin_msgs::Why::Request& request, mmradartwin_msgs::Why::Response& response) {
  try {
    response.explanation = answer(request.point);
    response.success = true;
  } catch (const InputError& error) {
    response.message = error.what();
  }
  return true;
}

mmradartwin_msgs::Explanation WhyServer::answer(const geometry_msgs::PointStamped& point) {
  if (!pose_) throw InputError("no maps have been compared yet");
  const Eigen::Vector3d p(point.point.x, point.point.y, point.point.z);
  if (!p.allFinite()) throw InputError("the point has no finite coordinates");
  double heading_rad = 0;
  Eigen::Vector2d away = p.head<2>();
  const std::string& frame = point.header.frame_id;
  if (frame == map_frame_ || frame == "/" + map_frame_) {
    const Eigen::Vector3d ahead = pose_->T_map_radar.linear().col(0);
    heading_rad = std::atan2(ahead.y(), ahead.x());
    away -= pose_->T_map_radar.translation().head<2>();
  } else if (frame != pose_->header.frame_id) {
    throw InputError("the point is in frame '" + frame + "'; give it in " + map_frame_ + " or " +
                     pose_->header.frame_id);
  }
  const double azimuth_rad = std::remainder(std::atan2(away.y(), away.x()) - heading_rad, 2 * M_PI);
  mmradartwin_msgs::Explanation explanation = explain(away.norm(), azimuth_rad);
  asked_ = Eigen::Vector2d(away.norm(), azimuth_rad);
  show(explanation);
  return explanation;
}

mmradartwin_msgs::Explanation WhyServer::explain(double range_m, double azimuth_rad) {
  const PoseAttribution& attribution = pose_->attribution;
  const PlaceExplanation place = explainPlace(*pose_->field, attribution, *pose_->records, range_m, azimuth_rad);
  mmradartwin_msgs::Explanation msg;
  msg.header = pose_->header;
  msg.pose = pose_->name;
  msg.kind = kindName(place, attribution);
  msg.sentence = place.sentence;
  msg.action = place.action;
  msg.range_m = place.range_m;
  msg.azimuth_rad = place.azimuth_rad;
  msg.half_range_m = place.half_range_m;
  msg.half_azimuth_rad = place.half_azimuth_rad;
  msg.measured_db = place.measured_db;
  msg.simulated_db = place.simulated_db;
  msg.actor = place.actor;
  msg.material = place.material;
  if (place.region >= 0) {
    msg.region = regionKindName(attribution.regions[static_cast<std::size_t>(place.region)].kind);
  }
  for (const PathPart& part : place.paths) {
    const PathRecord& record = (*pose_->records)[static_cast<std::size_t>(part.record)];
    mmradartwin_msgs::PathShare share;
    share.record = static_cast<std::uint32_t>(part.record);
    share.event = record.event ? *record.event : "";
    for (int actor : record.actors) share.actors.push_back(pose_->scene ? pose_->scene->actorOf(actor).name : "");
    share.level_db = part.level_db;
    share.share = part.share;
    share.delay_s = part.delay_s;
    share.range_m = part.range_m;
    share.azimuth_rad = part.azimuth_rad;
    msg.paths.push_back(std::move(share));
  }
  if (!msg.paths.empty()) {
    msg.event = msg.paths.front().event;
  } else {
    msg.note = pose_->records->empty() ? "no paths are known of these maps" : "no path of the twin reaches this place";
  }
  return msg;
}

void WhyServer::show(const mmradartwin_msgs::Explanation& explanation) {
  answered_ = ros::WallTime::now();
  explanation_.publish(explanation);
  using visualization_msgs::Marker;
  visualization_msgs::MarkerArray out;
  out.markers.push_back(highlight(map_frame_, "", Marker::ARROW));
  out.markers.back().action = Marker::DELETEALL;

  Marker box = highlight(map_frame_, "place", Marker::LINE_LIST);
  box.scale.x = 0.05;
  const double near_m = std::max(0.0, explanation.range_m - explanation.half_range_m);
  const double far_m = explanation.range_m + explanation.half_range_m;
  const Eigen::Isometry3d& T = pose_->T_map_radar;
  const auto corner = [&](double range_m, double share) {
    return onFloor(T, range_m, explanation.azimuth_rad + (2 * share - 1) * explanation.half_azimuth_rad);
  };
  for (int i = 0; i < kRingSteps; ++i) {
    const double from = static_cast<double>(i) / kRingSteps, to = static_cast<double>(i + 1) / kRingSteps;
    addLine(box, corner(far_m, from), corner(far_m, to));
    addLine(box, corner(near_m, from), corner(near_m, to));
  }
  for (double side : {0.0, 1.0}) addLine(box, corner(near_m, side), corner(far_m, side));
  out.markers.push_back(std::move(box));

  Marker paths = highlight(map_frame_, "paths", Marker::LINE_LIST);
  paths.scale.x = 0.03;
  for (std::size_t i = 0; i < std::min(explanation.paths.size(), kMostPaths); ++i) {
    Eigen::Vector3d from = T.translation();
    const PathRecord& record = (*pose_->records)[explanation.paths[i].record];
    for (const Eigen::Vector3d& vertex : record.vertices) {
      addLine(paths, from, vertex);
      from = vertex;
    }
    if (record.vertices.size() > 1) addLine(paths, from, T.translation());
  }
  if (!paths.points.empty()) out.markers.push_back(std::move(paths));

  Marker surface = highlight(map_frame_, "actor", Marker::TRIANGLE_LIST);
  surface.color.a = 0.45F;
  if (pose_->scene) {
    for (const Actor& actor : pose_->scene->actors) {
      // "wall;floor" of a corner.
      if ((";" + explanation.actor + ";").find(";" + actor.name + ";") == std::string::npos) continue;
      for (const auto& t : actor.triangles) {
        for (int vertex : t) surface.points.push_back(pointOf(actor.vertices[vertex]));
      }
    }
  }
  if (!surface.points.empty()) out.markers.push_back(std::move(surface));
  markers_.publish(out);
}

}  // namespace mmradartwin
