#include "mmradartwin_sim/ros/twin_node.h"

#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/Scene.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/ros/conversions.h"

namespace mmradartwin {
namespace {

constexpr double kWarnEvery_s = 5;
constexpr double kMeasuredFor_s = 1;  // without a grid for so long the twin goes on at its own rate

}  // namespace

TwinNode::TwinNode(ros::NodeHandle nh, ros::NodeHandle private_nh) {
  readParameters(private_nh);
  tf_listener_.emplace(tf_buffer_, nh);
  tf_watch_.emplace(nh);
  grid_publisher_ = nh.advertise<mmradartwin_msgs::ReceiveGrid>("twin/grid", 100);  // as many as may wait
  paths_publisher_ = nh.advertise<mmradartwin_msgs::PathRecords>("twin/paths", 1, true);
  scene_publisher_ = nh.advertise<mmradartwin_msgs::Scene>("twin/scene", 1, true);
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh, private_nh);
  updater_->setHardwareID("none");
  updater_->add("twin", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  if (!radar_file_.empty()) radar_ = loadRadarConfig(resolvePath(radar_file_, "/"));
  config_subscriber_ = nh.subscribe("radar/config", 1, &TwinNode::onConfig, this);
  session_subscriber_ = nh.subscribe("session", 1, &TwinNode::onSession, this);
  grid_subscriber_ = nh.subscribe("radar/grid", 100, &TwinNode::onGrid, this);
  apply_service_ = nh.advertiseService("twin/apply", &TwinNode::onApply, this);
  pending_timer_ = nh.createWallTimer(ros::WallDuration(0.005), &TwinNode::onPending, this);
  if (rate_hz_ > 0) rate_timer_ = nh.createWallTimer(ros::WallDuration(1 / rate_hz_), &TwinNode::onRate, this);
  diagnostics_timer_ =
      nh.createWallTimer(ros::WallDuration(1), [this](const ros::WallTimerEvent&) { updater_->force_update(); });
  if (!scene_file_.empty() && radar_) rebuild();
}

void TwinNode::readParameters(const ros::NodeHandle& private_nh) {
  StrictParameters parameters(private_nh);
  loadMechanismPlugins(parameters.text("plugins", ""), "parameter plugins");
  scene_file_ = parameters.text("scene", "");
  twin_file_ = parameters.text("twin", "");
  radar_file_ = parameters.text("radar", "");
  const std::string channels = parameters.text("channels", "");
  if (!channels.empty()) channels_ = loadChannelCorrection(resolvePath(channels, "/"));
  map_frame_ = parameters.text("map_frame", map_frame_);
  radar_frame_ = parameters.text("radar_frame", radar_frame_);
  actor_frame_prefix_ = parameters.text("actor_frame_prefix", "");
  rate_hz_ = parameters.number("rate_hz", rate_hz_, 0, 1000);
  reuse_m_ = parameters.number("reuse_m", reuse_m_, 0, 1);
  reuse_rad_ = parameters.number("reuse_deg", 0.01, 0, 10) * M_PI / 180;
  seed_ = static_cast<std::uint64_t>(parameters.integer("seed", 1, 0, 2147483647));
  diffuse_records_ = diffuseRecordsFrom(parameters.text("diffuse_records", "cells"), "parameter diffuse_records");
  parameters.number("diagnostic_period", 1.0, 0.01, 3600);  // read by diagnostic_updater
  parameters.boolean("diagnostic_updater_use_fqn", false);
  parameters.rejectUnknown();
}

void TwinNode::onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config) {
  if (!radar_file_.empty()) return;
  try {
    const RadarConfig radar = fromMsg(*config);
    if (twin_ && radar_ && radarHash(radar) == radarHash(*radar_)) return;
    radar_ = radar;
    rebuild();
  } catch (const InputError& error) {
    ROS_ERROR("radar/config refused: %s", error.what());
  }
}

