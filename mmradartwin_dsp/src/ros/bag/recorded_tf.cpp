#include "ros/bag/recorded_tf.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

/// By how much clocks differ where no delay of a computer or a network explains it any more, s.
constexpr double kTransformsApart_s = 5;

std::string spanOf(const StampRecord& stamps) {
  return formatStamp(stamps.first_ns()) + " to " + formatStamp(stamps.last_ns()) + " s";
}

}  // namespace

RecordedTf::RecordedTf(double keep_s) : keep_s_(keep_s), buffer_(ros::Duration(keep_s)) {}

void RecordedTf::add(const tf2_msgs::TFMessage& message, bool fixed, const std::string& publisher,
                     std::int64_t recorded_ns) {
  record_.add(message, fixed);
  record_.keep(keep_s_);
  sources_.add(message, fixed, publisher);
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    taken_ += buffer_.setTransform(transform, publisher.empty() ? "bag" : publisher, fixed) ? 1 : 0;
    if (fixed) continue;
    const std::int64_t stamp_ns = toNanoseconds(transform.header.stamp);
    newest_ns_ = std::max(newest_ns_, stamp_ns);
    stamps_[withoutSlash(transform.child_frame_id)].add(stamp_ns, recorded_ns);
  }
}

std::string RecordedTf::whyWrong(const std::string& map, const std::string& radar, const StampRecord& frames,
                                 double clock_offset_s) const {
  const std::vector<std::string> contradictions = sources_.contradictions(map, radar);
  if (!contradictions.empty()) return "tf contradicts itself: " + join(contradictions, "; ");
  const auto chain = record_.chain(map, radar);
  if (!chain) return "";
  for (const std::string& child : *chain) {
    const auto stamps = stamps_.find(child);
    if (stamps == stamps_.end()) continue;
    const std::string edge = sources_.nameOf(child);
    const std::string no_time = stamps->second.whyNoTime("tf's " + edge, "its publisher");
    if (!no_time.empty()) return no_time;
    const std::string clocks = clocksApart(edge, frames, stamps->second, clock_offset_s);
    if (!clocks.empty()) return clocks;
  }
  return "";
}

std::string RecordedTf::clocksApart(const std::string& edge, const StampRecord& frames, const StampRecord& transforms,
                                    double clock_offset_s) const {
  const auto offset = StampRecord::between(frames, transforms);
  if (!offset || std::abs(offset->later_s - clock_offset_s) <= kTransformsApart_s) return "";
  char apart[60], option[60];
  // What messages take from their stamp to the recorder, a tenth of a second or so, is in it.
  std::snprintf(apart, sizeof apart, "%.*f s %s", std::abs(offset->later_s) < 20 ? 1 : 0, std::abs(offset->later_s),
                offset->later_s > 0 ? "later" : "earlier");
  std::snprintf(option, sizeof option, "--clock-offset %.1f", offset->later_s);
  if (offset->measured) {
    return "frames are stamped " + std::string(apart) + " than tf's " + edge +
           ", measured against the recorder's clock: the clocks of two computers differ; give " + option +
           ", and synchronise them (ntp, chrony) before the next recording";
  }
  return "frames (" + spanOf(frames) + ") and tf's " + edge + " (" + spanOf(transforms) +
         ") have no time in common, frames are about " + apart +
         ": where that is because clocks of two computers differ, give " + option +
         " and synchronise them (ntp, chrony) before the next recording; else record both together";
}

std::string RecordedTf::whyNotConnected(const std::string& map, const std::string& radar) const {
  if (record_.chain(map, radar)) return "";
  const std::vector<std::string> roots = sources_.roots();
  return "tf does not connect " + map + " -> " + radar + " (its frames hang below " + join(roots, " and ") +
         "); give the frames' names (--map-frame, --radar-frame), or record what is missing";
}

}  // namespace mmradartwin
