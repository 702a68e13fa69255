#include "mmradartwin_attribution/ros/attribution_node.h"

#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/Residuals.h>
#include <visualization_msgs/MarkerArray.h>

#include <utility>

#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kMaxWaiting = 64;  // maps that wait for their counterpart

// Names of a session's poses by the stamp at which each begins.
std::map<std::int64_t, std::string> posesByStamp(const mmradartwin_msgs::Session& session) {
  std::map<std::int64_t, std::string> names;
  for (const auto& file : session.files) {
    if (file.name != "poses.csv") continue;
    const PoseTable table = parsePoses(std::string(file.data.begin(), file.data.end()), "poses.csv");
    for (const Pose& pose : table.poses) names[pose.stamp_ns] = pose.name;
    for (const PoseProblem& problem : table.problems) ROS_WARN("session: %s", problem.message.c_str());
  }
  return names;
}

}  // namespace

AttributionNode::AttributionNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh) : nh_(std::move(nh)) {
  readParameters(private_nh);
  residuals_ = nh_.advertise<mmradartwin_msgs::Residuals>("attribution/residuals", 10);
  ledger_ = nh_.advertise<mmradartwin_msgs::Ledger>("attribution/ledger", 1, true);
  markers_ = nh_.advertise<visualization_msgs::MarkerArray>("attribution/markers", 2);
  scene_markers_ = nh_.advertise<visualization_msgs::MarkerArray>(
      "attribution/scene_markers", 1, [this](const ros::SingleSubscriberPublisher&) { onSceneViewer(); },
      ros::SubscriberStatusCallback(), ros::VoidConstPtr(), true);
  subscribers_.push_back(nh_.subscribe("radar/config", 1, &AttributionNode::onRadar, this));
  subscribers_.push_back(nh_.subscribe("session", 1, &AttributionNode::onSession, this));
  subscribers_.push_back(nh_.subscribe("twin/paths", 10, &AttributionNode::onPaths, this));
  subscribers_.push_back(nh_.subscribe("radar/range_angle", 50, &AttributionNode::onMeasured, this));
  subscribers_.push_back(nh_.subscribe("twin/range_angle", 50, &AttributionNode::onSimulated, this));
  subscribers_.push_back(nh_.subscribe("twin/scene", 1, &AttributionNode::onScene, this));
  watchdog_ = nh_.createWallTimer(ros::WallDuration(5), &AttributionNode::watch, this);
}

void AttributionNode::readParameters(const ros::NodeHandle& private_nh) {
  StrictParameters parameters(private_nh);
  const std::string config_file = parameters.text("config", "");
  scene_file_ = parameters.text("scene", "");
  radar_frame_ = parameters.text("radar_frame", radar_frame_);
  frames_.map = parameters.text("map_frame", frames_.map);
  frames_.measured = parameters.text("measured_view_frame", frames_.measured);
  frames_.simulated = parameters.text("simulated_view_frame", frames_.simulated);
  frames_.residual = parameters.text("residual_view_frame", frames_.residual);
  markers_hz_ = parameters.number("markers_hz", markers_hz_, 1e-3, 100);
  max_paths_ = parameters.integer("max_paths", max_paths_, 0, 2000);
  parameters.rejectUnknown();
  if (!config_file.empty()) config_ = loadAttributionConfig(config_file);
}

void AttributionNode::onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg) {
  try {
    radar_ = std::make_unique<RadarConfig>(fromMsg(*msg));
    radar_hash_ = radarHash(*msg);
    if (!scene_file_.empty()) setScene(loadScene(scene_file_, radar_->center_frequency_hz()));
    rebuild();
  } catch (const std::exception& error) {
    ROS_ERROR("radar/config: %s", error.what());
  }
}

void AttributionNode::onScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
  try {
    if (scene_file_.empty()) {
      setScene(sceneFromMsg(*msg));
      rebuild();
    }
    if (!twin_yaml_.empty() && msg->twin_yaml != twin_yaml_) beginAnew();
    twin_yaml_ = msg->twin_yaml;
  } catch (const std::exception& error) {
    ROS_ERROR("twin/scene: %s", error.what());
  }
}