void TwinNode::onSession(const mmradartwin_msgs::Session::ConstPtr& session) {
  if (!scene_file_.empty()) return;
  try {
    if (session_ && session_->files == session->files) return;  // once more, of a master that was restarted
    if (session_ && applied_twin_) {
      ROS_WARN("another session: the twin of %s is no longer applied", applied_twin_->c_str());
      applied_twin_.reset();
    }
    session_ = session;
    session_folder_ = std::make_unique<TemporaryFolder>();
    restoreSessionFiles(storedFiles(*session), session_folder_->path());
    SessionOptions options;
    options.need_captures = false;
    const Recording recording = openSession(session_folder_->path(), options);
    session_scene_ = recording.scene_file;
    session_twin_ = recording.twin_file;
    if (!radar_) radar_ = recording.radar;
    rebuild();
  } catch (const InputError& error) {
    problem_ = error.what();
    ROS_ERROR("session refused: %s", error.what());
  }
}

std::optional<std::string> TwinNode::sceneFile() const {
  return scene_file_.empty() ? session_scene_ : resolvePath(scene_file_, "/");
}

std::string TwinNode::startingTwin() const {
  return twin_file_.empty() ? session_twin_.value_or("") : resolvePath(twin_file_, "/");
}

std::unique_ptr<Twin> TwinNode::makeTwin(const std::string& twin_file) const {
  TwinDescription description = loadTwin(twin_file, sceneFile(), *radar_);
  if (channels_) refuseSameChannelError(description, *channels_);
  return std::make_unique<Twin>(std::move(description), seed_);
}

void TwinNode::forgetSimulations() {
  last_ = nullptr;
  advice_.reset();
  moving_.reset();
  actors_.clear();
}

void TwinNode::use(std::unique_ptr<Twin> twin) {
  forgetSimulations();
  radar_hash_ = radarHash(twin->radar());
  for (const std::string& note : twin->notes()) ROS_WARN("%s", note.c_str());
  for (const std::string& note : meshNotes(twin->scene())) ROS_WARN("%s", note.c_str());
  mmradartwin_msgs::Scene msg = toMsg(twin->scene(), twin->description().toYaml());
  msg.header.frame_id = map_frame_;
  msg.header.stamp = ros::Time::now();
  scene_publisher_.publish(msg);
  ROS_INFO("twin of %s: %zu actors, %zu facets", twin->scene().file.c_str(), twin->scene().actors.size(),
           twin->scene().facets.size());
  twin_ = std::move(twin);
  twin_->setTrajectory([this](std::int64_t stamp_ns) { return reportedPose(stamp_ns); });
  problem_.clear();
}

void TwinNode::rebuild() {
  forgetSimulations();
  twin_.reset();
  const std::string twin_file = applied_twin_ ? *applied_twin_ : startingTwin();
  if (!radar_ || (!sceneFile() && twin_file.empty())) return;
  try {
    use(makeTwin(twin_file));
  } catch (const MissingScene& error) {
    problem_ = error.what();
    // A bag's radar/config comes before the session that names the scene: until then the twin waits.
    if (session_) {
      ROS_ERROR("no twin: %s", error.what());
    } else {
      ROS_INFO("no twin yet: %s", error.what());
    }
  } catch (const std::exception& error) {
    problem_ = error.what();
    ROS_ERROR("no twin: %s", error.what());
  }
}

bool TwinNode::onApply(mmradartwin_msgs::ApplyTwin::Request& request, mmradartwin_msgs::ApplyTwin::Response& response) {
  const std::string what = request.file.empty() ? "the twin that this node was started with" : request.file;
  try {
    if (!request.file.empty() && request.file.front() != '/' && request.file.rfind("package://", 0) != 0) {
      throw InputError(request.file + ": give an absolute path or package://PACKAGE/PATH");
    }
    if (!radar_) throw InputError("no radar/config came yet: start the driver or the replay first");
    use(makeTwin(request.file.empty() ? startingTwin() : resolvePath(request.file, "/")));
    applied_twin_.reset();
    if (!request.file.empty()) applied_twin_ = resolvePath(request.file, "/");
    response.success = true;
    response.message = what + " is simulated from now on";
    ROS_INFO("%s", response.message.c_str());
    // A stream that has paused or ended shows it too.
    if (measured_) simulate(measured_->first, measured_->second);
  } catch (const std::exception& error) {
    response.success = false;
    response.message = "refused, the twin stays as it was: " + std::string(error.what());
    ROS_ERROR("twin/apply: %s", response.message.c_str());
  }
  return true;
}

void TwinNode::onGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& grid) {
  measured_at_ = ros::WallTime::now();
  if (!twin_) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "grids come, but there is no twin yet: %s",
                      !problem_.empty()
                          ? problem_.c_str()
                          : (radar_ ? "no scene (parameter scene, or a session message)" : "no radar/config"));
    return;
  }
  if (pending_) ++skipped_;
  pending_ = grid;
}

