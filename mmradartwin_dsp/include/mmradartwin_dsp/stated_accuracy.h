#pragma once

#include <map>
#include <string>
#include <vector>

namespace mmradartwin {

class YamlMap;

/// Standard deviations (1 sigma) of what a session's ground is good for, as its user states them: scene, levels, poses
/// and paths. The defaults are those of config/diagnosis.yaml; a session's `accuracy:` may state others
/// (docs/reference/contracts.md section 5).
struct StatedAccuracy {
  double scene_m = 0.02;        ///< place of an actor of the scene, along a path
  double level_db = 1.5;        ///< level of an actor's echoes, per interaction
  double pose_m = 0.004;        ///< position of the radar, per axis
  double heading_deg = 0.3;     ///< heading of the radar
  double path_range_m = 0.005;  ///< one-way range of one path on its own
  double path_angle_deg = 0.2;  ///< direction of one path on its own: a facet is not exactly where its mesh is
};

/// One key of an `accuracy:` mapping, with its allowed range.
struct AccuracyKey {
  const char* name;
  const char* unit;
  double StatedAccuracy::*member;
  double min, max;
};
const std::vector<AccuracyKey>& accuracyKeys();

/// Values that a mapping states, by key; a key may be missing. Throws InputError for an unknown key or a value out of
/// range.
std::map<std::string, double> readStatedAccuracy(YamlMap accuracy);
/// `accuracy` with the values of `stated` in place of its own.
StatedAccuracy with(StatedAccuracy accuracy, const std::map<std::string, double>& stated);
/// Reads the mapping `accuracy:` of a diagnosis.yaml; keys that it leaves out keep their defaults. Throws InputError.
StatedAccuracy loadStatedAccuracy(const std::string& file);

}  // namespace mmradartwin
