#include "mmradartwin_dsp/ros/frame_spool.h"

#include <ros/serialization.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <filesystem>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/stationary_poses.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostWaiting = 1000;
constexpr std::int64_t kPlayedAgain_ns = 1000000000;

ros::Time spoolTime(std::int64_t stamp_ns) { return toRosTime(std::max<std::int64_t>(1, stamp_ns)); }

std::string inMegabytes(std::uint64_t bytes) { return std::to_string(bytes / 1000000) + " MB"; }

tf2_msgs::TFMessage transformOf(const Eigen::Isometry3d& T_map_radar, const ros::Time& stamp) {
  tf2_msgs::TFMessage tf;
  tf.transforms.resize(1);
  geometry_msgs::TransformStamped& T = tf.transforms.front();
  T = tf2::eigenToTransform(T_map_radar);
  T.header.stamp = stamp;
  T.header.frame_id = BagOptions().map_frame;
  T.child_frame_id = kRadarFrame;
  return tf;
}

}  // namespace

FrameSpool::FrameSpool(const FrameSpoolLimits& limits) : limits_(limits), folder_(limits.folder) {}

FrameSpool::~FrameSpool() { close(); }

void FrameSpool::close() {
  try {
    bag_.close();
  } catch (const rosbag::BagException&) {  // of a full disk; what it held is given up with it
  }
}

void FrameSpool::beginAnew() {
  close();
  std::error_code ignored;
  fs::remove(file_, ignored);
  file_ = folder_.path() + "/" + std::to_string(++beginnings_) + ".bag";
  newest_ns_ = 0;
  standing_frames_ = 0;
  state_ = {};
  if (!radar_) return;
  bag_.open(file_, rosbag::bagmode::Write);
  const ros::Time start = spoolTime(0);
  bag_.write("radar/config", start, *radar_);
  if (session_) bag_.write("session", start, *session_);
  if (scene_) bag_.write("twin/scene", start, *scene_);
}

void FrameSpool::setRadar(const mmradartwin_msgs::RadarConfig& config) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const std::uint64_t hash = radarHash(config);
  if (radar_ && hash == radar_hash_) return;
  radar_ = config;
  radar_hash_ = hash;
  try {
    beginAnew();
    for (const Waiting& w : waiting_) keep(*w.cube, w.T_map_radar);
  } catch (const rosbag::BagException& error) {
    state_.problem = error.what();
  }
  waiting_.clear();
}

void FrameSpool::setSession(const mmradartwin_msgs::Session& session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (session_ && session_->files == session.files && session_->name == session.name) return;
  const bool another = session_.has_value();
  session_ = session;
  try {
    if (another) {
      beginAnew();
    } else if (bag_.isOpen()) {
      bag_.write("session", spoolTime(newest_ns_), session);
    }
  } catch (const rosbag::BagException& error) {
    state_.problem = error.what();
  }
}

void FrameSpool::setScene(const mmradartwin_msgs::Scene& scene) {
  const std::lock_guard<std::mutex> lock(mutex_);
  scene_ = scene;
  try {
    if (bag_.isOpen()) bag_.write("twin/scene", spoolTime(newest_ns_), scene);
  } catch (const rosbag::BagException& error) {
    state_.problem = error.what();
  }
}

void FrameSpool::forget() {
  const std::lock_guard<std::mutex> lock(mutex_);
  waiting_.clear();
  try {
    beginAnew();
  } catch (const rosbag::BagException& error) {
    state_.problem = error.what();
  }
}

std::string FrameSpool::refusal(std::uint64_t bytes) const {
  if (state_.bytes + bytes > limits_.max_bytes) {
    return "frames of " + inMegabytes(state_.bytes) + " are kept, which is the limit; later ones are left out";
  }
  std::error_code error;
  const fs::space_info space = fs::space(folder_.path(), error);
  if (!error && space.available < limits_.min_free_bytes + bytes) {
    return "only " + inMegabytes(space.available) + " are free where " + folder_.path() + " stands, and " +
           inMegabytes(limits_.min_free_bytes) + " are to stay free: frames are left out";
  }
  return "";
}

void FrameSpool::add(const mmradartwin_msgs::AdcCube::ConstPtr& cube, const Eigen::Isometry3d& T_map_radar) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!radar_) {
    waiting_.push_back({cube, T_map_radar});
    if (waiting_.size() > kMostWaiting) {
      waiting_.pop_front();
      ++state_.left_out;
    }
    return;
  }
  try {
    keep(*cube, T_map_radar);
  } catch (const rosbag::BagException& error) {
    // A bag that could not be written is none any more: the next frame begins another.
    close();
    ++state_.left_out;
    state_.problem = file_ + ": cannot be written (" + error.what() + "); all frames kept so far are lost";
  }
}

void FrameSpool::keep(const mmradartwin_msgs::AdcCube& cube, const Eigen::Isometry3d& T_map_radar) {
  if (cube.radar_hash != radar_hash_) {
    ++state_.left_out;
    return;
  }
  const std::int64_t stamp_ns = toNanoseconds(cube.header.stamp);
  if (!bag_.isOpen() || stamp_ns + kPlayedAgain_ns < newest_ns_) beginAnew();
  if (standing_frames_ == 0 || !standsStill(T_map_radar, standing_at_)) {
    standing_at_ = T_map_radar;
    standing_frames_ = 0;
  }
  newest_ns_ = std::max(newest_ns_, stamp_ns);
  if (standing_frames_ >= limits_.frames_per_pose) {
    ++state_.left_out;
    return;
  }
  const std::uint64_t bytes = ros::serialization::serializationLength(cube);
  state_.problem = refusal(bytes);
  if (!state_.problem.empty()) {
    ++state_.left_out;
    return;
  }
  const ros::Time time = spoolTime(stamp_ns);
  bag_.write("/tf", time, transformOf(T_map_radar, time));
  bag_.write("radar/adc", time, cube);
  ++standing_frames_;
  ++state_.frames;
  state_.bytes += bytes;
}

Recording FrameSpool::recording(double pose_lag_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!radar_) throw InputError("no radar/config came yet: start the driver, or the replay of a bag that holds it");
  if (state_.frames == 0) {
    throw InputError("no frames with a pose came yet" + (state_.problem.empty() ? "" : " (" + state_.problem + ")") +
                     ": wait for radar/adc and for map -> radar_link in tf");
  }
  BagOptions options;
  options.seen_only = true;
  options.radar_frame = kRadarFrame;
  options.pose_lag_s = pose_lag_s;
  // Closed, the bag has an index; a reader takes that in when it opens the file, and the chunks that it points to stay
  // where they are when more are appended behind them.
  try {
    bag_.close();
    std::optional<Recording> recording;
    std::string refused;
    try {
      recording = openBag(file_, options);
    } catch (const InputError& error) {
      refused = error.what();
    }
    bag_.open(file_, rosbag::bagmode::Append);
    if (!recording) throw InputError(refused);
    recording->source = "poses seen so far";
    // Its bag is written to in between: an index is there while this holds the lock alone.
    recording->withPoseLag = [this, pose_lag_s](double lag_s) { return this->recording(pose_lag_s + lag_s); };
    return *recording;
  } catch (const rosbag::BagException& error) {
    throw std::runtime_error(file_ + ": the frames kept so far cannot be read again (" + error.what() + ")");
  }
}

std::optional<mmradartwin_msgs::Session> FrameSpool::session() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return session_;
}

std::optional<mmradartwin_msgs::Scene> FrameSpool::scene() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return scene_;
}

FrameSpoolState FrameSpool::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return state_;
}

}  // namespace mmradartwin
