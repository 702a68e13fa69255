#pragma once

#include <array>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/mechanism_traits.h"
#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// One number, text or list of a finding, under its binding name (docs/reference/causes.md).
struct FindingParameter {
  std::string name;
  std::string unit;  ///< "" for texts
  Parameters::Value value = 0.0;
  /// 95 % interval: none, one pair for a number, a pair per element for a list of numbers.
  std::vector<std::array<double, 2>> ci95;
};

/// A named parameter that findings of a cause carry.
struct CauseParameter {
  std::string name;
  std::string unit;  ///< "" for texts
  ParameterKind kind = ParameterKind::kNumber;
  /// Group of parameters of which one is enough, 0 for a parameter that is always required.
  int one_of = 0;
  bool optional = false;  ///< given where the data show it
  bool or_list = false;   ///< of a number: a list may stand in its place, one number per receiver
};

/// A cause that a finding may name, with the residual class and the parameters that follow from it.
struct CauseDescription {
  std::string name;
  ResidualClass residual_class = ResidualClass::kMissingMechanism;
  std::vector<CauseParameter> parameters;
  MechanismTraits traits = {};
  const std::string& action() const { return classAction(residual_class); }
};

/// All catalogued causes in the order of docs/reference/causes.md, and last `unknown`.
const std::vector<CauseDescription>& causeDescriptions();
/// Adds a cause that a plug-in brings, behind the others. Its name is the mechanism's. Throws InputError for a name
/// that the catalogue has already. Not to be called while a diagnosis runs.
void addCause(CauseDescription cause);
/// True for a cause of causeDescriptions(); `unknown` is one.
bool isCatalogued(const std::string& cause);
/// Description of a cause. Throws InputError for another name; it lists the known ones.
const CauseDescription& causeDescription(const std::string& cause);

struct CauseProbability {
  std::string cause;
  double probability = 0;
  /// What tells candidates of the same cause apart, such as two orders of channels; else empty.
  std::vector<FindingParameter> parameters = {};
};

struct FindingEvidence {
  double log_likelihood_gain = 0;  ///< nats
  double false_alarm_rate = 1;     ///< family-wise
  std::optional<std::string> runner_up;
  std::optional<double> margin;  ///< nats over the runner-up
};

/// A figure of merit without and with a finding, on held-out locations. NaN where nothing was there to count.
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

/// A place in the room or in the maps that carries a finding. Parts that do not apply are empty.
struct FindingPlace {
  std::optional<std::array<double, 2>> range_m, azimuth_deg;  ///< from, to; radar frame
  std::vector<std::string> actors, poses;
  std::optional<double> x_m, y_m;  ///< map
};

/// Maps of a finding's figure: simulated over measured power by cell, both summed over all poses, without and with the
/// finding. NaN where neither has an echo to speak of.
struct FindingMaps {
  RangeAngleAxes axes;
  RealGrid before_db, after_db;  ///< [N][64]
};

/// Place and level of a path record in a pose's maps; amplitude_db is 20 log10 of PathRecord::amplitude.
struct RecordState {
  double amplitude_db = 0, range_m = 0, azimuth_deg = 0;
};
/// A path record of the simulation that a finding changes. Without `before` the finding adds the path, without `after`
/// it takes the path away.
struct ChangedRecord {
  std::string pose, event;  ///< event: the mechanism that made it
  std::vector<std::string> actors;
  std::optional<RecordState> before, after;
  double strongest_db() const;  ///< the larger amplitude of both
};

/// One entry of findings.json (docs/reference/contracts.md section 5). Class and action follow from the cause.
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

  const FindingParameter* parameter(const std::string& name) const;  ///< nullptr where there is none of that name
  /// Half the 95 % intervals of its place, or of its move, along the map's x and y; 0 where it has no interval.
  std::array<double, 2> placeError_m() const;
};

/// Spread (1 sigma) of errors as a session shows it, with its 95 % interval.
struct SpreadEstimate {
  double value = 0, low = 0, high = 0;
};

/// findings.json.
struct Findings {
  int poses = 0, locations = 0;
  std::string held_out;     ///< how, in words
  StatedAccuracy accuracy;  ///< as the user states it
  /// What the session shows instead, by the keys of the accuracy; keys of which it shows nothing are missing.
  std::map<std::string, SpreadEstimate> estimated;
  /// True of an accuracy that the session shows to be far worse than stated. It is then judged by the estimate.
  bool isFarWorse(const std::string& key) const;
  /// Verdict on the session: "none" without findings, "unknown" where the first finding is unknown, else "named".
  std::string verdict() const;
  std::vector<Finding> findings;             ///< by gain
  std::optional<std::string> extended_twin;  ///< file name, relative to findings.json
};

/// JSON as findings.json holds it. Throws std::logic_error where a finding lacks a parameter of its cause, carries one
/// in another unit or has a number that is not finite, and where an `unknown` does not stand last.
std::string toJson(const Finding& finding);
std::string toJson(const Findings& findings);
/// Throws std::logic_error as toJson, std::runtime_error where the file cannot be written.
void writeFindings(const Findings& findings, const std::string& file);

/// Reads findings.json strictly. Unknown, missing and unfit keys, and all that toJson refuses, are InputErrors that
/// name file and key.
Findings readFindings(const std::string& file);
Findings parseFindings(const std::string& json_text, const std::string& name);

}  // namespace mmradartwin
