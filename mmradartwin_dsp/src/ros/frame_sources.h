#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// Who published the frames of one topic, and of which tf frame: two radars that share a topic would be averaged as
/// one.
class FrameSources {
 public:
  void add(const std::string& frame_id, const std::string& publisher);
  /// Why frames of `topic` are of several radars, with what to do; "" where they are of one. A driver that was started
  /// anew under another name is one radar.
  std::string whyNotOne(const std::string& topic) const;

 private:
  struct Source {
    std::string frame_id, publisher;
  };
  std::vector<Source> sources_;
  std::size_t last_ = 0;
  int returns_ = 0;  ///< how often one spoke again after another
};

}  // namespace mmradartwin
