#include "ros/frame_sources.h"

#include <algorithm>

#include "mmradartwin_dsp/text.h"

namespace mmradartwin {

void FrameSources::add(const std::string& frame_id, const std::string& publisher) {
  if (!sources_.empty() && sources_[last_].frame_id == frame_id && sources_[last_].publisher == publisher) return;
  const auto known = std::find_if(sources_.begin(), sources_.end(), [&](const Source& source) {
    return source.frame_id == frame_id && source.publisher == publisher;
  });
  last_ = static_cast<std::size_t>(known - sources_.begin());
  if (known == sources_.end()) {
    sources_.push_back({frame_id, publisher});
  } else {
    ++returns_;
  }
}

std::string FrameSources::whyNotOne(const std::string& topic) const {
  const bool one_frame = std::all_of(sources_.begin(), sources_.end(), [this](const Source& source) {
    return source.frame_id == sources_.front().frame_id;
  });
  if (sources_.size() < 2 || (one_frame && returns_ < 2)) return "";
  std::vector<std::string> names;
  for (const Source& source : sources_) {
    names.push_back("of " + (source.frame_id.empty() ? "no frame" : source.frame_id) +
                    (source.publisher.empty() ? "" : " (published by " + source.publisher + ")"));
  }
  return "frames on " + topic + " are of several radars, " + join(names, " and ") +
         "; record each radar in a namespace of its own, and cut this bag with rosbag filter";
}

}  // namespace mmradartwin
