#pragma once

#include <ros/time.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <string>

namespace mmradartwin {

/// Leaves out transforms of the future, which are of a wrong clock: tf2 would take nothing older of their frame any
/// more, for as long as that.
class FutureTransforms {
 public:
  /// The rest of a message. Stamps are compared with this computer's clock and with `measured`, the newest stamp of
  /// what is measured: a whole rig's clock may be ahead. Of what is left out a warning names frames and publisher.
  tf2_msgs::TFMessage leaveOut(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher,
                               const ros::Time& measured);
  std::uint64_t count() const { return count_; }

 private:
  std::uint64_t count_ = 0;
};

}  // namespace mmradartwin