void AttributionNode::onSession(const mmradartwin_msgs::Session::ConstPtr& msg) {
  try {
    pose_names_ = posesByStamp(*msg);
  } catch (const InputError& error) {
    pose_names_.clear();
    ROS_WARN("session: %s", error.what());
  }
}

void AttributionNode::onPaths(const mmradartwin_msgs::PathRecords::ConstPtr& msg) { paths_ = msg; }

void AttributionNode::onMeasured(const MapMsg::ConstPtr& msg) { onMap(msg, measured_, simulated_, true); }

void AttributionNode::onSimulated(const MapMsg::ConstPtr& msg) { onMap(msg, simulated_, measured_, false); }

void AttributionNode::onMap(const MapMsg::ConstPtr& msg, std::map<std::int64_t, MapMsg::ConstPtr>& own,
                            std::map<std::int64_t, MapMsg::ConstPtr>& other, bool measured) {
  if (measured) ++received_;  // of a stream that has paused the twin goes on by itself
  const std::int64_t stamp = toNanoseconds(msg->header.stamp);
  const auto match = other.find(stamp);
  if (match == other.end()) {
    own[stamp] = msg;
    while (own.size() > kMaxWaiting) own.erase(own.begin());
    return;
  }
  const MapMsg::ConstPtr sameInOtherList = match->second;
  other.erase(other.begin(), std::next(match));  // older ones will find no partner any more
  last_measured_ = measured ? msg : sameInOtherList;
  try {
    compare(measured ? *msg : *sameInOtherList, measured ? *sameInOtherList : *msg);
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(5, "maps of %s: %s", formatStamp(stamp).c_str(), error.what());
  }
}

void AttributionNode::setScene(Scene scene) {
  regions_.reset();
  rays_.reset();
  scene_ = std::make_unique<Scene>(std::move(scene));
  rays_ = std::make_unique<RayCaster>(*scene_);
  scene_due_ = true;
  publishScene();
}

// The latched scene reaches a viewer at once, and is lost to it where tf does not yet reach: rviz drops markers that
// it cannot place. So each viewer gets it once more when tf has been there for a pair of maps.
void AttributionNode::onSceneViewer() { scene_viewer_since_ = ros::WallTime::now(); }

void AttributionNode::publishScene() {
  const ros::WallTime now = ros::WallTime::now();
  if (!scene_ || !scene_due_ || (now - scene_published_).toSec() < 2) return;
  scene_markers_.publish(sceneMarkers(*scene_, frames_.map));
  scene_published_ = now;
  scene_due_ = false;
}

// Everything that depends on radar and scene.
void AttributionNode::rebuild() {
  if (!radar_) return;
  const SignalChain chain(*radar_);
  field_ = std::make_unique<EvaluationField>(config_, *radar_, chain.axes());
  builder_ = std::make_unique<MarkerBuilder>(*field_, frames_, max_paths_);
  if (scene_) regions_ = std::make_unique<RegionModel>(*scene_, *rays_, *field_, *radar_);
  regions_of_pose_.clear();
  regions_valid_ = false;
}

// Another twin: its table counts from here. A pair of the one before that is still on its way is replaced by the
// next at the same place, since of a stretch the last of the longest averages counts. The last measured map is
// compared once more, with what the new twin makes of it.
void AttributionNode::beginAnew() {
  live_ledger_ = LiveLedger();
  publishLedger(ros::Time::now());
  if (const MapMsg::ConstPtr measured = last_measured_) onMeasured(measured);
  ROS_INFO("another twin is simulated: the ledger begins anew");
}

void AttributionNode::publishLedger(const ros::Time& stamp) {
  mmradartwin_msgs::Ledger ledger = toMsg(live_ledger_.summary(), live_ledger_.duplicates());
  ledger.header.stamp = stamp;
  ledger.header.frame_id = radar_frame_;
  ledger_.publish(ledger);
}

