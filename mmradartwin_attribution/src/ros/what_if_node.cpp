#include "mmradartwin_attribution/ros/what_if_node.h"

#include <mmradartwin_msgs/Residuals.h>
#include <mmradartwin_msgs/WhatIf.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>
#include <visualization_msgs/InteractiveMarkerUpdate.h>
#include <visualization_msgs/MarkerArray.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>

#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_attribution/ros/left_behind_folder.h"
#include "mmradartwin_attribution/ros/markers.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/output.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_sim/plugin.h"
#include "ros/what_if_messages.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr double kLook_s = 0.01;

/// Whether a scene was unpacked from a bag, by this process or another.
bool isTemporary(const std::string& file) {
  const fs::path rest = fs::path(file).lexically_normal().lexically_relative(fs::temp_directory_path());
  return !rest.empty() && rest.begin()->string().rfind("mmradartwin_tmp_", 0) == 0;
}

double millisecondsSince(const ros::WallTime& begin) { return (ros::WallTime::now() - begin).toSec() * 1e3; }

}  // namespace

WhatIfNode::WhatIfNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh)
    : nh_(std::move(nh)), settings_(readSettings<Settings>(private_nh)) {
  loadMechanismPlugins(settings_.plugins, "parameter plugins");
  if (!settings_.config_file.empty()) config_ = loadAttributionConfig(settings_.config_file);
  if (!settings_.radar_file.empty()) radar_ = loadRadarConfig(settings_.radar_file);
  map_ = nh_.advertise<MapMsg>("what_if/range_angle", 2, true);
  residual_map_ = nh_.advertise<MapMsg>("what_if/residual_map", 2, true);
  residuals_ = nh_.advertise<mmradartwin_msgs::Residuals>("what_if/residuals", 2, true);
  state_ = nh_.advertise<mmradartwin_msgs::WhatIf>("what_if/state", 2, true);
  scene_markers_ = nh_.advertise<visualization_msgs::MarkerArray>("what_if/scene_markers", 1, true);
  handles_ = std::make_unique<ActorHandles>(nh_.resolveName("what_if/handles"), settings_.map_frame,
                                            [this](const HandleMove& move) { onHandle(move); });
  services_.push_back(nh_.advertiseService("what_if/edit", &WhatIfNode::onEdit, this));
  services_.push_back(nh_.advertiseService("what_if/undo", &WhatIfNode::onUndo, this));
  services_.push_back(nh_.advertiseService("what_if/revert", &WhatIfNode::onRevert, this));
  services_.push_back(nh_.advertiseService("what_if/save", &WhatIfNode::onSave, this));
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh_, private_nh, ros::this_node::getName());
  updater_->setHardwareID("none");
  updater_->add("what_if", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  diagnostics_timer_ = nh_.createWallTimer(ros::WallDuration(kDiagnosticsEvery_s),
                                           [this](const ros::WallTimerEvent&) { updater_->force_update(); });
  timer_ = nh_.createWallTimer(ros::WallDuration(kLook_s), &WhatIfNode::onTimer, this);
  begin();
  if (settings_.radar_file.empty()) {
    subscribers_.push_back(nh_.subscribe("radar/config", 1, &WhatIfNode::onRadar, this));
  }
  if (settings_.twin_file.empty()) {
    subscribers_.push_back(nh_.subscribe("twin/scene", 1, &WhatIfNode::onScene, this));
  }
  subscribers_.push_back(nh_.subscribe("session", 1, &WhatIfNode::onSession, this));
  measured_subscriber_ = nh_.subscribe("radar/range_angle", 2, &WhatIfNode::onMeasured, this);
}

