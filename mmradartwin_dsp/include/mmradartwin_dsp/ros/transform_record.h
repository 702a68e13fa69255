#pragma once

#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// Beyond these, two transforms of one edge that follow each other say nothing about what lies between.
struct TransformLimits {
  double gap_s = 0.2;
  double jump_m = 0.1, jump_m_per_s = 3;  ///< both: a jump is far and fast
  double jump_rad = 0.2, jump_rad_per_s = 6;
};

/// What tf said, edge by edge, from child to parent: tf2 interpolates between any two transforms, however far apart,
/// and does not tell which.
class TransformRecord {
 public:
  struct Stamped {
    std::int64_t stamp_ns;
    Eigen::Isometry3d T;
  };

  void add(const tf2_msgs::TFMessage& message, bool fixed);
  /// Forgets moving transforms older than this before an edge's newest.
  void keep(double seconds);
  /// Forgets all moving transforms.
  void clearMoving();

  bool empty() const { return parents_.empty(); }
  /// Transforms that are no rotation and place.
  std::uint64_t unusable() const { return unusable_; }
  /// Children of the edges between the two frames; nothing where they are not connected.
  std::optional<std::vector<std::string>> chain(const std::string& map, const std::string& radar) const;
  /// Moving edges of the chain, each in order of time.
  std::map<std::string, std::vector<Stamped>> moving(const std::vector<std::string>& chain) const;
  /// "parent -> child".
  std::string nameOf(const std::string& child) const;
  /// Why the pose of `radar` in `map` at a stamp that lies between transforms cannot be told by interpolation, in
  /// words: a jump, or a gap with two different ends. Empty where it can.
  std::string whyNotBetween(std::int64_t stamp_ns, const std::string& map, const std::string& radar,
                            const TransformLimits& limits) const;

 private:
  std::vector<std::string> toRoot(std::string frame) const;

  std::map<std::string, std::string> parents_;
  std::map<std::string, std::vector<Stamped>> edges_;  // in order of time
  std::uint64_t unusable_ = 0;
};

/// tf frame of the radar where nobody says otherwise.
inline constexpr char kRadarFrame[] = "radar_link";

/// A name of a frame or topic without the slash at its front.
std::string withoutSlash(const std::string& name);

/// True where the radar cannot have moved from one to the other.
bool isJump(const TransformRecord::Stamped& from, const TransformRecord::Stamped& to, const TransformLimits& limits);

}  // namespace mmradartwin
