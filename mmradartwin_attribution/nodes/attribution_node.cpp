// Matches measured and simulated maps by stamp, attributes what differs, publishes residuals, ledger and markers.

#include <mmradartwin_msgs/Session.h>
#include <ros/ros.h>

#include <map>
#include <memory>
#include <sstream>

#include "mmradartwin_attribution/live_ledger.h"
#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_attribution/ros/markers.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/scene.h"

namespace {

using namespace mmradartwin;

constexpr std::size_t kMaxWaiting = 64;  // maps that wait for their counterpart

/// Names of a session's poses by the stamp at which each begins.
std::map<std::int64_t, std::string> posesByStamp(const mmradartwin_msgs::Session& session) {
  std::map<std::int64_t, std::string> names;
  for (const auto& file : session.files) {
    if (file.name != "poses.csv") continue;
    std::istringstream lines(std::string(file.data.begin(), file.data.end()));
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
      std::istringstream fields(line);
      std::string pose, location, stamp;
      std::getline(fields, pose, ',');
      std::getline(fields, location, ',');
      std::getline(fields, stamp, ',');
      try {
        if (!stamp.empty()) names[parseStamp_ns(stamp)] = pose;
      } catch (const InputError& error) {
        ROS_WARN("session: %s", error.what());
      }
    }
  }
  return names;
}

class AttributionNode {
 public:
  AttributionNode() : private_nh_("~") {
    std::string config_file, scene_file;
    private_nh_.param<std::string>("config", config_file, "");
    private_nh_.param<std::string>("scene", scene_file, "");
    private_nh_.param<std::string>("radar_frame", radar_frame_, "radar_link");
    private_nh_.param<std::string>("map_frame", frames_.map, frames_.map);
    private_nh_.param<std::string>("measured_view_frame", frames_.measured, frames_.measured);
    private_nh_.param<std::string>("simulated_view_frame", frames_.simulated, frames_.simulated);
    private_nh_.param<std::string>("residual_view_frame", frames_.residual, frames_.residual);
    private_nh_.param("markers_hz", markers_hz_, 2.0);
    private_nh_.param("max_paths", max_paths_, 200);
    if (!(markers_hz_ > 0 && markers_hz_ <= 100)) {
      throw InputError("parameter markers_hz is " + std::to_string(markers_hz_) +
                       "; give a rate above 0 and up to 100");
    }
    if (max_paths_ < 0 || max_paths_ > 2000) {
      throw InputError("parameter max_paths is " + std::to_string(max_paths_) + "; give 0 to 2000");
    }
    if (!config_file.empty()) config_ = loadAttributionConfig(config_file);
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
    scene_file_ = scene_file;
    watchdog_ = nh_.createWallTimer(ros::WallDuration(5), &AttributionNode::watch, this);
  }

 private:
  using MapMsg = mmradartwin_msgs::RangeAngleMap;

