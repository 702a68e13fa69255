#include "mmradartwin_attribution/ros/attribution_node.h"

#include <dynamic_reconfigure/Reconfigure.h>
#include <mmradartwin_msgs/DetectionAgreement.h>
#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/Residuals.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <utility>

#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_doppler.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/point_cloud.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

constexpr double kSlow_s = 2;  // what takes longer is told
constexpr std::int64_t kWentBack_ns = 1'000'000'000;
constexpr std::size_t kMaxWaiting = 64;  // maps that wait for their counterpart
constexpr const char* kTuning = "tuning";

/// The thresholds among what is tuned, and all else of `config`.
AttributionConfig withThresholds(AttributionConfig config, const TuningConfig& tuned) {
  config.strong_db = tuned.strong_db;
  config.medium_db = tuned.medium_db;
  config.weak_db = tuned.weak_db;
  config.response_margin_db = tuned.response_margin_db;
  return config;
}

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

AttributionNode::AttributionNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh)
    : nh_(std::move(nh)), settings_([&private_nh] {
        private_nh.deleteParam(kTuning);  // of an earlier run
        return readSettings<Settings>(private_nh);
      }()) {
  if (!settings_.config_file.empty()) config_ = loadAttributionConfig(settings_.config_file);
  residuals_ = nh_.advertise<mmradartwin_msgs::Residuals>("attribution/residuals", 10);
  residual_map_ = {nh_, "attribution/residual_map", 10};
  pose_figures_ = nh_.advertise<mmradartwin_msgs::PoseFigures>("attribution/pose", 10);
  ledger_ = nh_.advertise<mmradartwin_msgs::Ledger>("attribution/ledger", 1, true);
  markers_ = nh_.advertise<visualization_msgs::MarkerArray>("attribution/markers", 2);
  scene_markers_ = nh_.advertise<visualization_msgs::MarkerArray>(
      "attribution/scene_markers", 1, [this](const ros::SingleSubscriberPublisher&) { onSceneViewer(); },
      ros::SubscriberStatusCallback(), ros::VoidConstPtr(), true);
  detections_ = std::make_unique<DetectionPublisher>(nh_, settings_.detections);
  why_ = std::make_unique<WhyServer>(nh_, settings_.map_frame);
  subscribers_.push_back(nh_.subscribe("radar/config", 1, &AttributionNode::onRadar, this));
  subscribers_.push_back(nh_.subscribe("session", 1, &AttributionNode::onSession, this));
  subscribers_.push_back(nh_.subscribe("twin/paths", 10, &AttributionNode::onPaths, this));
  measured_subscriber_ = nh_.subscribe("radar/range_angle", 50, &AttributionNode::onMeasured, this);
  simulated_subscriber_ = nh_.subscribe("twin/range_angle", 50, &AttributionNode::onSimulated, this);
  subscribeToPoints();
  subscribers_.push_back(nh_.subscribe("twin/scene", 1, &AttributionNode::onScene, this));
  subscribers_.push_back(nh_.subscribe("twin/moved_scene", 1, &AttributionNode::onMovedScene, this));
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh_, private_nh, ros::this_node::getName());
  updater_->setHardwareID("none");
  updater_->add("attribution", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  diagnostics_timer_ = nh_.createWallTimer(ros::WallDuration(kDiagnosticsEvery_s),
                                           [this](const ros::WallTimerEvent&) { updater_->force_update(); });
  watchdog_ = nh_.createWallTimer(ros::WallDuration(5), &AttributionNode::watch, this);
  startTuning(private_nh);
}

AttributionNode::Settings::Settings(StrictParameters& parameters) {
  config_file = parameters.existingPath("config", "attribution.yaml: thresholds and windows; empty: the defaults");
  scene_file = parameters.existingPath("scene", "scene.yaml; empty: the scene of twin/scene");
  radar_frame = parameters.text("radar_frame", "radar_link", "tf frame of the radar");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  markers_hz = parameters.number("markers_hz", 2, 1e-3, 100, "markers and ledgers come so often at most, Hz");
  max_paths = parameters.integer("max_paths", 60, 0, 2000, "strongest paths that are shown");
  detections = DetectionPublisher::Settings(parameters);
  parameters.ofDiagnosticUpdater();
}

