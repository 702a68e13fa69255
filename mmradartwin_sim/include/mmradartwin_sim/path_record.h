#pragma once

#include <Eigen/Geometry>
#include <boost/container/small_vector.hpp>
#include <complex>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

/// Few numbers that need no memory of their own: records are made, copied and thrown away by the million.
template <typename T>
using PerInteraction = boost::container::small_vector<T, 3>;
template <typename T>
using PerChannel = boost::container::small_vector<T, 8>;

/// One propagation path (docs/reference/contracts.md section 3 to 5).
struct PathRecord {
  const std::string* event = nullptr;        ///< name of the mechanism that made it (interned, never null in a result)
  PerInteraction<int> actors;                ///< Scene::actors index; -1: what the scene lacks
  PerInteraction<int> facets;                ///< index into the facets that were traced or -1
  PerInteraction<Eigen::Vector3d> vertices;  ///< map
  /// |cos| of the angle of incidence that each interaction's coefficient was taken at, -1 where it is no reflection;
  /// empty where none is: what a mechanism of weight needs of the geometry.
  PerInteraction<double> reflection_cosine;
  Eigen::Vector3d departure, arrival;  ///< unit vectors in radar_link, both from the radar outwards
  int bounces = 0;
  int range_bin = 0;                   ///< nearest bin of length/2
  double amplitude = 0;                ///< A_p, common to the channels
  double phase_rad = 0;                ///< of c[0]
  PerChannel<double> length_m;         ///< [M] exact path length per virtual element
  PerChannel<std::complex<double>> c;  ///< [M] at the window's centre; sum|c|^2 = M A_p^2
};

/// Adds records to grid x [M][N]: x_k[n] += c_k exp(j 2 pi mu (length_k/c)(t_n - t_c)). The one place where paths
/// become samples; rebuilding a grid from records calls the same function.
void accumulate(const RadarConfig& radar, const std::vector<PathRecord>& records, ComplexGrid& x);

/// Fills amplitude-derived fields of a record from its lengths and its coefficient: c_k = coefficient *
/// exp(j 2 pi (f_c tau_k + mu tau_k t_c - mu tau_k^2 / 2)), amplitude = |coefficient|, phase, range_bin.
void setContribution(const RadarConfig& radar, std::complex<double> coefficient, PathRecord& record);

/// Path length over the virtual elements' mean.
double meanLength_m(const PathRecord& record);

/// Makes a record's path longer by extra_m at all elements (a constant delay); amplitude and direction stay.
void lengthen(const RadarConfig& radar, double extra_m, PathRecord& record);
/// The same by an amount of its own per virtual element.
void lengthenChannels(const RadarConfig& radar, const PerChannel<double>& extra_m, PathRecord& record);
/// Multiplies amplitude and contribution.
void scaleRecord(std::complex<double> factor, PathRecord& record);
/// Nearest range bin of length/2, held within the grid.
int rangeBin(const RadarConfig& radar, double length_m);

/// Deviations of one pose from the invariants of records and grid (docs/reference/contracts.md section 4).
struct RecordCheck {
  double worst_amplitude_error = 0;  ///< max |sum|c|^2/(M A^2) - 1|
  double grid_error = 0;             ///< |grid - rebuilt| / |grid|
  bool ok() const { return worst_amplitude_error < 1e-12 && grid_error < 1e-12; }
};
/// Invariants of records and the grid that accumulate() made of them, by another arithmetic.
RecordCheck checkRecords(const RadarConfig& radar, const std::vector<PathRecord>& records, const ComplexGrid& x);

/// CSV header and rows of paths/{pose}.csv (docs/reference/contracts.md: length_m,azimuth_dep_deg,...).
struct Scene;
void writePathsCsv(const std::vector<PathRecord>& records, const Scene& scene, const std::string& file);

}  // namespace mmradartwin
