#include "diagnosis/diagnosis_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/gain/changed_records.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/hidden_walkers.h"
#include "diagnosis/likelihood/error_spread.h"
#include "diagnosis/pose_convention.h"
#include "diagnosis/receiver/body_fixed_tone.h"
#include "diagnosis/receiver/channel_errors.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/receiver/receiver_noise.h"
#include "diagnosis/receiver/sample_convention.h"
#include "diagnosis/receiver/strongest_echo.h"
#include "diagnosis/refined_ranges.h"
#include "diagnosis/rounds/knife_edges.h"
#include "diagnosis/scene_match.h"
#include "diagnosis/survey_plan.h"
#include "diagnosis/unexplained_frames.h"
#include "diagnosis/unexplained_power.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr int kFolds = 5;
/// The scene's error over the one that actors are judged by, from which on they are let farther: more than the estimate
/// scatters by; see docs/verification/calibration_of_bounds.md#errors-of-the-ground
constexpr double kWider = 1.2;
constexpr int kMostWidenings = 3;              ///< each costs a fit of all latents
const double kDbPerNeper = 10 / std::log(10);  ///< decibels of a power whose natural logarithm is 1

}  // namespace

DiagnosisRun::DiagnosisRun(const TimedRecording& timed, Twin& twin, const DiagnosisOptions& options,
                           const std::map<std::string, double>& estimated)
    : recording_(timed.recording),
      lag_(timed.finding),
      twin_(twin),
      session_(prepareSession(recording_, twin, options)),
      data_(session_.received.data),
      stated_(with(options.accuracy, recording_.accuracy)),
      context_(recording_, twin, data_, options, with(stated_, estimated), kFolds),
      gains_(context_),
      rounds_(context_, gains_, session_.received.frames, result_),
      mechanisms_(twin.description().mechanisms),
      extended_(mechanisms_) {}

void DiagnosisRun::add(Finding finding, const std::map<std::string, double>& nats_by_pose) {
  if (!differsFromStated(finding, twin_.description().mechanisms)) return;
  addGainInNats(data_, nats_by_pose, finding);
  replaceOrAppend(*finding.mechanism, extended_);
  result_.findings.findings.push_back(std::move(finding));
}

void DiagnosisRun::judgeFrames() {
  if (lag_) add(findingOf(*lag_));
  judgeHiddenWalkers(twin_, data_, session_.received.frames, session_.received.unexplained);
  for (const FrameFinding& frames : session_.received.frames) add(findingOf(frames), frames.nats_by_pose);
  measureFrameGain();
}

/// Measures what leaving damaged samples out gains. Several findings cannot be told apart: one average lacks the
/// samples of all.
void DiagnosisRun::measureFrameGain() {
  std::vector<Finding>& findings = result_.findings.findings;
  if (session_.few || findings.size() != 1 || session_.received.frames.size() != 1) return;
  ChannelData recorded = data_;
  const SignalChain chain(data_.radar);
  for (PoseChannels& pose : recorded.poses) {
    if (pose.uncorrected_average.x.size() == 0) continue;
    pose.grid = pose.uncorrected_average;
    transformGrid(chain, pose);
  }
  gains_.ofChange(recorded, mechanisms_, data_, mechanisms_, findings.front());
}

void DiagnosisRun::judgeConventions() {
  for (const SampleConvention& stated : session_.received.conventions) add(findingOf(stated, data_.radar));
  if (session_.few) return;
  context_.report("conventions", 0);
  const std::optional<SampleConvention> convention = findSampleConvention(twin_, data_);
  if (!convention) return;
  const ChannelData recorded = data_;
  undoSampleConvention(*convention, data_);
  Finding finding = findingOf(*convention, data_.radar);
  gains_.ofChange(recorded, mechanisms_, data_, mechanisms_, finding);
  // By chance some convention does best where nothing matches, or beside a transmitter that is late. A true one lets
  // the twin explain more at all places.
  if (finding.gain && finding.gain->explained_power.difference_ci95 &&
      (*finding.gain->explained_power.difference_ci95)[0] <= 0) {
    data_ = recorded;
    return;
  }
  addGainInNats(data_, {}, finding);
  extended_.push_back(*finding.mechanism);
  convention_ = finding.cause;
  as_recorded_ = recorded;
  result_.findings.findings.push_back(std::move(finding));
}

