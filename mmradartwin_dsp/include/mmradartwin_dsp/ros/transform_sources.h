#pragma once

#include <tf2_msgs/TFMessage.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace mmradartwin {

/// Who said in tf where a frame is. tf is a tree whose edges have one publisher each, and tf2 takes the last word of
/// whoever speaks: where two contradict each other, the pose is now that of the one and now that of the other.
class TransformSources {
 public:
  /// Returns contradictions to what was said before that this message brings up for the first time, one clause each.
  std::vector<std::string> add(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher);
  /// Contradictions about the frames between `radar` and `map`; others do not concern where the radar is.
  std::vector<std::string> contradictions(const std::string& map, const std::string& radar) const;
  /// "parent -> child (published by /slam)" of a frame, with all its publishers; its name alone where none is known.
  std::string nameOf(const std::string& child) const;
  /// Frames of which nothing says where they are, and below which others are; with more than one, tf is in pieces.
  std::vector<std::string> roots() const;

 private:
  /// What one publisher says of a frame below one parent. A mount that is told anew is another source.
  struct Source {
    std::string parent, publisher;
    bool fixed = false;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();  ///< the last one
    std::int64_t stamp_ns = 0;                            ///< of it
  };
  struct Frame {
    std::vector<Source> sources;
    std::size_t last = 0;     ///< which source spoke last
    int parents_in_turn = 0;  ///< how often a parent was named again soon after another one
    int places_in_turn = 0;   ///< how often two publishers put the frame at different places at one time
    bool reported = false;    ///< by add()
  };

  /// Takes in what was said; true where that may contradict what others said.
  static bool take(Frame& frame, const Source& said);
  /// "" or in which way the sources of a frame contradict each other. Without `map` only what does so wherever that is.
  std::string contradictionOf(const std::string& child, const Frame& frame, const std::string& map) const;
  std::string contradictionOfParents(const std::string& child, const Frame& frame, const std::string& map) const;
  bool connected(const std::string& frame, const std::string& map) const;
  /// The frame and all above it, but nothing above `stop`.
  std::vector<std::string> above(const std::string& frame, const std::string& stop) const;

  std::map<std::string, Frame> frames_;  // by child
};

}  // namespace mmradartwin