WhatIfNode::Settings::Settings(StrictParameters& parameters) {
  plugins = parameters.text("plugins", "", "libraries with further mechanisms, with colons between");
  config_file = parameters.existingPath("config", "attribution.yaml: thresholds and windows; empty: the defaults");
  results_folder = parameters.existingPath(
      "results", "folder that evaluate wrote, whose twin, radar and thresholds are taken; empty: none");
  twin_file = parameters.existingPath("twin", "twin.yaml, the twin as given; empty: the one that twin/scene tells");
  scene_file = parameters.existingPath("scene", "scene.yaml for a `twin` that names none");
  radar_file = parameters.existingPath("radar", "radar.yaml; empty: radar/config tells");
  output_folder = parameters.path("output", "folder of saved twins; empty: mmradartwin in ROS_HOME");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  radar_frame = parameters.text("radar_frame", "radar_link", "tf frame of the radar");
  rate_hz =
      parameters.number("rate_hz", 5, 0.1, 100, "comparisons with new measured maps, Hz; a change is shown at once");
  seed = static_cast<std::uint64_t>(parameters.integer("seed", 1, 0, 2147483647, "of everything that is drawn"));
  parameters.baseFolder();
  parameters.ofDiagnosticUpdater();
  if (results_folder.empty()) return;
  const auto ofResults = [this](std::string& file, const char* name) {
    const std::string path = results_folder + "/" + name;
    if (file.empty() && (fs::exists(path) || std::string(name) == "twin.yaml")) file = path;
  };
  ofResults(config_file, "attribution.yaml");
  ofResults(radar_file, "radar.yaml");
  ofResults(twin_file, "twin.yaml");
}

NodeDescription WhatIfNode::description() {
  return {
      "what_if_node",
      "what_if",
      "Simulates a twin that is changed by hand at the pose of the last measured map, beside the twin as given.",
      {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
       topic<mmradartwin_msgs::Session>("session", "names of the recorded poses; latched"),
       topic<mmradartwin_msgs::Scene>("twin/scene", "scene and twin as given; latched"),
       topic<MapMsg>("radar/range_angle", "measured map"),
       topic<visualization_msgs::InteractiveMarkerFeedback>("what_if/handles/feedback", "actors drawn in rviz")},
      {topic<MapMsg>("what_if/range_angle", "simulated map of the changed twin; latched"),
       topic<MapMsg>("what_if/residual_map", "simulated - measured; latched"),
       topic<mmradartwin_msgs::Residuals>("what_if/residuals", "what differs; latched"),
       topic<mmradartwin_msgs::WhatIf>("what_if/state", "what can be changed, what was, and numbers; latched"),
       topic<visualization_msgs::MarkerArray>("what_if/scene_markers", "the scene as it is tried, for rviz; latched"),
       topic<visualization_msgs::InteractiveMarkerUpdate>("what_if/handles/update", "handles of actors for rviz"),
       topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "whether it can be tried, and why not")},
      {service<Edit>("what_if/edit", "change the twin"),
       service<std_srvs::Trigger>("what_if/undo", "take the last change back"),
       service<std_srvs::Trigger>("what_if/revert", "back to the twin as given"),
       service<mmradartwin_msgs::SaveTwin>("what_if/save", "write the changed twin")},
      [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void WhatIfNode::onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg) {
  try {
    const RadarConfig radar = fromMsg(*msg);
    if (radar_ && radarHash(radar) == radarHash(*radar_)) return;
    radar_ = radar;
    begin();
  } catch (const std::exception& error) {
    ROS_ERROR("radar/config: %s", error.what());
  }
}

void WhatIfNode::onScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
  if (scene_ && scene_->scene_file == msg->scene_file && scene_->twin_yaml == msg->twin_yaml) return;
  scene_ = msg;
  begin();
}

void WhatIfNode::onSession(const mmradartwin_msgs::Session::ConstPtr& msg) {
  pose_names_.clear();
  for (const auto& file : msg->files) {
    if (file.name != "poses.csv") continue;
    try {
      const PoseTable table = parsePoses(std::string(file.data.begin(), file.data.end()), "poses.csv");
      for (const Pose& pose : table.poses) pose_names_[pose.stamp_ns] = pose.name;
    } catch (const std::exception& error) {
      ROS_WARN("session: %s", error.what());
    }
  }
}

