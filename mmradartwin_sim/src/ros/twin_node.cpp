#include "mmradartwin_sim/ros/twin_node.h"

#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/Scene.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/ros/conversions.h"

namespace mmradartwin {
namespace {

constexpr double kWarnEvery_s = 5;
constexpr double kShowMovesEvery_s = 0.5;
constexpr double kMeasuredFor_s = 1;  // without a grid for so long the twin goes on at its own rate

/// Whether a line of the file begins with a key of a twin.yaml.
bool looksLikeTwin(const std::string& file) {
  constexpr int kMostLines = 10000;
  std::ifstream in(resolvePath(file, "/"));
  std::string line;
  for (int i = 0; i < kMostLines && std::getline(in, line); ++i) {
    for (const char* key : {"scene:", "radar:", "mechanisms:", "{scene:", "{radar:", "{mechanisms:"}) {
      if (line.compare(0, std::strlen(key), key) == 0) return true;
    }
  }
  return false;
}

}  // namespace

TwinNode::TwinNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh)
    : settings_(readSettings<Settings>(private_nh)) {
  loadMechanismPlugins(settings_.plugins, "parameter plugins");
  if (!settings_.channels_file.empty()) channels_ = loadChannelCorrection(settings_.channels_file);
  tf_reader_.emplace(tf_buffer_);
  tf_watch_.emplace(nh);
  grid_publisher_ = nh.advertise<mmradartwin_msgs::ReceiveGrid>("twin/grid", 100);  // as many as may wait
  paths_publisher_ = nh.advertise<mmradartwin_msgs::PathRecords>("twin/paths", 1, true);
  scene_publisher_ = nh.advertise<mmradartwin_msgs::Scene>("twin/scene", 1, true);
  moved_scene_publisher_ = nh.advertise<mmradartwin_msgs::Scene>("twin/moved_scene", 1, true);
  updater_ = std::make_unique<diagnostic_updater::Updater>(nh, private_nh);
  updater_->setHardwareID("none");
  updater_->add("twin", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { diagnose(status); });
  if (!settings_.radar_file.empty()) radar_ = loadRadarConfig(settings_.radar_file);
  config_subscriber_ = nh.subscribe("radar/config", 1, &TwinNode::onConfig, this);
  session_subscriber_ = nh.subscribe("session", 1, &TwinNode::onSession, this);
  grid_subscriber_ = nh.subscribe("radar/grid", 100, &TwinNode::onGrid, this);
  apply_service_ = nh.advertiseService("twin/apply", &TwinNode::onApply, this);
  pending_timer_ = nh.createWallTimer(ros::WallDuration(0.005), &TwinNode::onPending, this);
  if (settings_.rate_hz > 0)
    rate_timer_ = nh.createWallTimer(ros::WallDuration(1 / settings_.rate_hz), &TwinNode::onRate, this);
  diagnostics_timer_ = nh.createWallTimer(ros::WallDuration(kDiagnosticsEvery_s),
                                          [this](const ros::WallTimerEvent&) { updater_->force_update(); });
  if (!settings_.scene_file.empty() && radar_) rebuild();
}

TwinNode::Settings::Settings(StrictParameters& parameters) {
  plugins = parameters.text("plugins", "", "libraries with further mechanisms, with colons between");
  scene_file = parameters.existingPath("scene", "scene.yaml; empty: the one that the session message brings");
  twin_file = parameters.existingPath("twin", "twin.yaml; empty: the session's, or the base mechanisms");
  radar_file = parameters.existingPath("radar", "radar.yaml; empty: radar/config tells");
  channels_file = parameters.existingPath(
      "channels", "channels.yaml that the measured branch is corrected by: a twin with the same errors is refused");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  radar_frame = parameters.text("radar_frame", kRadarFrame, "tf frame of the radar");
  actor_frame_prefix =
      parameters.text("actor_frame_prefix", "", "before an actor's name it is the tf frame that the actor moves with");
  rate_hz = parameters.number("rate_hz", 10, 0, 1000, "simulations along tf while no measurement comes, Hz; 0: none");
  reuse_m = parameters.number("reuse_m", 1e-4, 0, 1, "a radar that moves by less stands, m");
  reuse_rad = parameters.number("reuse_deg", 0.01, 0, 10, "a radar that turns by less stands, deg") * M_PI / 180;
  seed = static_cast<std::uint64_t>(parameters.integer("seed", 1, 0, 2147483647, "of everything that is drawn"));
  diffuse_records = diffuseRecordsFrom(
      parameters.text("diffuse_records", "cells",
                      "twin/paths has scatter points summed by cells of a facet (cells), or all (points)"),
      "parameter diffuse_records");
  apply_folder = parameters.existingPath("apply_folder",
                                         "twin/apply takes twins from below this folder, beside those of scene, twin, "
                                         "packages and ROS_HOME; empty: base_folder");
  base_folder = parameters.baseFolder();
  parameters.ofDiagnosticUpdater();
}

