#pragma once

#include <tf2/buffer_core.h>
#include <tf2_msgs/TFMessage.h>

#include <cstdint>
#include <map>
#include <string>

#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/ros/transform_sources.h"
#include "ros/bag/stamp_record.h"

namespace mmradartwin {

/// tf as a bag brings it, message by message: where frames are, and what is wrong with what it says.
class RecordedTf {
 public:
  /// Keeps moving transforms for so long.
  explicit RecordedTf(double keep_s);

  void add(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher, std::int64_t recorded_ns);

  bool empty() const { return taken_ == 0; }
  std::int64_t newest_ns() const { return newest_ns_; }
  const tf2::BufferCore& buffer() const { return buffer_; }
  const TransformRecord& record() const { return record_; }

  /// Why it cannot say where `radar` was in `map` at frames, as a clause with what to do: contradictions, edges whose
  /// stamps tell no time, clocks that differ by seconds beyond `clock_offset_s`. "" where nothing is wrong.
  std::string whyWrong(const std::string& map, const std::string& radar, const StampRecord& frames,
                       double clock_offset_s) const;
  /// Why the two frames are not connected, "" where they are.
  std::string whyNotConnected(const std::string& map, const std::string& radar) const;

 private:
  std::string clocksApart(const std::string& edge, const StampRecord& frames, const StampRecord& transforms,
                          double clock_offset_s) const;

  double keep_s_;
  tf2::BufferCore buffer_;
  TransformRecord record_;
  TransformSources sources_;
  std::map<std::string, StampRecord> stamps_;  // of moving edges, by child
  std::uint64_t taken_ = 0;
  std::int64_t newest_ns_ = 0;
};

}  // namespace mmradartwin
