#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_attribution/explained_power.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_sim/what_if.h"

namespace mmradartwin {

/// How far a twin explains one measured map, as evaluate() tells it of a session of that pose alone.
struct TwinNumbers {
  double explained_power = 0;  ///< share; NaN where nothing was measured
  LedgerSummary ledger;
};

/// One simulation beside a measured map.
struct ComparedTwin {
  RangeAngleMap map;
  PoseAttribution attribution;
  TwinNumbers numbers;
};

/// Compares a twin that is changed by hand, and the same as given, with measured maps. Keeps a reference to the WhatIf.
/// What belongs to the twin as given is computed once a pose.
class WhatIfComparison {
 public:
  WhatIfComparison(WhatIf& what_if, const AttributionConfig& config);

  const EvaluationField& field() const { return field_; }
  WhatIf& whatIf() { return what_if_; }
  /// The measured map that the next compare() is about. Throws InputError where it is of another radar.
  void setMeasured(const RangeAngleMap& measured);
  bool hasMeasured() const { return measured_.has_value(); }
  const RangeAngleMap& measured() const { return *measured_; }

  /// Both throw InputError for a pose that cannot be simulated, or a map without any echo.
  const ComparedTwin& given();
  const ComparedTwin& now();
  const ComparedTwin& last() const { return now_; }  ///< of the last now()
  /// Paths of the last now().
  const std::vector<PathRecord>& records() const { return records_; }
  /// What the last now() took to simulate.
  double simulated_ms() const { return simulated_ms_; }

 private:
  ComparedTwin compared(const Simulation& simulation);

  WhatIf& what_if_;
  SignalChain chain_;
  EvaluationField field_;
  RegionModel regions_;
  std::optional<RangeAngleMap> measured_;
  std::optional<Simulation> given_simulation_;  ///< at the measured map's pose
  std::optional<ComparedTwin> given_;
  ComparedTwin now_;
  std::vector<PathRecord> records_;
  std::vector<ResponseRegion> regions_here_;
  double simulated_ms_ = 0;
};

}  // namespace mmradartwin