NodeDescription TwinNode::description() {
  return {"twin_node",
          "twin",
          "Simulates what the radar would receive at the pose of each measured grid, and along tf while none comes.",
          {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
           topic<mmradartwin_msgs::Session>("session", "files of the recorded session, scene among them; latched"),
           topic<mmradartwin_msgs::ReceiveGrid>("radar/grid", "pose and stamp to simulate"),
           topic<tf2_msgs::TFMessage>("/tf", "where the radar is in the scene, and where actors are that move"),
           topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
          {topic<mmradartwin_msgs::ReceiveGrid>("twin/grid", "what the twin receives, with the stamp of radar/grid"),
           topic<mmradartwin_msgs::PathRecords>("twin/paths", "paths of the last simulation; latched"),
           topic<mmradartwin_msgs::Scene>("twin/scene", "scene as described, and twin that is simulated; latched"),
           topic<mmradartwin_msgs::Scene>("twin/moved_scene",
                                          "the scene with its actors where they are simulated, if elsewhere; latched"),
           topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "what the twin does, and why it does not")},
          {service<mmradartwin_msgs::ApplyTwin>("twin/apply",
                                                "simulate another twin.yaml from now on; \"\": the first one")},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void TwinNode::onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config) {
  if (!settings_.radar_file.empty()) return;
  try {
    const RadarConfig radar = fromMsg(*config);
    if (twin_ && radar_ && radarHash(radar) == radarHash(*radar_)) return;
    radar_ = radar;
  } catch (const std::exception& error) {
    ROS_ERROR("radar/config refused: %s", error.what());
    return;
  }
  rebuild();
}

void TwinNode::onSession(const mmradartwin_msgs::Session::ConstPtr& session) {
  if (!settings_.scene_file.empty()) return;
  try {
    if (session_ && session_->files == session->files) return;  // once more, of a master that was restarted
    // What is in use stays until the new one has been unpacked and read.
    auto folder = std::make_unique<TemporaryFolder>();
    restoreSessionFiles(storedFiles(*session), folder->path());
    SessionOptions options;
    options.need_captures = false;
    const Recording recording = openSession(folder->path(), options);
    if (session_ && applied_twin_) {
      ROS_WARN("another session: the twin of %s is no longer applied", applied_twin_->c_str());
      applied_twin_.reset();
    }
    session_ = session;
    session_folder_ = std::move(folder);
    session_scene_ = recording.scene_file;
    session_twin_ = recording.twin_file;
    if (!radar_) radar_ = recording.radar;
  } catch (const std::exception& error) {
    problem_ = error.what();
    ROS_ERROR("session refused: %s", error.what());
    return;
  }
  rebuild();
}

std::optional<std::string> TwinNode::sceneFile() const {
  return settings_.scene_file.empty() ? session_scene_ : settings_.scene_file;
}

std::string TwinNode::startingTwin() const {
  return settings_.twin_file.empty() ? session_twin_.value_or("") : settings_.twin_file;
}

std::unique_ptr<Twin> TwinNode::makeTwin(const std::string& twin_file) const {
  TwinDescription description = loadTwin(twin_file, sceneFile(), *radar_);
  if (channels_) refuseSameChannelError(description, *channels_);
  return std::make_unique<Twin>(std::move(description), settings_.seed);
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
  msg.header.frame_id = settings_.map_frame;
  msg.header.stamp = ros::Time::now();
  scene_publisher_.publish(msg);
  ROS_INFO("twin of %s: %zu actors, %zu facets", twin->scene().file.c_str(), twin->scene().actors.size(),
           twin->scene().facets.size());
  twin_ = std::move(twin);
  if (&twin_->tracedScene() != &twin_->scene()) publishMovedScene(twin_->tracedScene());
  twin_->setTrajectory([this](std::int64_t stamp_ns) { return reportedPose(stamp_ns); });
  problem_.clear();
}

void TwinNode::publishMovedScene(const Scene& scene) {
  mmradartwin_msgs::Scene msg = toMsg(scene, twin_->description().toYaml());
  msg.header.frame_id = settings_.map_frame;
  msg.header.stamp = ros::Time::now();
  moved_scene_publisher_.publish(msg);
  moved_scene_at_ = ros::WallTime::now();
  moved_scene_due_ = false;
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
    // What the node was started with cannot be simulated, and nothing that comes later changes that.
    if (!applied_twin_ && !(settings_.scene_file.empty() && settings_.twin_file.empty())) throw;
    problem_ = error.what();
    ROS_ERROR("no twin: %s", error.what());
  }
}

