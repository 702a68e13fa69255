#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/channel_correction.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/parameters.h"

namespace mmradartwin {

struct NamedParameters {
  std::string mechanism;
  Parameters values;
};

/// The actors, material, walls, pose or (of a law) variable that a mechanism's parameters name; "" where they name
/// none.
std::string subjectOf(const NamedParameters& mechanism);
/// True where a twin cannot have both: the same mechanism for the same thing, or twice where it stands once.
bool excludeEachOther(const NamedParameters& a, const NamedParameters& b);

/// twin.yaml, checked: scene, radar and mechanisms.
struct TwinDescription {
  std::string file;  ///< "" where the base twin stands in
  std::string scene_file;
  std::string radar_file;  ///< where twin.yaml names a radar of its own, else ""
  RadarConfig radar;
  std::vector<NamedParameters> mechanisms;  ///< in the order of the file
  std::string toYaml() const;               ///< resolved: all parameters with their values
};

/// Neither twin.yaml nor its caller names a scene; nothing else is wrong.
class MissingScene : public InputError {
 public:
  using InputError::InputError;
};

/// Reads twin.yaml strictly; scene and radar default to the given ones. twin_file empty: base mechanisms.
/// Throws InputError (unknown mechanism or parameter, value out of range), MissingScene.
TwinDescription loadTwin(const std::string& twin_file, const std::optional<std::string>& default_scene,
                         const RadarConfig& default_radar);

/// What stands under key mechanisms of a twin.yaml. Throws InputError as loadTwin() does.
std::vector<NamedParameters> readMechanisms(YamlMap& mechanisms);

/// Throws InputError where the twin's channel_phase_error is the error that `correction` takes out of the measurement:
/// it would count twice. Tells by likeness: a smaller error that was found in corrected data may stand in a twin.
void refuseSameChannelError(const TwinDescription& twin, const ChannelCorrection& correction);

}  // namespace mmradartwin
