#pragma once

#include <mmradartwin_msgs/AdcCube.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <rosbag/bag.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {

struct FrameSpoolLimits {
  std::string folder;                            ///< where the bag stands; "": the system's temporary folder
  std::uint64_t max_bytes = 2'000'000'000;       ///< of frames, in all
  std::uint64_t min_free_bytes = 1'000'000'000;  ///< left on the disk
  int frames_per_pose = 2000;                    ///< of a radar that stands, the first so many
};

struct FrameSpoolState {
  std::uint64_t frames = 0;    ///< kept
  std::uint64_t left_out = 0;  ///< by the limits, or taken with another radar
  std::uint64_t bytes = 0;     ///< of the frames kept
  std::string problem;         ///< why frames are left out now, "" where they are kept
};

/// The raw frames that a live stream brought so far, each with T_map_radar, beside radar configuration, session and
/// scene: a bag in a temporary folder, so that whoever works on "the poses seen so far" reads them exactly as from a
/// recorded bag. Begins anew when radar configuration or session change and when stamps go back by more than a second
/// (a bag that is played again). May be used by several threads.
class FrameSpool {
 public:
  /// Throws InputError where the folder cannot be made.
  explicit FrameSpool(const FrameSpoolLimits& limits = {});
  ~FrameSpool();

  void setRadar(const mmradartwin_msgs::RadarConfig& config);
  void setSession(const mmradartwin_msgs::Session& session);
  void setScene(const mmradartwin_msgs::Scene& scene);
  /// Frames that come before the radar configuration wait for it.
  void add(const mmradartwin_msgs::AdcCube::ConstPtr& cube, const Eigen::Isometry3d& T_map_radar);
  /// Forgets all frames; the rest stays.
  void forget();

  /// The poses seen so far. What comes later does not show in it, and it can be read as long as it is there. Throws
  /// InputError where there is no radar configuration, frame or pose yet. pose_lag_s as in BagOptions. Its withPoseLag
  /// needs the spool.
  Recording recording(double pose_lag_s = 0);
  std::optional<mmradartwin_msgs::Session> session() const;
  std::optional<mmradartwin_msgs::Scene> scene() const;
  FrameSpoolState state() const;

 private:
  struct Waiting {
    mmradartwin_msgs::AdcCube::ConstPtr cube;
    Eigen::Isometry3d T_map_radar;
  };

  void beginAnew();
  void close();
  void keep(const mmradartwin_msgs::AdcCube& cube, const Eigen::Isometry3d& T_map_radar);
  /// "" where a frame of this size may be written, else why not.
  std::string refusal(std::uint64_t bytes) const;

  const FrameSpoolLimits limits_;
  const TemporaryFolder folder_;
  mutable std::mutex mutex_;
  rosbag::Bag bag_;
  std::string file_;  ///< of bag_; each beginning has its own, since a Recording may still read the one before
  int beginnings_ = 0;
  std::optional<mmradartwin_msgs::RadarConfig> radar_;
  std::uint64_t radar_hash_ = 0;
  std::optional<mmradartwin_msgs::Session> session_;
  std::optional<mmradartwin_msgs::Scene> scene_;
  std::deque<Waiting> waiting_;
  std::int64_t newest_ns_ = 0;
  Eigen::Isometry3d standing_at_ = Eigen::Isometry3d::Identity();
  int standing_frames_ = 0;
  FrameSpoolState state_;
};

}  // namespace mmradartwin