void WhatIfNode::forget() {
  comparison_.reset();
  what_if_.reset();
  handles_->clear();
  compared_ = false;
}

void WhatIfNode::begin() {
  if (!radar_) {
    problem_ = "waiting for radar/config";
    return publishState();
  }
  if (settings_.twin_file.empty() && !scene_) {
    problem_ = "waiting for twin/scene: look at the twin";
    return publishState();
  }
  const bool had_edits = what_if_ && !what_if_->edits().empty();
  forget();
  try {
    TwinDescription given;
    if (!settings_.twin_file.empty()) {
      if (!fs::exists(settings_.twin_file)) {
        throw InputError(settings_.twin_file + ": is not there: the simulated side of these results was a recording");
      }
      std::optional<std::string> scene;
      if (!settings_.scene_file.empty()) scene = settings_.scene_file;
      given = loadTwin(settings_.twin_file, scene, *radar_);
    } else {
      if (!fs::exists(scene_->scene_file)) {
        throw InputError(scene_->scene_file +
                         ": the scene that is simulated is not on this machine; run what_if_node "
                         "where the twin runs");
      }
      const TemporaryFolder folder;
      const std::string file = folder.path() + "/twin.yaml";
      std::ofstream(file, std::ios::binary) << scene_->twin_yaml;
      given = loadTwin(file, scene_->scene_file, *radar_);
      given.scene_file = scene_->scene_file;
      given.file.clear();
    }
    what_if_ = std::make_unique<WhatIf>(std::move(given), settings_.seed);
    comparison_ = std::make_unique<WhatIfComparison>(*what_if_, config_);
    radar_hash_ = radarHash(what_if_->given().radar());
    problem_.clear();
    if (had_edits) ROS_INFO("another twin is given: what was tried with the one before is gone");
    handles_->show(*what_if_);
    publishScene();
    show(true);
  } catch (const std::exception& error) {
    forget();
    problem_ = error.what();
    ROS_ERROR("no twin to try: %s", error.what());
    publishState();
  }
}

WhatIf& WhatIfNode::whatIf() {
  if (!what_if_) throw InputError(problem_.empty() ? "there is no twin yet" : problem_);
  return *what_if_;
}

void WhatIfNode::onMeasured(const MapMsg::ConstPtr& msg) {
  heard_.heard();
  if (!usableStamp(msg->header.stamp)) return;
  measured_ = msg;
  pending_ = true;
}

void WhatIfNode::onTimer(const ros::WallTimerEvent&) {
  if (move_) moveByHandle();
  if (!pending_ || !what_if_) return;
  if ((ros::WallTime::now() - shown_at_).toSec() < 1 / settings_.rate_hz) return;
  const bool seen = map_.getNumSubscribers() + residual_map_.getNumSubscribers() + residuals_.getNumSubscribers() +
                        state_.getNumSubscribers() >
                    0;
  if (!seen && what_if_->edits().empty()) return;
  show(false);
}

