#pragma once

#include <ros/ros.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <utility>

namespace mmradartwin {

/// So often nodes publish diagnostics: what TopicWatch finds is told within 2 s.
constexpr double kDiagnosticsEvery_s = 0.5;

/// Since when a topic is silent, in words that name where to look. Threads may share one.
class TopicWatch {
 public:
  /// `producer`: who publishes it, as the user knows it.
  explicit TopicWatch(std::string producer) : producer_(std::move(producer)) {}

  void heard() {
    const std::int64_t now_ns = wall_ns();
    intervals_ns_[count_++ % intervals_ns_.size()] = now_ns - heard_ns_.exchange(now_ns);
  }
  bool ever() const { return count_ > 0; }
  /// "" while the topic was heard within `limit_s`, which is longer than the longest period of frames, 1.342 s, or
  /// within twice the shortest time between its last messages.
  std::string silence(const ros::Subscriber& subscriber, double limit_s = 1.4) const {
    const double silent_s = 1e-9 * static_cast<double>(wall_ns() - heard_ns_);
    const std::int64_t usual_ns = *std::min_element(intervals_ns_.begin(), intervals_ns_.end());
    if (silent_s <= std::max(limit_s, std::min(2e-9 * static_cast<double>(usual_ns), kLongestPeriod_s))) return "";
    const std::string topic = subscriber.getTopic();
    if (subscriber.getNumPublishers() == 0) return "nobody publishes " + topic + ": look at " + producer_;
    return "nothing comes on " + topic + " for " + std::to_string(static_cast<long>(silent_s)) + " s: look at " +
           producer_;
  }

 private:
  static constexpr double kLongestPeriod_s = 60;
  static std::int64_t wall_ns() { return static_cast<std::int64_t>(ros::WallTime::now().toNSec()); }

  std::string producer_;
  std::atomic<std::int64_t> heard_ns_{wall_ns()};
  std::array<std::atomic<std::int64_t>, 4> intervals_ns_{};
  std::atomic<std::uint64_t> count_{0};
};

}  // namespace mmradartwin
