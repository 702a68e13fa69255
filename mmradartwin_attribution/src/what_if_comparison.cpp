#include "mmradartwin_attribution/what_if_comparison.h"

#include <chrono>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

WhatIfComparison::WhatIfComparison(WhatIf& what_if, const AttributionConfig& config)
    : what_if_(what_if),
      chain_(what_if.given().radar()),
      field_(config, what_if.given().radar(), chain_.axes()),
      regions_(what_if.given().scene(), what_if.given().rays(), field_, what_if.given().radar()) {}

void WhatIfComparison::setMeasured(const RangeAngleMap& measured) {
  if (!measured.pose_valid) throw InputError("the measured map has no pose: is the radar's tf published?");
  if (measured.power_db.rows() != static_cast<Eigen::Index>(chain_.axes().range_m.size())) {
    throw InputError("the measured map has " + std::to_string(measured.power_db.rows()) + " ranges, the twin's radar " +
                     std::to_string(chain_.axes().range_m.size()) + ": they are of two radars");
  }
  const bool stands = measured_ && measured_->T_map_radar.matrix() == measured.T_map_radar.matrix();
  measured_ = measured;
  given_.reset();
  if (stands) return;
  given_simulation_.reset();
  regions_here_ = regions_.regions(measured.T_map_radar);
}

ComparedTwin WhatIfComparison::compared(const Simulation& simulation) {
  ComparedTwin twin;
  twin.map = chain_.map(simulation.grid);
  RealGrid expected;
  if (simulation.propagation_only) expected = expectedPower(field_, what_if_.given().radar(), simulation.records);
  ExplainedPower explained = explainedPower(field_, *measured_, twin.map, expected);
  twin.numbers.explained_power = explained.share(explained.amplitudeGain());
  twin.attribution = attributePose(field_, *measured_, twin.map, regions_here_, simulation.records);
  Ledger ledger;
  ledger.add(twin.attribution.central);
  twin.numbers.ledger = ledger.summary();
  return twin;
}

const ComparedTwin& WhatIfComparison::given() {
  if (!given_simulation_) {
    // What is found for the twin as given is there for the first change.
    given_simulation_ = &what_if_.now() == &what_if_.given()
                            ? what_if_.simulate(measured_->T_map_radar, measured_->stamp_ns)
                            : what_if_.given().simulate(measured_->T_map_radar, measured_->stamp_ns);
  }
  if (!given_) given_ = compared(*given_simulation_);
  return *given_;
}

const ComparedTwin& WhatIfComparison::now() {
  if (&what_if_.now() == &what_if_.given()) {
    now_ = given();
    records_ = given_simulation_->records;
    simulated_ms_ = 0;
    return now_;
  }
  const auto begin = std::chrono::steady_clock::now();
  const Simulation& simulation = what_if_.simulate(measured_->T_map_radar, measured_->stamp_ns);
  simulated_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  now_ = compared(simulation);
  records_ = simulation.records;
  return now_;
}

}  // namespace mmradartwin
