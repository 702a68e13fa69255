#pragma once

#include "mmradartwin_driver/radar_device.h"

namespace mmradartwin {

RadarDevice awr2243Device();

}  // namespace mmradartwin