void DiagnosisRun::judgeOwnEcho() {
  context_.echoes.setBaseline(mechanisms_);
  context_.report("radar's own echo", 0);
  for (const NamedParameters& m : mechanisms_) {
    if (traitsOf(m.mechanism).form == MechanismForm::kBodyFixedTone) return;  // the twin has it already
  }
  const BodyFixedTone tone = findBodyFixedTone(data_);
  if (!isUnambiguous(tone)) return;
  const ChannelData recorded = data_;
  subtractTone(tone, data_);
  Finding finding = findingOf(tone, data_);
  std::vector<NamedParameters> with_tone = mechanisms_;
  with_tone.push_back(*finding.mechanism);
  gains_.ofChange(recorded, mechanisms_, recorded, with_tone, finding);
  addGainInNats(data_, {}, finding);
  extended_.push_back(*finding.mechanism);
  result_.findings.findings.push_back(std::move(finding));
}

void DiagnosisRun::judgeNoise() {
  const auto stated = std::find_if(mechanisms_.begin(), mechanisms_.end(), [](const NamedParameters& m) {
    return traitsOf(m.mechanism).form == MechanismForm::kNoiseFloor;
  });
  std::optional<Finding> finding;
  if (stated != mechanisms_.end()) finding = noiseFloorFinding(data_, *stated);
  if (finding) {
    addGainInNats(data_, {}, *finding);
    replaceOrAppend(*finding->mechanism, extended_);
    result_.findings.findings.push_back(std::move(*finding));
  }
  if (!session_.few) return;
  if (const std::optional<ChannelErrors> errors = findChannelErrors(data_)) add(findingOf(*errors));
}

void DiagnosisRun::fitTwinAsGiven() {
  context_.report("fitting the twin as it is", 0);
  context_.echoes.pointBeams(data_, mechanisms_, context_.likelihood.firstBin());
  context_.echoes.setBaseline(mechanisms_);
  state_ = context_.fitter.state(mechanisms_, nullptr);
  if (!session_.few) {
    takeKnifeEdges();
    takeSmallerErrors();
  }
  for (Finding& finding : result_.findings.findings) {
    if (traitsOf(finding.cause).form != MechanismForm::kBodyFixedTone) continue;
    referToStrongestEcho(twin_.changed(mechanisms_), data_, finding);
    replaceOrAppend(*finding.mechanism, extended_);
  }
}

void DiagnosisRun::takeKnifeEdges() {
  std::optional<ModelState> graded = likelierWithKnifeEdges(context_, state_);
  if (!graded) return;
  result_.knife_edges_nats = graded->log_likelihood - state_.log_likelihood;
  state_ = std::move(*graded);
  mechanisms_ = state_.mechanisms;
  extended_ = *withKnifeEdges(std::move(extended_));
}

std::vector<NamedParameters> DiagnosisRun::given() const {
  const std::vector<NamedParameters>& as_given = twin_.description().mechanisms;
  return result_.knife_edges_nats ? *withKnifeEdges(as_given) : as_given;
}

void DiagnosisRun::compareTwins() {
  if (context_.options.compared.empty()) return;
  rounds_.takeRangeErrors(state_);
  for (const TwinDescription& other : context_.options.compared) {
    context_.echoes.setBaseline(mechanisms_);  // each from where the twin as given stands
    ModelState state = context_.fitter.state(other.mechanisms, &state_.latents);
    rounds_.takeRangeErrors(state);
    const auto [low, high] = *likelihoodGain(data_, state_.by_pose, state.by_pose).difference_ci95;
    const double poses = static_cast<double>(data_.poses.size());
    context_.echoes.setBaseline(other.mechanisms);
    result_.compared.push_back({other.file,
                                state.log_likelihood - state_.log_likelihood,
                                {poses * low, poses * high},
                                explainedPower(cellPowers(data_, context_.echoes.echoes(other.mechanisms)))});
  }
}

bool DiagnosisRun::sceneMatches() {
  context_.echoes.setBaseline(mechanisms_);
  const std::vector<PoseEchoes> echoes = context_.echoes.echoes(mechanisms_);
  result_.explained_power = explainedPower(cellPowers(data_, echoes));
  Findings& findings = result_.findings;
  findings.accuracy = stated_;
  findings.poses = static_cast<int>(data_.poses.size());
  findings.locations = static_cast<int>(data_.locations.size());
  findings.held_out = session_.few ? "nothing: of fewer than 3 poses only frames and channels are judged"
                      : data_.locations.size() > 1 ? std::to_string(kFolds) + "-fold by location"
                                                   : "nothing: one location";
  std::optional<Finding> mismatch;
  if (!session_.few) mismatch = nothingMatches(data_, echoes, result_.explained_power);
  if (!mismatch) return true;
  context_.report("conventions of poses", 0);
  if (const auto reading = matchingPoseReading(twin_, as_recorded_ ? *as_recorded_ : data_)) {
    *mismatch->description += ". " + *reading;
  }
  // A convention that was found where nothing matches is none: one of several does best by chance.
  std::string alone;
  for (const Finding& other : findings.findings) {
    if (other.cause != convention_) alone += (alone.empty() ? "" : ", ") + other.cause;
  }
  if (!alone.empty()) *mismatch->description += ". What needs no scene, told without one: " + alone;
  findings.findings = {std::move(*mismatch)};
  extended_ = given();
  return false;
}