std::string TwinNode::allowedTwin(const std::string& file) const {
  namespace fs = std::filesystem;
  const bool of_package = file.rfind("package://", 0) == 0;
  if (file.front() != '/' && !of_package) throw InputError(file + ": give an absolute path or package://PACKAGE/PATH");
  const std::string path = resolvePath(file, "/");
  std::error_code error;
  const fs::path real = fs::canonical(path, error);
  // What is said of a file that is not there, and of one that is, is the same below a folder that is not allowed.
  std::vector<std::string> folders = {settings_.apply_folder.empty() ? settings_.base_folder : settings_.apply_folder};
  for (const std::string& known : {settings_.scene_file, settings_.twin_file}) {
    if (!known.empty()) folders.push_back(fs::path(known).parent_path().string());
  }
  const char* const home = std::getenv("HOME");
  const char* const ros_home = std::getenv("ROS_HOME");
  if (ros_home || home) folders.push_back(ros_home ? ros_home : std::string(home) + "/.ros");
  const fs::path asked = error ? fs::path(path).lexically_normal() : real;
  // A package's path may lead out of it again.
  if (of_package) {
    const std::string package = file.substr(0, file.find('/', std::strlen("package://")));
    folders.push_back(fs::path(resolvePath(package + "/package.xml", "/")).parent_path().string());
  }
  const bool inside = std::any_of(folders.begin(), folders.end(), [&asked](const std::string& folder) {
    std::error_code ignored;
    const fs::path root = fs::weakly_canonical(folder, ignored);
    const fs::path rest = asked.lexically_relative(root);
    return !folder.empty() && !rest.empty() && *rest.begin() != "..";
  });
  if (!inside) {
    throw InputError(path + ": lies below no folder that twin/apply may read; the parameter apply_folder (now '" +
                     folders.front() + "') names another");
  }
  if (error) throw InputError(path + ": cannot be read");
  if ((real.extension() != ".yaml" && real.extension() != ".yml") || !fs::is_regular_file(real, error)) {
    throw InputError(path + ": is no file NAME.yaml");
  }
  return path;
}

bool TwinNode::onApply(mmradartwin_msgs::ApplyTwin::Request& request, mmradartwin_msgs::ApplyTwin::Response& response) {
  const std::string what = request.file.empty() ? "the twin that this node was started with" : request.file;
  bool checked = false;
  try {
    const std::string file = request.file.empty() ? startingTwin() : allowedTwin(request.file);
    checked = !request.file.empty();
    if (!radar_) throw InputError("no radar/config came yet: start the driver or the replay first");
    use(makeTwin(file));
    applied_twin_.reset();
    if (!request.file.empty()) applied_twin_ = file;
    response.success = true;
    response.message = what + " is simulated from now on";
    ROS_INFO("%s", response.message.c_str());
    // A stream that has paused or ended shows it too.
    if (measured_) simulate(measured_->first, measured_->second);
  } catch (const std::exception& error) {
    response.success = false;
    // What is wrong with a file would be told in its own words: of a twin alone.
    response.message = "refused, the twin stays as it was: " +
                       (checked && !looksLikeTwin(request.file)
                            ? request.file + ": is no twin.yaml, it has none of the keys scene, radar and mechanisms"
                            : error.what());
    ROS_ERROR("twin/apply: %s", response.message.c_str());
  }
  return true;
}