NodeDescription AttributionNode::description() {
  return {
      "attribution_node",
      "attribution",
      "Compares measured and simulated maps of one stamp, and names what lies behind each difference.",
      {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
       topic<mmradartwin_msgs::Session>("session", "names of the recorded poses; latched"),
       topic<mmradartwin_msgs::Scene>("twin/scene", "scene and twin that are simulated; latched"),
       topic<mmradartwin_msgs::Scene>("twin/moved_scene", "the scene with actors where they are simulated; latched"),
       topic<mmradartwin_msgs::PathRecords>("twin/paths", "paths of the simulation"),
       topic<mmradartwin_msgs::RangeAngleMap>("radar/range_angle", "measured map"),
       topic<sensor_msgs::PointCloud2>("radar/points", "what moves in it, where frames tell speeds"),
       topic<mmradartwin_msgs::RangeAngleMap>("twin/range_angle", "simulated map"),
       topic<geometry_msgs::PointStamped>("clicked_point", "a place to explain, in map or in the radar's frame")},
      {topic<mmradartwin_msgs::Residuals>("attribution/residuals", "what differs in a pair of maps"),
       topic<MapMsg>("attribution/residual_map", "the difference itself, simulated - measured, as a map"),
       topic<sensor_msgs::Image>("attribution/residual_map/image", "the same as a picture: dB, a row per range bin"),
       topic<mmradartwin_msgs::PoseFigures>("attribution/pose", "how well both maps of a pair agree"),
       topic<mmradartwin_msgs::Ledger>("attribution/ledger", "metrics over all poses so far; latched"),
       topic<visualization_msgs::MarkerArray>("attribution/markers",
                                              "the radar, boxes on the floor and paths for rviz"),
       topic<visualization_msgs::MarkerArray>("attribution/scene_markers", "the scene for rviz; latched"),
       topic<mmradartwin_msgs::Explanation>("attribution/explanation",
                                            "what stands behind the place that was asked for; latched"),
       topic<visualization_msgs::MarkerArray>("attribution/explanation_markers",
                                              "that place, its actor and paths for rviz; latched"),
       topic<sensor_msgs::PointCloud2>("twin/points", "what CFAR detects in the simulated map"),
       topic<mmradartwin_msgs::DetectionAgreement>("attribution/detection_agreement",
                                                   "how that agrees with what it detects in the measured map"),
       topic<dynamic_reconfigure::ConfigDescription>("~tuning/parameter_descriptions",
                                                     "what can be tuned by eye; latched"),
       topic<dynamic_reconfigure::Config>("~tuning/parameter_updates", "what it is tuned to; latched"),
       topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "whether maps come and are compared, and why not")},
      {service<mmradartwin_msgs::Why>("attribution/why", "what stands behind a place"),
       service<dynamic_reconfigure::Reconfigure>("~tuning/set_parameters", "changes what is tuned by eye")},
      [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void AttributionNode::startTuning(const ros::NodeHandle& private_nh) {
  tuned_.max_paths = settings_.max_paths;
  tuned_.markers_hz = settings_.markers_hz;
  tuned_.strong_db = config_.strong_db;
  tuned_.medium_db = config_.medium_db;
  tuned_.weak_db = config_.weak_db;
  tuned_.response_margin_db = config_.response_margin_db;
  tuning_ =
      std::make_unique<dynamic_reconfigure::Server<TuningConfig>>(tuning_mutex_, ros::NodeHandle(private_nh, kTuning));
  tuning_->updateConfig(tuned_);
  tuning_->setCallback([this](TuningConfig& wanted, std::uint32_t) { onTuning(wanted); });
}

void AttributionNode::onTuning(TuningConfig& wanted) {
  const AttributionConfig config = withThresholds(config_, wanted);
  if (const Contradiction found = contradictionIn(config); !found.key.empty()) {
    ROS_ERROR("tuning refused: %s %s", found.key.c_str(), found.why.c_str());
    wanted = tuned_;  // the answer tells what stays
    return;
  }
  tuned_ = wanted;
  if (builder_) builder_->setMaxPaths(tuned_.max_paths);
  if (toYaml(config) != toYaml(config_)) {
    config_ = config;
    rebuild();
    live_ledger_ = LiveLedger();
    ROS_INFO("the comparison has other thresholds: the ledger begins anew");
  }
  compareLastPair();
}

void AttributionNode::compareLastPair() {
  if (!last_measured_ || !last_simulated_) return;
  last_markers_ = ros::WallTime();  // to be shown at once
  try {
    compare(*last_measured_, *last_simulated_);
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(5, "the last maps: %s", error.what());
  }
}

void AttributionNode::onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg) {
  try {
    radar_ = std::make_unique<RadarConfig>(fromMsg(*msg));
    radar_hash_ = radarHash(*msg);
    detections_->setRadar(*radar_);
    followMovers();
    if (!settings_.scene_file.empty()) {
      setScene(loadScene(settings_.scene_file, radar_->center_frequency_hz()));
      scene_due_ = true;
      publishScene();
    }
    rebuild();
  } catch (const std::exception& error) {
    ROS_ERROR("radar/config: %s", error.what());
  }
}

void AttributionNode::onScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
  try {
    if (settings_.scene_file.empty()) {
      const ros::WallTime begin = ros::WallTime::now();
      announce("reading the scene of " + msg->scene_file);
      scene_stamp_ = msg->header.stamp;
      Scene scene = actorsFromMsg(*msg);
      // It is seen before it is understood.
      scene_markers_.publish(sceneMarkers(scene, settings_.map_frame));
      rebuildFacets(scene);
      setScene(std::move(scene));
      rebuild();
      announceEnd(begin);
    }
    if (!twin_yaml_.empty() && msg->twin_yaml != twin_yaml_) beginAnew();
    twin_yaml_ = msg->twin_yaml;
  } catch (const std::exception& error) {
    ROS_ERROR("twin/scene: %s", error.what());
  }
}

