#include "mmradartwin_dsp/ros/frame_limit.h"

#include <sstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

double readFrameLimit_mb(StrictParameters& parameters) {
  return parameters.number("max_frame_mb", 64, 0.001, 4096, "a radar whose frames are larger is refused, MiB");
}

void requireFrameBelow(const RadarConfig& radar, double limit_mb, const std::string& source) {
  constexpr double kMebibyte = 1 << 20;
  const double frame_mb = static_cast<double>(radar.bytes_per_frame()) / kMebibyte;
  if (frame_mb <= limit_mb) return;
  std::ostringstream text;
  text << source << ": a frame of " << radar.chirps_per_frame() << " chirps of " << radar.samples_per_chirp
       << " samples has " << frame_mb << " MiB, and max_frame_mb allows " << limit_mb
       << ": make frames smaller, or set that parameter higher";
  throw InputError(text.str());
}

}  // namespace mmradartwin
