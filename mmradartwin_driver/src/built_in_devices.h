#pragma once

#include <vector>

#include "mmradartwin_driver/radar_device.h"

namespace mmradartwin {

/// The devices that have a folder here; CMake writes its source from the folders.
std::vector<RadarDevice> builtInDevices();

}  // namespace mmradartwin