void AttributionNode::onMovedScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
  try {
    moved_scene_ = std::make_unique<Scene>(actorsFromMsg(*msg));  // it is shown alone
    moved_scene_stamp_ = msg->header.stamp;
    scene_due_ = true;
    publishScene();
  } catch (const std::exception& error) {
    ROS_ERROR("twin/moved_scene: %s", error.what());
  }
}

void AttributionNode::onSession(const mmradartwin_msgs::Session::ConstPtr& msg) {
  try {
    pose_names_ = posesByStamp(*msg);
  } catch (const std::exception& error) {
    pose_names_.clear();
    ROS_WARN("session: %s", error.what());
  }
}

void AttributionNode::onPaths(const mmradartwin_msgs::PathRecords::ConstPtr& msg) { paths_ = msg; }

void AttributionNode::onMeasured(const MapMsg::ConstPtr& msg) { onMap(msg, measured_, simulated_, true); }

void AttributionNode::onSimulated(const MapMsg::ConstPtr& msg) { onMap(msg, simulated_, measured_, false); }

void AttributionNode::followMovers() {
  movers_ = std::make_unique<MoverMask>(*radar_);
  // Where nothing moves in them, points are for others.
  points_subscriber_.shutdown();
  if (whyNoSpeeds(*radar_).empty()) subscribeToPoints();
}

void AttributionNode::subscribeToPoints() {
  points_subscriber_ = nh_.subscribe("radar/points", 50, &AttributionNode::onPoints, this);
}

void AttributionNode::onPoints(const sensor_msgs::PointCloud2::ConstPtr& msg) {
  if (!field_ || !movers_ || !usableStamp(msg->header.stamp)) return;
  try {
    movers_->add(toNanoseconds(msg->header.stamp), fromCloud(*msg, field_->axes()));
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(5, "radar/points: %s", error.what());
  }
}

void AttributionNode::onMap(const MapMsg::ConstPtr& msg, std::map<std::int64_t, MapMsg::ConstPtr>& own,
                            std::map<std::int64_t, MapMsg::ConstPtr>& other, bool measured) {
  (measured ? measured_heard_ : simulated_heard_).heard();
  if (!usableStamp(msg->header.stamp)) {
    ROS_WARN_THROTTLE(5, "map refused: its stamp, %u s, is no time", msg->header.stamp.sec);
    return;
  }
  if (measured) ++received_;  // of a stream that has paused the twin goes on by itself
  const std::int64_t stamp = toNanoseconds(msg->header.stamp);
  if (measured && newest_ns_ && stamp < *newest_ns_ - kWentBack_ns) {
    ROS_INFO("stamps went back by %.1f s: waiting maps are forgotten, the ledger begins anew",
             static_cast<double>(*newest_ns_ - stamp) * 1e-9);
    measured_.clear();
    simulated_.clear();
    last_measured_.reset();
    last_simulated_.reset();
    live_ledger_ = LiveLedger();
    newest_ns_.reset();
  }
  if (measured) newest_ns_ = std::max(stamp, newest_ns_.value_or(stamp));
  // What is still on its way from before a jump back would stand before all that comes, and push it out.
  if (!measured && newest_ns_ && stamp > *newest_ns_ + kWentBack_ns) return;
  const auto match = other.find(stamp);
  if (match == other.end()) {
    own[stamp] = msg;
    while (own.size() > kMaxWaiting) own.erase(own.begin());
    return;
  }
  const MapMsg::ConstPtr sameInOtherList = match->second;
  other.erase(other.begin(), std::next(match));  // older ones will find no partner any more
  last_measured_ = measured ? msg : sameInOtherList;
  last_simulated_ = measured ? sameInOtherList : msg;
  try {
    problem_.clear();
    if (field_ && last_measured_->radar_hash == radar_hash_ && last_simulated_->radar_hash == radar_hash_) {
      detections_->publishPair(*field_, *last_measured_, *last_simulated_);
    }
    compare(measured ? *msg : *sameInOtherList, measured ? *sameInOtherList : *msg);
  } catch (const std::exception& error) {
    problem_ = error.what();
    ROS_WARN_THROTTLE(5, "maps of %s: %s", formatStamp(stamp).c_str(), error.what());
  }
}

