#pragma once

#include <Eigen/Geometry>
#include <array>
#include <string>
#include <vector>

#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// What a law without a name may run over, as a number of a path (empirical_law).
class LawVariable {
 public:
  /// What the variables that have a place or a direction are about.
  struct About {
    double x_m = 0, y_m = 0;  ///< in map, where isAboutPlace()
    double bearing_deg = 0;   ///< in map, of standing_m
    int actor = -1;           ///< whose face foot_m is along, -1 for that of the first
  };
  /// Throws InputError for a name that is none of names().
  explicit LawVariable(const std::string& name, const About& about);
  explicit LawVariable(const std::string& name) : LawVariable(name, About()) {}
  static const std::vector<std::string>& names();
  /// True for those that have a place x_m, y_m.
  static bool isAboutPlace(const std::string& name);
  /// names() in a line, each with what it means.
  static std::string meaning();

  /// All that a variable needs beside the path.
  struct Where {
    const Scene& scene;  ///< that the path was traced in
    Eigen::Isometry3d T_map_radar;
    double session_s = 0;            ///< after the session's first pose
    double strongest_amplitude = 0;  ///< of the session's echoes
  };
  /// A law acts by its mean over these: departure and arrival may differ. count 0: the path has no such number.
  struct Values {
    int count = 0;
    std::array<double, 2> of = {0, 0};
  };
  Values of(const Where& where, const PathRecord& record) const;

 private:
  enum class Kind {
    kRange,
    kAzimuth,
    kIncidence,
    kHeight,
    kHeading,
    kBearing,
    kTime,
    kAmplitude,
    kFoot,
    kStanding,
    kPassing,
    kDistance
  };
  Kind kind_;
  Eigen::Vector2d place_, along_;
  int actor_;
};

}  // namespace mmradartwin
