#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

/// A measured one-way power pattern over an angle: linear in dB between its points, held at its ends.
class PatternCurve {
 public:
  PatternCurve() = default;
  /// Throws InputError naming `mechanism` and the keys where the lists do not make a curve.
  PatternCurve(const std::vector<double>& angles_deg, const std::vector<double>& gain_db, const std::string& mechanism,
               const std::string& angles_key, const std::string& gain_key)
      : angles_deg_(angles_deg), gain_db_(gain_db) {
    if (angles_deg.size() != gain_db.size()) {
      throw InputError("mechanism " + mechanism + ": keys " + angles_key + " and " + gain_key + ": " +
                       std::to_string(angles_deg.size()) + " angles and " + std::to_string(gain_db.size()) +
                       " gains; give one gain per angle");
    }
    for (std::size_t i = 1; i < angles_deg.size(); ++i) {
      if (!(angles_deg[i] > angles_deg[i - 1])) {
        throw InputError("mechanism " + mechanism + ": key " + angles_key + ": " + std::to_string(angles_deg[i]) +
                         " does not rise; sort the angles and give each once");
      }
    }
  }
  bool given() const { return !angles_deg_.empty(); }
  /// Power gain, dB; 0 where no curve is given.
  double gain_db(double angle_rad) const {
    if (!given()) return 0;
    const double angle = angle_rad * 180 / M_PI;
    const auto above = std::upper_bound(angles_deg_.begin(), angles_deg_.end(), angle);
    if (above == angles_deg_.begin()) return gain_db_.front();
    if (above == angles_deg_.end()) return gain_db_.back();
    const std::size_t i = static_cast<std::size_t>(above - angles_deg_.begin());
    const double t = (angle - angles_deg_[i - 1]) / (angles_deg_[i] - angles_deg_[i - 1]);
    return gain_db_[i - 1] + t * (gain_db_[i] - gain_db_[i - 1]);
  }

 private:
  std::vector<double> angles_deg_, gain_db_;
};

}  // namespace mmradartwin
