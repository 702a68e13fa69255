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
  /// x_m, y_m: the place in map that passing_m is about. Throws InputError for a name that is none of names().
  explicit LawVariable(const std::string& name, double x_m = 0, double y_m = 0);
  static const std::vector<std::string>& names();
  /// names() in a line, each with what it means.
  static std::string meaning();

  /// All that a variable needs beside the path.
  struct Where {
    const Scene& scene;
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
  enum class Kind { kRange, kAzimuth, kIncidence, kHeight, kHeading, kBearing, kTime, kAmplitude, kPassing };
  Kind kind_;
  Eigen::Vector2d place_;
};

}  // namespace mmradartwin
