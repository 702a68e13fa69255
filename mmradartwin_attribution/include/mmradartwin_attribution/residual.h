#pragma once

#include <array>
#include <string>
#include <vector>

#include "mmradartwin_attribution/response.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

enum class ResidualClass {
  kMissingSupport = 1,     ///< C1
  kWeakSupport = 2,        ///< C2
  kUnsupportedAnchor = 3,  ///< C3
  kShiftedResponse = 4,    ///< C4
  kMissingMechanism = 5    ///< C5
};
std::string className(ResidualClass c);           ///< "C2"
const std::string& classLabel(ResidualClass c);   ///< "weak support"
const std::string& classAction(ResidualClass c);  ///< calibration action or limitation tag
/// Material changes are admissible for C2 alone.
inline bool materialChangeAdmissible(ResidualClass c) { return c == ResidualClass::kWeakSupport; }

/// A mismatch between the branches, with exactly one class.
struct Residual {
  ResidualClass residual_class = ResidualClass::kMissingMechanism;
  bool measured_stronger = true;
  double range_m = 0, azimuth_rad = 0;       ///< of the response
  double measured_db = 0, simulated_db = 0;  ///< of both maps at the response's cell
  int region = -1;                           ///< index of the expected region, -1 at none
  std::string actor, material;               ///< of that region
  std::vector<int> records;                  ///< indices of the path records in its cell, strongest first
};

/// Counts and sums of one pose in one field of view; a ledger adds them up.
struct FieldMetrics {
  std::array<int, 3> active{}, recalled{};     ///< regions by band: near, mid, far
  std::array<int, 3> top_hits{}, top_count{};  ///< by config.top_k
  double q1_energy = 0, q2_energy = 0;         ///< shares of the pose's measured and simulated power
  int q1_cells = 0, q2_cells = 0;
  std::vector<double> q3_db;  ///< simulated - measured of each Q3 cell
  double q4_sum_db = 0;
  int q4_cells = 0;
  std::array<int, 5> class_count{};
  double measured_peak_db = 0;  ///< strongest level of the field relative to the central peak
};

/// Agreement of the simulation with the measurement under three readings of its samples:
/// Sum sqrt(Pm Ps)/sqrt(Sum Pm Sum Ps) over the evaluated cells.
struct ConventionCheck {
  double as_recorded = 0;
  double channel_conjugated = 0;  ///< mirrored in azimuth
  double iq_conjugated = 0;       ///< mirrored in azimuth and range
  bool conjugatedBetter() const { return std::max(channel_conjugated, iq_conjugated) > as_recorded; }
};

struct PoseAttribution {
  NormalisedMap measured, simulated;
  std::vector<ResponseRegion> regions;
  std::vector<Residual> residuals;
  FieldMetrics central, outer;  ///< outer: beyond the evaluated field, not routed to classes
  RealGrid residual_db;         ///< simulated - measured; NaN outside the evaluated field and where a map is
  ConventionCheck convention;
};

/// Compares maps of one pose where none is NaN. `regions` come from RegionModel; `records` are the paths behind the
/// simulated map (may be empty). Both maps need the field's axes; throws InputError otherwise.
PoseAttribution attributePose(const EvaluationField& field, const RangeAngleMap& measured,
                              const RangeAngleMap& simulated, std::vector<ResponseRegion> regions,
                              const std::vector<PathRecord>& records);

/// Indices of the records whose own contribution lies in the cell at a place (recordShare >= 1/2, -6 dB), strongest
/// first, down to config.record_span_db below the strongest.
std::vector<int> recordsInCell(const EvaluationField& field, const std::vector<PathRecord>& records, double range_m,
                               double azimuth_rad);

ConventionCheck checkConvention(const EvaluationField& field, const RangeAngleMap& measured,
                                const RangeAngleMap& simulated);

}  // namespace mmradartwin
