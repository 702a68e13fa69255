#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// A number of a path that a law without a name may run over (empirical_law).
class LawVariable {
 public:
  /// Place, direction or actor that some variables refer to.
  struct ReferencePlace {
    double x_m = 0, y_m = 0;  ///< in map, where isAboutPlace()
    double bearing_deg = 0;   ///< in map, of standing_m
    int actor = -1;           ///< whose face foot_m is along, -1 for that of the first
  };
  /// Throws InputError for a name that is none of names().
  explicit LawVariable(const std::string& name, const ReferencePlace& about);
  explicit LawVariable(const std::string& name) : LawVariable(name, ReferencePlace()) {}
  static const std::vector<std::string>& names();
  /// True for those that have a place x_m, y_m.
  static bool isAboutPlace(const std::string& name);
  /// names() in a line, each with what it means.
  static std::string meaning();

  /// Surroundings of a path that a variable needs beside its record.
  struct PathPlace {
    const Scene& scene;  ///< that the path was traced in
    Eigen::Isometry3d T_map_radar;
    double session_s = 0;            ///< after the session's first pose
    double strongest_amplitude = 0;  ///< of the session's echoes
    double paths_power = 0;          ///< sum of squared amplitudes of the pose's echoes
  };
  /// A law acts by its mean over these: departure and arrival may differ. count 0: the path has no such number.
  struct Values {
    int count = 0;
    std::array<double, 2> value = {0, 0};
  };
  Values of(const PathPlace& where, const PathRecord& record) const;

 private:
  struct Row;
  static const std::vector<Row>& table();
  const Row* row_;
  Eigen::Vector2d place_, along_;
  int actor_;
};

}  // namespace mmradartwin
