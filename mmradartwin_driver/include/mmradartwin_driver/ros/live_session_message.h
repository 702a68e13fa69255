#pragma once

#include <mmradartwin_msgs/Session.h>

#include <cstdint>
#include <string>
#include <vector>

namespace mmradartwin {

/// Pose of a session that is being played.
struct LivePose {
  std::string name;
  std::int64_t stamp_ns = 0;  ///< of its first frame, in present time
  std::string capture;        ///< file
};

/// The `session` message of a session that is being played. Its files are unchanged except poses.csv, which has only
/// the played poses with present stamps, so that a recording of it converts into poses. Throws InputError.
mmradartwin_msgs::Session liveSessionMessage(const std::string& session, const std::vector<LivePose>& poses);

}  // namespace mmradartwin
