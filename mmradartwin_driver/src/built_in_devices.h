#pragma once

#include <vector>

#include "mmradartwin_driver/radar_devices.h"

namespace mmradartwin {

/// The devices that have a folder here; CMake writes its source from the folders.
std::vector<RadarDevice> builtInDevices();

}  // namespace mmradartwin