void WhatIfNode::show(bool changed) {
  if (!comparison_) return publishState();
  if (!measured_) {
    problem_ = "waiting for a measured map (radar/range_angle)";
    return publishState();
  }
  try {
    if (pending_ || !compared_ || !comparison_->hasMeasured()) comparison_->setMeasured(fromMsg(*measured_));
    pending_ = false;
    comparison_->given();
    const ComparedTwin& now = comparison_->now();
    const Eigen::Isometry3d T = comparison_->measured().T_map_radar;
    MapMsg map = toMsg(now.map, radar_hash_);
    map.header = measured_->header;
    map.header.frame_id = settings_.radar_frame;
    map_.publish(map);
    MapMsg difference = residualMapMsg(comparison_->field(), now.attribution, T);
    difference.header = map.header;
    difference.radar_hash = radar_hash_;
    difference.frames = measured_->frames;
    residual_map_.publish(difference);
    const auto name = pose_names_.upper_bound(toNanoseconds(measured_->header.stamp));
    mmradartwin_msgs::Residuals residuals =
        toMsg(comparison_->field(), now.attribution, name == pose_names_.begin() ? "" : std::prev(name)->second, T);
    residuals.header = map.header;
    residuals_.publish(residuals);
    compared_ = true;
    problem_.clear();
  } catch (const std::exception& error) {
    pending_ = false;
    compared_ = false;
    problem_ = error.what();
    ROS_WARN_THROTTLE(5, "%s", error.what());
  }
  shown_at_ = ros::WallTime::now();
  if (changed && !edited_at_.isZero()) shown_ms_ = millisecondsSince(edited_at_);
  publishState();
}

void WhatIfNode::publishState() {
  mmradartwin_msgs::WhatIf msg;
  msg.problem = problem_;
  msg.given = msg.now = noNumbers();
  msg.T_map_radar.orientation.w = 1;
  if (measured_) msg.header = measured_->header;
  msg.header.frame_id = settings_.radar_frame;
  if (what_if_) {
    describe(*what_if_, msg);
    msg.traced = what_if_->work().traces();
  }
  if (compared_) {
    const auto name = pose_names_.upper_bound(toNanoseconds(measured_->header.stamp));
    msg.pose = name == pose_names_.begin() ? "" : std::prev(name)->second;
    msg.T_map_radar = mmradartwin::toMsg(comparison_->measured().T_map_radar);
    msg.given = toMsg(comparison_->given().numbers);
    msg.now = toMsg(comparison_->last().numbers);
    msg.simulated_ms = changed_ms_ + comparison_->simulated_ms();
    msg.shown_ms = shown_ms_;
  }
  state_.publish(msg);
}

void WhatIfNode::publishScene() {
  scene_markers_.publish(sceneMarkers(what_if_->now().tracedScene(), settings_.map_frame));
}

void WhatIfNode::apply(const Edit::Request& r) {
  WhatIf& twin = whatIf();
  if (r.continues) twin.continueLast();
  const Eigen::Vector3d shift(r.shift_m[0], r.shift_m[1], r.shift_m[2]);
  switch (r.kind) {
    case Edit::Request::MATERIAL:
      return twin.setMaterial(r.actor, r.material);
    case Edit::Request::MATERIAL_VALUE:
      return r.actor.empty() ? twin.setMaterialValue(r.material, r.key, r.value)
                             : twin.setActorMaterialValue(r.actor, r.key, r.value);
    case Edit::Request::MOVE:
      return twin.moveActor(r.actor, shift, r.yaw_deg);
    case Edit::Request::HIDE:
      return twin.hideActor(r.actor, r.enabled);
    case Edit::Request::MECHANISM:
      return twin.switchMechanism(r.mechanism, r.entry, r.enabled, r.actor.empty() ? r.material : r.actor);
    case Edit::Request::PARAMETER:
      return twin.setParameter(r.mechanism, r.entry, r.key, r.value);
    case Edit::Request::RADAR:
      return twin.placeRadar(shift.x(), shift.y(), r.yaw_deg, r.pitch_deg);
    default:
      throw InputError("no kind of change is " + std::to_string(r.kind));
  }
}

bool WhatIfNode::onEdit(Edit::Request& request, Edit::Response& response) {
  edited_at_ = ros::WallTime::now();
  try {
    apply(request);
    changed_ms_ = millisecondsSince(edited_at_);
    ++edits_;
    show(true);
    const bool of_scene = request.kind == Edit::Request::MATERIAL || request.kind == Edit::Request::MOVE ||
                          request.kind == Edit::Request::HIDE;
    if (of_scene) publishScene();
    if (request.kind == Edit::Request::MOVE) handles_->place(*what_if_);
    response.success = true;
    const std::vector<std::string> edits = what_if_->edits();
    response.message = edits.empty() ? "" : edits.back();
  } catch (const std::exception& error) {
    ++refused_;
    response.success = false;
    response.message = std::string("refused: ") + error.what();
    publishState();  // knobs go back
  }
  return true;
}