void TwinNode::onPending(const ros::WallTimerEvent&) {
  if (!pending_ || !twin_) return;
  if (!pending_->pose_valid) {
    // The measured branch has looked: what tf would interpolate now is no place where the radar was.
    ++without_pose_;
    ROS_WARN_THROTTLE(kWarnEvery_s, "no pose at %.6f, nothing simulated: the measured grid has none",
                      pending_->header.stamp.toSec());
    pending_.reset();
    return;
  }
  const Eigen::Isometry3d T_map_radar = fromMsg(pending_->T_map_radar);
  const std::int64_t stamp_ns = toNanoseconds(pending_->header.stamp);
  pending_.reset();
  measured_.emplace(T_map_radar, stamp_ns);
  simulate(T_map_radar, stamp_ns);
}

void TwinNode::onRate(const ros::WallTimerEvent&) {
  if (!twin_ || (ros::WallTime::now() - measured_at_).toSec() < kMeasuredFor_s) return;
  try {
    const geometry_msgs::TransformStamped T = tf_buffer_.lookupTransform(map_frame_, radar_frame_, ros::Time(0));
    // A static transform carries no stamp of its own.
    const ros::Time stamp = T.header.stamp.isZero() ? ros::Time::now() : T.header.stamp;
    // A pose that nobody renews is shown again once a second, for those who come late.
    const ros::WallTime now = ros::WallTime::now();
    if (last_ && last_ns_ == toNanoseconds(stamp) && (now - published_at_).toSec() < 1) return;
    published_at_ = now;
    simulate(fromMsg(T.transform), toNanoseconds(stamp));
  } catch (const tf2::TransformException& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "waiting for the pose of %s in %s: %s", radar_frame_.c_str(), map_frame_.c_str(),
                      error.what());
  }
}

bool TwinNode::alike(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const {
  return (a.translation() - b.translation()).norm() <= reuse_m_ &&
         Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear())) <= reuse_rad_;
}

std::optional<Eigen::Isometry3d> TwinNode::reportedPose(std::int64_t stamp_ns) const {
  const auto at = [this](const ros::Time& time) { return tf_buffer_.lookupTransform(map_frame_, radar_frame_, time); };
  try {
    return fromMsg(at(toRosTime(stamp_ns)).transform);
  } catch (const tf2::TransformException&) {
  }
  try {
    const geometry_msgs::TransformStamped last = at(ros::Time(0));
    const Eigen::Isometry3d T = fromMsg(last.transform);
    const std::int64_t last_ns = toNanoseconds(last.header.stamp), beyond_ns = stamp_ns - last_ns;
    if (last_ns == 0 || beyond_ns <= 0) return std::nullopt;
    return T * (fromMsg(at(toRosTime(last_ns - beyond_ns)).transform).inverse() * T);
  } catch (const tf2::TransformException&) {
    return std::nullopt;
  }
}

bool TwinNode::placeActors(std::int64_t stamp_ns) {
  const auto poseOf = [this, stamp_ns](const std::string& frame) -> std::optional<Eigen::Isometry3d> {
    // The radar's pose is that of the grid, and the actor's may still be on its way.
    for (const ros::Time& time : {toRosTime(stamp_ns), ros::Time(0)}) {
      try {
        return fromMsg(tf_buffer_.lookupTransform(map_frame_, frame, time).transform);
      } catch (const tf2::TransformException&) {
      }
    }
    return std::nullopt;
  };
  std::vector<std::pair<std::string, Eigen::Isometry3d>> found;
  for (const Actor& actor : twin_->scene().actors) {
    const std::string frame = actor_frame_prefix_ + actor.name;
    if (frame == map_frame_ || frame == radar_frame_ || !tf_buffer_._frameExists(frame)) continue;
    if (const auto T = poseOf(frame)) found.emplace_back(actor.name, *T);
  }
  bool moved = false;
  for (const auto& [name, T] : found) {
    auto known =
        std::find_if(actors_.begin(), actors_.end(), [&name = name](const auto& a) { return a.first == name; });
    if (known == actors_.end()) {
      actors_.emplace_back(name, T);
      moving_.reset();  // one more that moves
    } else if (!alike(known->second, T)) {
      known->second = T;
    } else {
      continue;
    }
    moved = true;
    if (moving_) moving_->place(name, T);
  }
  if (!actors_.empty() && !moving_) {
    std::vector<std::string> names;
    for (const auto& a : actors_) names.push_back(a.first);
    moving_.emplace(*twin_, names);
    for (const auto& [name, T] : actors_) moving_->place(name, T);
    ROS_INFO("%zu actors move with tf", names.size());
  }
  actor_moves_ += moved;
  return moved;
}

