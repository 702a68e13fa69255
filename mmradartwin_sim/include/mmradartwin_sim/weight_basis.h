#pragma once

#include <complex>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// The grids of one pose's paths, summed per mechanism and sequence of actors. The propagated grid is linear in them: a
/// weight of a material, an actor or a mechanism is a factor per group, so levels are fitted without tracing or summing
/// paths again, and the derivative of the grid by a group's weight is that group's grid. A law that differs from path
/// to path within a group (over angle, say) needs the records.
class WeightBasis {
 public:
  struct Group {
    const std::string* event = nullptr;  ///< interned name, as in the records
    PerInteraction<int> actors;          ///< Scene::actors index, one per interaction
    int paths = 0;
    ComplexGrid x;     ///< [M][N]
    double power = 0;  ///< sum of A_p^2
  };
  WeightBasis(const RadarConfig& radar, const std::vector<PathRecord>& records);
  const std::vector<Group>& groups() const { return groups_; }
  /// x = sum of weights[g] groups()[g].x. Throws std::invalid_argument where their numbers differ.
  void sum(const std::vector<std::complex<double>>& weights, ComplexGrid& x) const;

 private:
  int channels_, samples_;
  std::vector<Group> groups_;
};

}  // namespace mmradartwin