void TwinNode::onGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& grid) {
  if (!usableStamp(grid->header.stamp)) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "radar/grid refused: its stamp, %u s, is no time", grid->header.stamp.sec);
    return;
  }
  grids_.heard();
  measured_at_ = ros::WallTime::now();
  tf_reader_->measuredAt(grid->header.stamp);
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
    const geometry_msgs::TransformStamped T =
        tf_buffer_.lookupTransform(settings_.map_frame, settings_.radar_frame, ros::Time(0));
    // A static transform carries no stamp of its own.
    const ros::Time stamp = T.header.stamp.isZero() ? ros::Time::now() : T.header.stamp;
    // A pose that nobody renews is shown again once a second, for those who come late.
    const ros::WallTime now = ros::WallTime::now();
    if (last_ && last_ns_ == toNanoseconds(stamp) && (now - published_at_).toSec() < 1) return;
    published_at_ = now;
    simulate(fromMsg(T.transform), toNanoseconds(stamp));
  } catch (const std::exception& error) {
    ROS_WARN_THROTTLE(kWarnEvery_s, "waiting for the pose of %s in %s: %s", settings_.radar_frame.c_str(),
                      settings_.map_frame.c_str(), error.what());
  }
}

bool TwinNode::alike(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const {
  return (a.translation() - b.translation()).norm() <= settings_.reuse_m &&
         Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear())) <= settings_.reuse_rad;
}

std::optional<Eigen::Isometry3d> TwinNode::reportedPose(std::int64_t stamp_ns) const {
  const auto at = [this](const ros::Time& time) {
    return tf_buffer_.lookupTransform(settings_.map_frame, settings_.radar_frame, time);
  };
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
        return fromMsg(tf_buffer_.lookupTransform(settings_.map_frame, frame, time).transform);
      } catch (const tf2::TransformException&) {
      }
    }
    return std::nullopt;
  };
  std::vector<std::pair<std::string, Eigen::Isometry3d>> found;
  for (const Actor& actor : twin_->scene().actors) {
    const std::string frame = settings_.actor_frame_prefix + actor.name;
    if (frame == settings_.map_frame || frame == settings_.radar_frame || !tf_buffer_._frameExists(frame)) continue;
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
  moved_scene_due_ |= moved;
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
       << settings_.map_frame << " and scene " << twin_->scene().file
       << " share one map, in metres, z up: " << *advice_;
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
    } catch (const std::exception& error) {
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
        toMsg(*last_, exportedRecords(twin_->radar(), last_->records, settings_.diffuse_records), twin_->scene(),
              radar_hash_);
    paths.header.frame_id = settings_.map_frame;
    paths_publisher_.publish(paths);
  }
  if (moving_ && moved_scene_due_ && (ros::WallTime::now() - moved_scene_at_).toSec() >= kShowMovesEvery_s) {
    publishMovedScene(moving_->scene());
  }
  mmradartwin_msgs::ReceiveGrid grid = toMsg(last_->grid, radar_hash_);
  grid.header.stamp = toRosTime(stamp_ns);
  grid.header.frame_id = settings_.radar_frame;
  grid_publisher_.publish(grid);
}

void TwinNode::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const {
  using Level = diagnostic_msgs::DiagnosticStatus;
  // Along poses alone the twin goes on by itself; a measurement that was there is missed.
  const std::string silence = grids_.ever() ? grids_.silence(grid_subscriber_) : "";
  if (!twin_) {
    status.summary(Level::ERROR, problem_.empty() ? "no radar/config or no scene yet" : problem_);
  } else if (last_ && !last_->check.ok()) {
    status.summary(Level::ERROR, "records and grid disagree");
  } else if (!silence.empty()) {
    status.summary(Level::ERROR, silence);
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
  status.add("transforms of the future left out", tf_reader_->futureCount());
  status.add("last simulation [ms]", simulate_ms_);
  if (last_) {
    status.add("records", last_->records.size());
    status.add("worst |sum|c|^2/(M A^2) - 1|", last_->check.worst_amplitude_error);
    status.add("grid against sum of records", last_->check.grid_error);
  }
}

}  // namespace mmradartwin
