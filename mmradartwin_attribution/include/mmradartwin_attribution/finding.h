#pragma once

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// One number, text or list of a finding, under its binding name (causes.md).
struct FindingParameter {
  std::string name;
  std::string unit;  ///< "" for texts
  Parameters::Value value = 0.0;
  /// 95 % interval: none, one pair for a number, a pair per element for a list of numbers.
  std::vector<std::array<double, 2>> ci95;
};

/// A named parameter that every finding of a cause has to carry.
struct CauseParameter {
  std::string name;
  std::string unit;  ///< "" for texts
  ParameterKind kind = ParameterKind::kNumber;
  /// Of the parameters of a cause that share a number above 0, one is enough.
  int one_of = 0;
};

/// What a finding may be called, and what its name implies.
struct CauseDescription {
  std::string name;
  ResidualClass residual_class = ResidualClass::kMissingMechanism;
  std::vector<CauseParameter> parameters;
  const std::string& action() const { return classAction(residual_class); }
};

/// All binding names of causes.md, in its order, and last `unknown`.
const std::vector<CauseDescription>& causeDescriptions();
/// True for a cause of that list (`unknown` is one).
bool isCatalogued(const std::string& cause);
/// Throws InputError naming the known causes.
const CauseDescription& causeDescription(const std::string& cause);

struct CauseProbability {
  std::string cause;
  double probability = 0;
};

struct FindingEvidence {
  double log_likelihood_gain = 0;  ///< nats
  double false_alarm_rate = 1;     ///< family-wise
  std::optional<std::string> runner_up;
  std::optional<double> margin;  ///< nats over the runner-up
};

/// A figure of merit without and with a finding, on held-out locations. NaN where there was nothing to count.
struct GainMetric {
  double before = std::numeric_limits<double>::quiet_NaN();
  double after = std::numeric_limits<double>::quiet_NaN();
  std::optional<std::array<double, 2>> difference_ci95;
};

struct FindingGain {
  GainMetric explained_power;
  GainMetric log_likelihood_per_pose;
  GainMetric recall;
  std::array<GainMetric, 3> recall_band;  ///< near, mid, far
  GainMetric q1, q2, q3_median_db;
  std::array<GainMetric, 5> classes;  ///< counts of C1 to C5
};

/// A place in the room or in the maps that carries a finding. Empty where it does not apply.
struct FindingPlace {
  std::optional<std::array<double, 2>> range_m, azimuth_deg;  ///< from, to; radar frame
  std::vector<std::string> actors, poses;
  std::optional<double> x_m, y_m;  ///< map
};

/// What a finding's figure shows of the maps: simulated over measured power, each summed over all poses, with and
/// without the finding. NaN where neither has an echo to speak of.
struct FindingMaps {
  RangeAngleAxes axes;
  RealGrid before_db, after_db;  ///< [N][64]
};

/// Where a path record lies in a pose's maps, and its amplitude (20 log10 of DESIGN section 4's).
struct RecordState {
  double amplitude_db = 0, range_m = 0, azimuth_deg = 0;
};
/// A path record of the simulation that a finding changes, before and after; without the one it adds it, without the
/// other it takes it away.
struct ChangedRecord {
  std::string pose, event;  ///< event: the mechanism that made it
  std::vector<std::string> actors;
  std::optional<RecordState> before, after;
  double strongest_db() const;  ///< of both
};

/// One entry of findings.json (DESIGN section 5). Class and action follow from the cause.
struct Finding {
  std::string cause;  ///< a binding name or "unknown"
  std::vector<FindingParameter> parameters;
  std::optional<NamedParameters> mechanism;  ///< as in the extended twin
  std::vector<CauseProbability> candidates;  ///< the cause first; more than one where the data cannot tell them apart
  std::optional<std::string> experiment;     ///< that would tell them apart
  FindingEvidence evidence;
  std::optional<FindingGain> gain;  ///< none with fewer than two locations
  std::vector<FindingPlace> where;
  std::optional<std::string> figure;        ///< relative to findings.json
  std::optional<std::string> description;   ///< in words and numbers; `unknown` has one
  std::shared_ptr<const FindingMaps> maps;  ///< for the figure; none where maps of averages do not show it
  std::vector<ChangedRecord> records;       ///< that it changes, at the poses that carry it; for the report

  const FindingParameter* parameter(const std::string& name) const;  ///< nullptr where it has none of that name
  /// Half the 95 % intervals, along map's x and y, of where it is, or of by how much it moved; 0 where it has none.
  std::array<double, 2> placeError_m() const;
};

/// findings.json.
struct Findings {
  int poses = 0, locations = 0;
  std::string held_out;     ///< how, in words
  StatedAccuracy accuracy;  ///< by which the session was judged
  /// What the findings make of the session: "none" without any, "unknown" where that is all, else "named".
  std::string verdict() const;
  std::vector<Finding> findings;             ///< by gain
  std::optional<std::string> extended_twin;  ///< file name, relative to findings.json
};

/// As findings.json holds it. Throws std::logic_error where a finding lacks a parameter of its cause, carries one in
/// another unit, has a number that is not finite or an `unknown` that does not stand last.
std::string toJson(const Finding& finding);
std::string toJson(const Findings& findings);
/// Throws std::logic_error as toJson, std::runtime_error where the file cannot be written.
void writeFindings(const Findings& findings, const std::string& file);

/// Strict: unknown, missing and unfit keys are InputErrors that name file and key, and so is what toJson refuses.
Findings readFindings(const std::string& file);
Findings parseFindings(const std::string& json_text, const std::string& name);

}  // namespace mmradartwin
