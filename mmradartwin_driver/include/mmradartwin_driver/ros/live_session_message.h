#pragma once

#include <mmradartwin_msgs/Session.h>

#include <cstdint>
#include <string>
#include <vector>

namespace mmradartwin {

/// A pose of a session as it is played now.
struct LivePose {
  std::string name;
  std::int64_t stamp_ns = 0;  ///< of its first frame, now
  std::string capture;        ///< file
};

/// The `session` message of a session that is played: its files as they are, but poses.csv reduced to the poses played,
/// with the stamps of this time, so that a recording of it converts into poses. Throws InputError.
mmradartwin_msgs::Session liveSessionMessage(const std::string& session, const std::vector<LivePose>& poses);

}  // namespace mmradartwin
