#pragma once

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Phase of a path at the window's centre, within half a turn of 0 so that no digits are lost.
double phaseAtCenter_rad(const RadarConfig& radar, double length_m);

}  // namespace mmradartwin