void DiagnosisRun::findCauses() {
  rounds_.run(mechanisms_, extended_, std::move(state_), session_.few ? 0 : context_.options.most_findings);
  mechanisms_ = rounds_.mechanisms();
  extended_ = rounds_.extended();
  for (Finding& finding : result_.findings.findings) {
    if (traitsOf(finding.cause).form != MechanismForm::kHarmonic) continue;
    referToStrongestHost(twin_.changed(mechanisms_), data_, rounds_.latents().log_gain, session_.strongest_amplitude,
                         finding);
    replaceOrAppend(*finding.mechanism, extended_);
  }
}

void DiagnosisRun::addUnexplained() {
  diagnosis::addUnexplained(session_.received.unexplained, data_, twin_.description().mechanisms, result_.findings,
                            extended_);
}

SessionEvidence DiagnosisRun::evidenceUnder(const ModelState& state, const std::vector<RangeShift>& elsewhere) const {
  SessionEvidence evidence = errorEvidence(context_.likelihood, state.echoes, state.latents);
  for (const RangeShift& shift : elsewhere) evidence.actor_range_m.replace(shift.actor, shift.shift_m, shift.nats);
  evidence.actor_range_m.leaveOutCommon();
  evidence.yaw_rad.leaveOutCommon();
  return evidence;
}

std::map<std::string, SpreadEstimate> DiagnosisRun::spreadsBy(const SessionEvidence& evidence) const {
  std::map<std::string, SpreadEstimate> spreads;
  const auto estimate = [&](const char* key, const ErrorEvidence& errors, double unit, double stated) {
    const std::optional<SpreadEstimate> found = estimatedSpread(errors, stated / unit);
    if (found) spreads[key] = {unit * found->value, unit * found->low, unit * found->high};
  };
  estimate("scene_m", evidence.actor_range_m, 1, stated_.scene_m);
  estimate("level_db", evidence.actor_gain, kDbPerNeper, stated_.level_db);
  estimate("heading_deg", evidence.yaw_rad, 180 / M_PI, stated_.heading_deg);
  return spreads;
}

std::vector<ActorErrors> DiagnosisRun::actorsBy(const SessionEvidence& evidence) const {
  const auto spread = [&](const char* key, double stated) {
    const auto found = result_.findings.estimated.find(key);
    return found != result_.findings.estimated.end() ? found->second.value : stated;
  };
  const double level_db = spread("level_db", stated_.level_db), range_m = spread("scene_m", stated_.scene_m);
  const PosteriorErrors levels = errorsBesideCommon(evidence.actor_gain, level_db / kDbPerNeper);
  const PosteriorErrors ranges = errorsBesideCommon(evidence.actor_range_m, range_m);
  std::vector<ActorErrors> errors;
  const std::vector<Actor>& actors = twin_.scene().actors;
  for (std::size_t i = 0; i < actors.size(); ++i) {
    const std::size_t e = errorOf(static_cast<int>(i), levels.mean.size());
    const ActorErrors of_actor = {actors[i].name, kDbPerNeper * levels.mean[e],
                                  kDbPerNeper * levels.standard_deviation[e], ranges.mean[e],
                                  ranges.standard_deviation[e]};
    if (of_actor.level_sd_db < kSaysSomething * level_db || of_actor.range_sd_m < kSaysSomething * range_m)
      errors.push_back(of_actor);
  }
  return errors;
}

void DiagnosisRun::takeSmallerErrors() {
  std::map<std::string, SpreadEstimate> spreads = spreadsBy(evidenceUnder(state_, {}));
  StatedAccuracy smaller = context_.accuracy;
  const auto take = [&](const char* key, double least, double& value) {
    const auto found = spreads.find(key);
    // The upper end of the interval: larger errors are not excluded.
    if (found != spreads.end()) value = std::min(value, std::max(found->second.high, least));
  };
  take("scene_m", stated_.path_range_m, smaller.scene_m);
  take("level_db", bounds::kLeastShareOfStated * stated_.level_db, smaller.level_db);
  if (smaller.scene_m == context_.accuracy.scene_m && smaller.level_db == context_.accuracy.level_db) return;
  context_.judgeActorsBy(smaller);
  const SessionLatents latents = state_.latents;
  state_ = context_.fitter.state(mechanisms_, &latents);
}

