#pragma once

#include "mmradartwin_driver/radar_devices.h"

namespace mmradartwin {

RadarDevice awr2243Device();

}  // namespace mmradartwin