std::string TwinNode::noEchoAt(const Eigen::Isometry3d& T_map_radar) {
  if (!advice_) {
    advice_ = placementAdvice(twin_->scene(), twin_->radar(), {T_map_radar})
                  .value_or("check units, axes and origin, and where the radar looks");
  }
  const Eigen::Vector3d p = T_map_radar.translation();
  std::ostringstream text;
  text << "the twin has no echo at the radar's pose (" << p.x() << ", " << p.y() << ", " << p.z() << ") m; poses in "
       << map_frame_ << " and scene " << twin_->scene().file << " share one map, in metres, z up: " << *advice_;
  return text.str();
}

void TwinNode::simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) {
  const bool moved = placeActors(stamp_ns);
  const bool stands = last_ && alike(last_->T_map_radar, T_map_radar);
  last_ns_ = stamp_ns;
  if (stands && !moved) {
    ++reused_;
  } else {
    const ros::WallTime begin = ros::WallTime::now();
    // A radar that all but stands is taken to stand: then only what the actors touch is traced.
    const Eigen::Isometry3d at = stands ? last_->T_map_radar : T_map_radar;
    last_ = nullptr;
    try {
      if (moving_) {
        last_ = &moving_->simulate(at, stamp_ns);
      } else {
        still_ = twin_->simulate(at, stamp_ns);
        last_ = &*still_;
      }
    } catch (const InputError& error) {
      ++without_pose_;
      problem_ = error.what();
      ROS_WARN_THROTTLE(kWarnEvery_s, "pose at %.6f not simulated: %s", toRosTime(stamp_ns).toSec(), error.what());
      return;
    }
    problem_ = last_->records.empty() ? noEchoAt(at) : "";
    if (!problem_.empty()) ROS_WARN_THROTTLE(kWarnEvery_s, "%s", problem_.c_str());
    ++simulated_;
    simulate_ms_ = (ros::WallTime::now() - begin).toSec() * 1e3;
    if (!last_->check.ok()) {
      ROS_ERROR_THROTTLE(kWarnEvery_s, "records and grid disagree: amplitudes by %g, grid by %g",
                         last_->check.worst_amplitude_error, last_->check.grid_error);
    }
    mmradartwin_msgs::PathRecords paths =
        toMsg(*last_, exportedRecords(twin_->radar(), last_->records, diffuse_records_), twin_->scene(), radar_hash_);
    paths.header.frame_id = map_frame_;
    paths_publisher_.publish(paths);
  }
  mmradartwin_msgs::ReceiveGrid grid = toMsg(last_->grid, radar_hash_);
  grid.header.stamp = toRosTime(stamp_ns);
  grid.header.frame_id = radar_frame_;
  grid_publisher_.publish(grid);
}

void TwinNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  if (!twin_) {
    status.summary(Level::ERROR, problem_.empty() ? "no radar/config or no scene yet" : problem_);
  } else if (last_ && !last_->check.ok()) {
    status.summary(Level::ERROR, "records and grid disagree");
  } else if (!problem_.empty()) {
    status.summary(Level::WARN, problem_);
  } else if (!last_) {
    status.summary(Level::WARN, "waiting for a pose");
  } else {
    status.summary(Level::OK, "simulating");
  }
  status.add("poses simulated", simulated_);
  status.add("grids from records in use", reused_);
  status.add("stamps skipped", skipped_);
  status.add("stamps without a usable pose", without_pose_);
  status.add("actors that move with tf", actors_.size());
  status.add("grids with a moved actor", actor_moves_);
  status.add("last simulation [ms]", simulate_ms_);
  if (last_) {
    status.add("records", last_->records.size());
    status.add("worst |sum|c|^2/(M A^2) - 1|", last_->check.worst_amplitude_error);
    status.add("grid against sum of records", last_->check.grid_error);
  }
}

}  // namespace mmradartwin