  void onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg) {
    try {
      radar_ = std::make_unique<RadarConfig>(fromMsg(*msg));
      radar_hash_ = radarHash(*msg);
      if (!scene_file_.empty()) setScene(loadScene(scene_file_, radar_->center_frequency_hz()));
      rebuild();
    } catch (const std::exception& error) {
      ROS_ERROR("radar/config: %s", error.what());
    }
  }

  void onScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
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

  void onSession(const mmradartwin_msgs::Session::ConstPtr& msg) { pose_names_ = posesByStamp(*msg); }

  void onPaths(const mmradartwin_msgs::PathRecords::ConstPtr& msg) { paths_ = msg; }

  void onMeasured(const MapMsg::ConstPtr& msg) { onMap(msg, measured_, simulated_, true); }
  void onSimulated(const MapMsg::ConstPtr& msg) { onMap(msg, simulated_, measured_, false); }

  void onMap(const MapMsg::ConstPtr& msg, std::map<std::int64_t, MapMsg::ConstPtr>& own,
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

  void setScene(Scene scene) {
    regions_.reset();
    rays_.reset();
    scene_ = std::make_unique<Scene>(std::move(scene));
    rays_ = std::make_unique<RayCaster>(*scene_);
    scene_due_ = true;
    publishScene();
  }

  // The latched scene reaches a viewer at once, and is lost to it where tf does not yet reach: rviz drops markers that
  // it cannot place. So each viewer gets it once more when tf has been there for a pair of maps.
  void onSceneViewer() { scene_viewer_since_ = ros::WallTime::now(); }

  void publishScene() {
    const ros::WallTime now = ros::WallTime::now();
    if (!scene_ || !scene_due_ || (now - scene_published_).toSec() < 2) return;
    scene_markers_.publish(sceneMarkers(*scene_, frames_.map));
    scene_published_ = now;
    scene_due_ = false;
  }

  // Everything that depends on radar and scene.
  void rebuild() {
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
  void beginAnew() {
    live_ledger_ = LiveLedger();
    publishLedger(ros::Time::now());
    if (const MapMsg::ConstPtr measured = last_measured_) onMeasured(measured);
    ROS_INFO("another twin is simulated: the ledger begins anew");
  }

  void publishLedger(const ros::Time& stamp) {
    mmradartwin_msgs::Ledger ledger = toMsg(live_ledger_.summary(), live_ledger_.duplicates());
    ledger.header.stamp = stamp;
    ledger.header.frame_id = radar_frame_;
    ledger_.publish(ledger);
  }

  const std::vector<ResponseRegion>& regionsAt(const Eigen::Isometry3d& T) {
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

  void compare(const MapMsg& measured_msg, const MapMsg& simulated_msg) {
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

  std::string nameAt(std::int64_t stamp_ns) const {
    auto after = pose_names_.upper_bound(stamp_ns);
    return after == pose_names_.begin() ? formatStamp(stamp_ns) : std::prev(after)->second;
  }

  void watch(const ros::WallTimerEvent&) {
    publishScene();
    if (pairs_ == pairs_before_ && received_ != received_before_) {
      ROS_WARN("no pair of maps in 5 s: %zu measured and %zu simulated wait for a counterpart of the same stamp",
               measured_.size(), simulated_.size());
    }
    pairs_before_ = pairs_;
    received_before_ = received_;
  }

  ros::NodeHandle nh_, private_nh_;
  AttributionConfig config_;
  MarkerFrames frames_;
  std::string radar_frame_, scene_file_, twin_yaml_;
  double markers_hz_ = 2;
  int max_paths_ = 200;
  ros::Publisher residuals_, ledger_, markers_, scene_markers_;
  std::vector<ros::Subscriber> subscribers_;
  ros::WallTimer watchdog_;
  ros::WallTime last_markers_, scene_published_, scene_viewer_since_;  // zero: never, nobody new
  bool scene_due_ = false;
  std::uint32_t had_subscribers_ = 0;
  std::size_t pairs_ = 0, pairs_before_ = 0, received_ = 0, received_before_ = 0;

  std::map<std::int64_t, MapMsg::ConstPtr> measured_, simulated_;  // waiting, by stamp
  MapMsg::ConstPtr last_measured_;                                 // of the last pair
  mmradartwin_msgs::PathRecords::ConstPtr paths_, records_of_;
  std::vector<PathRecord> records_;
  std::map<std::int64_t, std::string> pose_names_;

  std::unique_ptr<RadarConfig> radar_;
  std::uint64_t radar_hash_ = 0;
  std::unique_ptr<Scene> scene_;
  std::unique_ptr<RayCaster> rays_;
  std::unique_ptr<EvaluationField> field_;
  std::unique_ptr<RegionModel> regions_;
  std::unique_ptr<MarkerBuilder> builder_;
  std::vector<ResponseRegion> regions_of_pose_;
  Eigen::Isometry3d regions_T_ = Eigen::Isometry3d::Identity();
  bool regions_valid_ = false;
  LiveLedger live_ledger_;
};

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "attribution");
  const ros::NodeHandle keep_alive;  // outlives the node: with the last handle gone, roscpp prints nothing any more
  try {
    AttributionNode node;
    const mmradartwin::MasterWatch master_watch;
    ros::spin();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL("%s", error.what());
    return 2;
  }
  return 0;
}
