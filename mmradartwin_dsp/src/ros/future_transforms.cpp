#include "mmradartwin_dsp/ros/future_transforms.h"

#include <ros/console.h>

#include <algorithm>

#include "mmradartwin_dsp/ros/conversions.h"

namespace mmradartwin {
namespace {

constexpr double kWarnOfFutureEvery_s = 5;
/// Transforms that are stamped later than this are of a wrong clock.
constexpr std::int64_t kFuture_ns = 10'000'000'000;

}  // namespace

tf2_msgs::TFMessage FutureTransforms::leaveOut(const tf2_msgs::TFMessage& message, bool fixed,
                                               const std::string& publisher, const ros::Time& measured) {
  const ros::Time now = ros::Time::now();
  tf2_msgs::TFMessage kept;
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    if (!fixed && !usableStamp(transform.header.stamp)) {
      ++count_;
      ROS_WARN_THROTTLE(kWarnOfFutureEvery_s, "%s -> %s of %s is left out: its stamp, %u s, is no time",
                        transform.header.frame_id.c_str(), transform.child_frame_id.c_str(), publisher.c_str(),
                        transform.header.stamp.sec);
      continue;
    }
    const std::int64_t ahead_ns = toNanoseconds(transform.header.stamp) - toNanoseconds(std::max(now, measured));
    if (fixed || now.isZero() || ahead_ns <= kFuture_ns) {
      kept.transforms.push_back(transform);
      continue;
    }
    ++count_;
    ROS_WARN_THROTTLE(kWarnOfFutureEvery_s,
                      "%s -> %s of %s is left out: its stamp is %.1f s ahead of this computer's clock; synchronise the "
                      "clocks (ntp, chrony)",
                      transform.header.frame_id.c_str(), transform.child_frame_id.c_str(), publisher.c_str(),
                      static_cast<double>(ahead_ns) * 1e-9);
  }
  return kept;
}

}  // namespace mmradartwin
