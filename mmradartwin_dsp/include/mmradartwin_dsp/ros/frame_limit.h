#pragma once

#include <string>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"

namespace mmradartwin {

/// The parameter max_frame_mb: no memory is taken for larger frames, whatever a radar.yaml or a message asks for.
double readFrameLimit_mb(StrictParameters& parameters);

/// Throws InputError, which names `source`, for a radar whose frames are larger.
void requireFrameBelow(const RadarConfig& radar, double limit_mb, const std::string& source);

}  // namespace mmradartwin