void AttributionNode::setScene(Scene scene) {
  regions_.reset();
  rays_.reset();
  scene_ = std::make_shared<const Scene>(std::move(scene));
  rays_ = std::make_unique<RayCaster>(*scene_);
}

// The latched scene reaches a viewer at once, and is lost to it where tf does not yet reach: rviz drops markers that
// it cannot place. So each viewer gets it once more when tf has been there for a pair of maps.
void AttributionNode::onSceneViewer() { scene_viewer_since_ = ros::WallTime::now(); }

void AttributionNode::showSceneToNewViewer() {
  if (!scene_viewer_since_.isZero() && (ros::WallTime::now() - scene_viewer_since_).toSec() > 1) {
    scene_viewer_since_ = ros::WallTime();
    scene_due_ = true;
  }
  publishScene();
}

void AttributionNode::publishScene() {
  const ros::WallTime now = ros::WallTime::now();
  if (!scene_ || !scene_due_ || (now - scene_published_).toSec() < 2) return;
  const bool moved = moved_scene_ && moved_scene_stamp_ >= scene_stamp_;
  scene_markers_.publish(sceneMarkers(moved ? *moved_scene_ : *scene_, settings_.map_frame));
  scene_published_ = now;
  scene_due_ = false;
}

// Everything that depends on radar and scene.
void AttributionNode::rebuild() {
  if (!radar_) return;
  const SignalChain chain(*radar_);
  field_ = std::make_shared<const EvaluationField>(config_, *radar_, chain.axes());
  builder_ = std::make_unique<MarkerBuilder>(*field_, settings_.map_frame, tuned_.max_paths);
  slow_ = true;  // until it is known
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
  ledger.header.frame_id = settings_.radar_frame;
  ledger_.publish(ledger);
}

const std::vector<ResponseRegion>& AttributionNode::regionsAt(const Eigen::Isometry3d& T) {
  // A radar that stands keeps its regions.
  const bool same = regions_valid_ && (T.translation() - regions_at_.translation()).norm() < 1e-3 &&
                    (T.linear() - regions_at_.linear()).norm() < 1e-3;
  if (!same) {
    const ros::WallTime begin = ros::WallTime::now();
    if (slow_) announce("looking for the regions that the scene is expected to answer from");
    regions_of_pose_ = regions_->regions(T);
    slow_ = (ros::WallTime::now() - begin).toSec() > kSlow_s;
    announceEnd(begin);
    regions_at_ = T;
    regions_valid_ = true;
  }
  return regions_of_pose_;
}

