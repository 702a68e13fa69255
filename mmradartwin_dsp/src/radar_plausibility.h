#pragma once

#include <string>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {

/// A number of radar.yaml by its key. Throws InputError outside of what any radar has; the error names the unit in
/// which the number would be within.
double readRadarNumber(YamlMap& yaml, const std::string& key);

/// Holds every number of radar.yaml against its neighbours: the sweep against the carrier, the range bin, the ramp
/// against the samples, the frame against the chirps, the elements' distances against the wavelength. Throws InputError
/// where they cannot belong to one radar: it names file, key, value, what is allowed, and the unit in which the value
/// would fit all others.
void checkPlausibility(const RadarConfig& radar, const YamlMap& yaml);

}  // namespace mmradartwin