void DiagnosisRun::estimateAccuracy() {
  if (session_.few) return;
  const StatedAccuracy judged = context_.accuracy;
  ModelState state = rounds_.state();
  std::map<std::string, SpreadEstimate>& spreads = result_.findings.estimated;
  spreads = spreadsBy(evidenceUnder(state, rounds_.elsewhere()));
  // Errors stand no farther than the spread lets them: one that turns out larger lets them farther.
  for (int i = 0; i < kMostWidenings; ++i) {
    const auto found = spreads.find("scene_m");
    if (found == spreads.end() || found->second.value < kWider * context_.accuracy.scene_m) break;
    context_.report("errors of the scene, which are larger than stated", 0);
    StatedAccuracy wider = context_.accuracy;
    wider.scene_m = found->second.high;
    context_.judgeActorsBy(wider);
    context_.echoes.setBaseline(state.mechanisms);
    state = context_.fitter.state(state.mechanisms, &state.latents);
    rounds_.takeRangeErrors(state);
    spreads = spreadsBy(evidenceUnder(state, rounds_.elsewhere()));
  }
  result_.actors = actorsBy(evidenceUnder(state, rounds_.elsewhere()));
  context_.judgeActorsBy(judged);
}

void DiagnosisRun::judgeRest() {
  if (session_.few) return;
  ModelState state = rounds_.state();
  context_.echoes.setBaseline(state.mechanisms);
  std::optional<Finding> rest = unexplainedPower(context_, state);
  if (!rest) return;
  if (std::optional<MissingBounces> missing = missingBounces(context_, state)) {
    Finding finding = findingOf(*missing, state);
    gains_.ofChange(data_, state.mechanisms, data_, missing->state.mechanisms, finding);
    const bool explains_more = finding.gain && finding.gain->explained_power.difference_ci95 &&
                               (*finding.gain->explained_power.difference_ci95)[0] > 0;
    if (explains_more) {
      addGainInNats(data_, {}, finding);
      extended_[missing->specular] = *finding.mechanism;
      insertBeforeUnknown(std::move(finding));
      state = std::move(missing->state);
    }
    context_.echoes.setBaseline(state.mechanisms);
    rest = unexplainedPower(context_, state);
  }
  if (!rest) return;
  std::vector<Finding>& findings = result_.findings.findings;
  if (findings.empty() || findings.back().cause != "unknown") {
    findings.push_back(std::move(*rest));
  } else {
    findings.back().description = findings.back().description.value_or("") + "; besides, " + *rest->description;
  }
}

void DiagnosisRun::insertBeforeUnknown(Finding finding) {
  std::vector<Finding>& findings = result_.findings.findings;
  const bool unknown = !findings.empty() && findings.back().cause == "unknown";
  findings.insert(findings.end() - (unknown ? 1 : 0), std::move(finding));
}

/// Each finding changes the paths of the twin with the findings before it. Adds the paper's metrics where its round has
/// not measured them.
void DiagnosisRun::recordChangedPaths() {
  std::vector<NamedParameters> mechanisms = given();
  const std::vector<FrameFinding>& frames = session_.received.frames;
  for (Finding& finding : result_.findings.findings) {
    if (!finding.mechanism) continue;
    context_.report("what " + finding.cause + " changes", 0);
    std::vector<NamedParameters> changed = mechanisms;
    replaceOrAppend(*finding.mechanism, changed);
    const bool of_frames = std::any_of(frames.begin(), frames.end(),
                                       [&](const FrameFinding& frame) { return frame.cause == finding.cause; });
    if (finding.maps && finding.gain && std::isnan(finding.gain->recall.after) && !of_frames) {
      gains_.addMetrics(mechanisms, changed, *finding.gain);
    }
    std::vector<std::string> poses;
    for (const FindingPlace& place : finding.where) poses.insert(poses.end(), place.poses.begin(), place.poses.end());
    finding.records = changedRecords(twin_, data_, poses, mechanisms, changed);
    mechanisms = std::move(changed);
  }
}

SceneRefinement DiagnosisRun::refinement() {
  rounds_.takeRangeErrors(state_);
  context_.echoes.setBaseline(state_.mechanisms);
  return refinedRanges(context_, state_);
}

Diagnosis DiagnosisRun::result() {
  result_.extended = twin_.description();
  result_.extended.mechanisms = extended_;
  result_.problems = data_.problems;
  result_.plan = surveyPlan(&twin_.scene(), recording_.poses);
  return std::move(result_);
}

}  // namespace mmradartwin::diagnosis
