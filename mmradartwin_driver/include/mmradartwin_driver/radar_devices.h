#pragma once

#include <string>

#include "mmradartwin_driver/radar_device.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Registers a device for the rest of the process. Throws InputError where its name is taken.
void registerRadarDevice(const RadarDevice& device);

/// Device that `radar` names. Throws InputError naming `file`, the key, its value and the known devices.
RadarDevice radarDevice(const RadarConfig& radar, const std::string& file);

}  // namespace mmradartwin