void WhatIfNode::onHandle(const HandleMove& move) {
  // They come faster than they can be shown: of one drag the newest counts.
  const bool same_drag = move_ && move.continues && move_->actor == move.actor;
  const bool continues = same_drag ? move_->continues : move.continues;
  if (move_ && !same_drag) moveByHandle();
  move_ = move;
  move_->continues = continues;
}

void WhatIfNode::moveByHandle() {
  const HandleMove move = *std::exchange(move_, std::nullopt);
  Edit::Request request;
  request.kind = Edit::Request::MOVE;
  request.actor = move.actor;
  for (std::size_t i = 0; i < 3; ++i) request.shift_m[i] = move.shift_m[static_cast<Eigen::Index>(i)];
  request.yaw_deg = move.yaw_deg;
  request.continues = move.continues;
  Edit::Response response;
  onEdit(request, response);
  if (!response.success) ROS_WARN("%s", response.message.c_str());
}

bool WhatIfNode::goBack(bool (WhatIf::*how)(), const std::string& done, std_srvs::Trigger::Response& response) {
  edited_at_ = ros::WallTime::now();
  try {
    response.success = (whatIf().*how)();
    response.message = response.success ? done : "nothing was changed";
    show(true);
    publishScene();
    handles_->place(*what_if_);
  } catch (const std::exception& error) {
    response.success = false;
    response.message = error.what();
  }
  return true;
}

bool WhatIfNode::onUndo(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  return goBack(&WhatIf::undo, "the last change is taken back", response);
}

bool WhatIfNode::onRevert(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
  return goBack(&WhatIf::revert, "the twin is as it was given", response);
}

bool WhatIfNode::onSave(mmradartwin_msgs::SaveTwin::Request& request, mmradartwin_msgs::SaveTwin::Response& response) {
  try {
    const WhatIf& twin = whatIf();
    if (!request.folder.empty() && request.folder.front() != '/') {
      throw InputError("folder '" + request.folder + "': give an absolute path, or none");
    }
    const fs::path below = settings_.output_folder.empty() ? leftBehindFolder() : fs::path(settings_.output_folder);
    const std::string folder = request.folder.empty() ? (below / nameWithTime("what_if")).string() : request.folder;
    const std::string& scene = twin.given().description().scene_file;
    Output output = Output::folder({folder, static_cast<bool>(request.overwrite)}, {scene}, "twin.yaml");
    std::string names;
    for (const std::string& file : twin.save(output.path(), isTemporary(scene))) {
      names += (names.empty() ? "" : ", ") + file;
    }
    output.complete();
    response.twin_file = output.place() + "/twin.yaml";
    response.success = true;
    response.message = "saved in " + output.place() + ": " + names;
    ROS_INFO("%s", response.message.c_str());
  } catch (const std::exception& error) {
    response.success = false;
    response.message = std::string("not saved: ") + Output::namedIn(error.what());
    ROS_ERROR("%s", response.message.c_str());
  }
  return true;
}

void WhatIfNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const std::string silence = heard_.silence(measured_subscriber_);
  if (!what_if_) {
    status.summary(Level::WARN, problem_);
  } else if (!silence.empty()) {
    status.summary(Level::WARN, silence);
  } else if (!problem_.empty()) {
    status.summary(Level::WARN, problem_);
  } else {
    status.summary(Level::OK, what_if_->edits().empty() ? "as given" : "changed by hand");
  }
  status.add("changes made", edits_);
  status.add("changes refused", refused_);
  status.add("last change to maps [ms]", shown_ms_);
}

}  // namespace mmradartwin