const std::vector<ResponseRegion>& AttributionNode::regionsAt(const Eigen::Isometry3d& T) {
  // A radar that stands keeps its regions.
  const bool same = regions_valid_ && (T.translation() - regions_T_.translation()).norm() < 1e-3 &&
                    (T.linear() - regions_T_.linear()).norm() < 1e-3;
  if (!same) {
    regions_of_pose_ = regions_->regions(T);
    regions_T_ = T;
    regions_valid_ = true;
  }
  return regions_of_pose_;
}

void AttributionNode::compare(const MapMsg& measured_msg, const MapMsg& simulated_msg) {
  if (!field_ || !regions_) {
    ROS_WARN_THROTTLE(5, "waiting for %s", field_ ? "twin/scene" : "radar/config");
    return;
  }
  if (measured_msg.radar_hash != radar_hash_) {
    ROS_WARN_THROTTLE(5, "radar/range_angle was made with another radar configuration than radar/config; left out");
    return;
  }
  if (!measured_msg.pose_valid && !simulated_msg.pose_valid) {
    ROS_WARN_THROTTLE(5, "no pose at %f; is the radar's tf published?", measured_msg.header.stamp.toSec());
    return;
  }
  const RangeAngleMap measured = fromMsg(measured_msg), simulated = fromMsg(simulated_msg);
  const Eigen::Isometry3d T = measured.pose_valid ? measured.T_map_radar : simulated.T_map_radar;
  // The records of this stamp; where none came for it, those of the same place (a standing radar re-uses them).
  if (paths_ && (paths_->header.stamp == simulated_msg.header.stamp ||
                 fromMsg(paths_->T_map_radar).isApprox(simulated.T_map_radar, 1e-6))) {
    if (paths_ != records_of_) {
      records_ = pathsFromMsg(*paths_, *scene_);
      records_of_ = paths_;
    }
  } else {
    records_.clear();
    records_of_.reset();
  }
  const PoseAttribution pose = attributePose(*field_, measured, simulated, regionsAt(T), records_);
  const std::string name = nameAt(measured.stamp_ns);

  mmradartwin_msgs::Residuals residuals = toMsg(*field_, pose, name, T);
  residuals.header.stamp = measured_msg.header.stamp;
  residuals.header.frame_id = radar_frame_;
  residuals_.publish(residuals);

  live_ledger_.add(measured.stamp_ns, T, name, measured.frames, pose.central);
  const ros::WallTime now = ros::WallTime::now();
  if ((now - last_markers_).toSec() >= 1 / markers_hz_) {
    last_markers_ = now;
    publishLedger(residuals.header.stamp);
    if (markers_.getNumSubscribers() > 0) {
      if (had_subscribers_ == 0) builder_ = std::make_unique<MarkerBuilder>(*field_, frames_, max_paths_);
      markers_.publish(builder_->build(pose, records_, T, name));
    }
    had_subscribers_ = markers_.getNumSubscribers();
  }
  ++pairs_;
  if (!scene_viewer_since_.isZero() && (now - scene_viewer_since_).toSec() > 1) {
    scene_viewer_since_ = ros::WallTime();
    scene_due_ = true;
  }
  publishScene();
}

std::string AttributionNode::nameAt(std::int64_t stamp_ns) const {
  auto after = pose_names_.upper_bound(stamp_ns);
  return after == pose_names_.begin() ? formatStamp(stamp_ns) : std::prev(after)->second;
}

void AttributionNode::watch(const ros::WallTimerEvent&) {
  publishScene();
  if (pairs_ == pairs_before_ && received_ != received_before_) {
    ROS_WARN("no pair of maps in 5 s: %zu measured and %zu simulated wait for a counterpart of the same stamp",
             measured_.size(), simulated_.size());
  }
  pairs_before_ = pairs_;
  received_before_ = received_;
}

}  // namespace mmradartwin
