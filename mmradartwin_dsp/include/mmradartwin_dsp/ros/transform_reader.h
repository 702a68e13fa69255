#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>

#include <atomic>
#include <cstdint>

#include "mmradartwin_dsp/ros/future_transforms.h"

namespace mmradartwin {

/// Fills a buffer from /tf and /tf_static on a thread of its own, as tf2_ros::TransformListener does, and leaves
/// transforms of the future out.
class TransformReader {
 public:
  /// The buffer must outlive this.
  explicit TransformReader(tf2_ros::Buffer& buffer);
  ~TransformReader();
  TransformReader(const TransformReader&) = delete;
  TransformReader& operator=(const TransformReader&) = delete;

  /// Tells the newest stamp of what is measured; of a stream that goes back, the new one.
  void measuredAt(const ros::Time& stamp);
  /// How many transforms were left out.
  std::uint64_t futureCount() const { return future_count_; }

 private:
  void take(const ros::MessageEvent<tf2_msgs::TFMessage const>& event, bool fixed);

  tf2_ros::Buffer& buffer_;
  FutureTransforms future_;
  std::atomic<std::int64_t> measured_ns_{0};
  std::atomic<std::uint64_t> future_count_{0};
  ros::Time heard_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_;
  ros::Subscriber moving_, fixed_;
  ros::AsyncSpinner spinner_{1, &queue_};
};

}  // namespace mmradartwin