void AttributionNode::compare(const MapMsg& measured_msg, const MapMsg& simulated_msg) {
  if (!field_ || !regions_) {
    problem_ =
        std::string("waiting for ") + (field_ ? "twin/scene: look at the twin" : "radar/config: look at the driver");
    ROS_WARN_THROTTLE(5, "%s", problem_.c_str());
    return;
  }
  if (measured_msg.radar_hash != radar_hash_) {
    problem_ = "radar/range_angle was made with another radar configuration than radar/config; left out";
    ROS_WARN_THROTTLE(5, "%s", problem_.c_str());
    return;
  }
  if (!measured_msg.pose_valid && !simulated_msg.pose_valid) {
    problem_ = "maps have no pose: is the radar's tf published?";
    ROS_WARN_THROTTLE(5, "no pose at %f; is the radar's tf published?", measured_msg.header.stamp.toSec());
    return;
  }
  RangeAngleMap measured = fromMsg(measured_msg);
  const RangeAngleMap simulated = fromMsg(simulated_msg);
  masked_cells_ = movers_->apply(*field_, measured);
  const Eigen::Isometry3d T = measured.pose_valid ? measured.T_map_radar : simulated.T_map_radar;
  // The records of this stamp; where none came for it, those of the same place (a standing radar re-uses them).
  if (paths_ && (paths_->header.stamp == simulated_msg.header.stamp ||
                 fromMsg(paths_->T_map_radar).isApprox(simulated.T_map_radar, 1e-6))) {
    if (paths_ != records_of_) {
      records_ = std::make_shared<std::vector<PathRecord>>(pathsFromMsg(*paths_, *scene_));
      records_of_ = paths_;
    }
  } else {
    records_ = std::make_shared<std::vector<PathRecord>>();
    records_of_.reset();
  }
  showSceneToNewViewer();
  PoseAttribution pose = attributePose(*field_, measured, simulated, regionsAt(T), *records_);
  const std::string name = nameAt(measured.stamp_ns);

  mmradartwin_msgs::Residuals residuals = toMsg(*field_, pose, name, T);
  residuals.header.stamp = measured_msg.header.stamp;
  residuals.header.frame_id = settings_.radar_frame;
  residuals_.publish(residuals);
  publishFigures(pose, residuals, T, measured_msg.frames);

  live_ledger_.add(measured.stamp_ns, T, name.empty() ? formatStamp(measured.stamp_ns) : name, measured.frames,
                   pose.central);
  const ros::WallTime now = ros::WallTime::now();
  if ((now - last_markers_).toSec() >= 1 / tuned_.markers_hz) {
    last_markers_ = now;
    publishLedger(residuals.header.stamp);
    if (markers_.getNumSubscribers() > 0) {
      if (had_subscribers_ == 0)
        builder_ = std::make_unique<MarkerBuilder>(*field_, settings_.map_frame, tuned_.max_paths);
      markers_.publish(builder_->build(pose, *records_, T, name));
    }
    had_subscribers_ = markers_.getNumSubscribers();
  }
  why_->setPose({residuals.header, name, T, std::move(pose), records_, field_, scene_});
  ++pairs_;
}

// What costs something and is for few.
void AttributionNode::publishFigures(const PoseAttribution& pose, const mmradartwin_msgs::Residuals& residuals,
                                     const Eigen::Isometry3d& T, std::uint32_t frames) {
  if (residual_map_.isWanted()) {
    const auto map = boost::make_shared<MapMsg>(residualMapMsg(*field_, pose, T));
    map->header = residuals.header;
    map->radar_hash = radar_hash_;
    map->frames = frames;
    residual_map_.publish(map);
  }
  if (pose_figures_.getNumSubscribers() > 0) {
    mmradartwin_msgs::PoseFigures figures = poseFiguresMsg(pose, residuals.pose);
    figures.header = residuals.header;
    pose_figures_.publish(figures);
  }
}

std::string AttributionNode::nameAt(std::int64_t stamp_ns) const {
  auto after = pose_names_.upper_bound(stamp_ns);
  return after == pose_names_.begin() ? "" : std::prev(after)->second;
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

void AttributionNode::announce(const std::string& work) {
  work_ = work;
  updater_->force_update();
}

void AttributionNode::announceEnd(const ros::WallTime& begin) {
  const double took_s = (ros::WallTime::now() - begin).toSec();
  if (!work_.empty() && took_s > kSlow_s) {
    ROS_INFO("%s took %.1f s; maps that came meanwhile are skipped", work_.c_str(), took_s);
  }
  work_.clear();
}

void AttributionNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const std::string no_measured = measured_heard_.silence(measured_subscriber_);
  const std::string no_simulated = simulated_heard_.silence(simulated_subscriber_);
  if (!work_.empty()) {
    status.summary(Level::WARN, "busy: " + work_);
  } else if (!no_measured.empty()) {
    status.summary(Level::ERROR, no_measured);
  } else if (!no_simulated.empty()) {
    status.summary(Level::ERROR, no_simulated);
  } else if (!problem_.empty()) {
    status.summary(Level::WARN, problem_);
  } else if (pairs_ == 0) {
    status.summary(Level::WARN, "no measured and simulated map of one stamp yet");
  } else {
    status.summary(Level::OK, "comparing");
  }
  status.add("pairs compared", pairs_);
  status.add("measured maps that wait", measured_.size());
  status.add("simulated maps that wait", simulated_.size());
  status.add("cells left out for what moves", masked_cells_);
  status.add("actors of the scene", scene_ ? scene_->actors.size() : 0);
}

}  // namespace mmradartwin
