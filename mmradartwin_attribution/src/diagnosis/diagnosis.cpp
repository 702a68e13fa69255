#include "mmradartwin_attribution/diagnosis.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/channels/pose_time_lag.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/gain/changed_records.h"
#include "diagnosis/gain/gain_measurement.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/hypotheses/evidence_bounds.h"
#include "diagnosis/hypotheses/law_words.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/clutter_field.h"
#include "diagnosis/numbers/number_text.h"
#include "diagnosis/receiver/body_fixed_tone.h"
#include "diagnosis/receiver/received_session.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/receiver/receiver_noise.h"
#include "diagnosis/receiver/sample_convention.h"
#include "diagnosis/receiver/strongest_echo.h"
#include "diagnosis/rounds/fit_round.h"
#include "diagnosis/rounds/hypothesis_finding.h"
#include "diagnosis/rounds/selection.h"
#include "diagnosis/scene_match.h"
#include "diagnosis/search/hypothesis_ranking.h"
#include "diagnosis/search/law_screen.h"
#include "diagnosis/survey_plan.h"
#include "diagnosis/unexplained_frames.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {

using namespace diagnosis;

namespace {

constexpr int kFolds = 5;
constexpr std::size_t kFewestForLaws = 3;  ///< poses: of fewer only frames and channels are judged
// Of the measured power: what explains less is no finding, unless it is worth leastNats(), inflation taken off, and is
// not like clutter; and to explain less by less than that is no loss.
constexpr double kLeastExplained = 0.002;
// Of the explained power, by what the likelihood plainly gains of; maps do not fit the actors' errors of 1.5 dB beside
// a law of levels.
constexpr double kMostLost = 0.015, kMostLostOfLevels = 0.05;
constexpr std::size_t kMostRangeErrors = 4;  ///< of actors, that are looked for in a round
/// Correlation over poses of what two fits gain, from which on a name explains some of what a better one was refused
/// for by the maps (edges that were no edges had hidden a step of the gain, at -0.16), and any the same.
constexpr double kExplainsSome = 0.2, kExplainsSame = 0.5;
/// Of what an unknown gains: what its law leaves over looks like a little of many names.
constexpr double kBesideUnknown = 0.25;

/// What a fit would have explained that is no finding.
struct Refused {
  Eigen::VectorXd gain_by_pose;
  bool by_maps;  ///< else by what is known of the session's own errors
};

class DiagnosisRun {
 public:
  /// lag: how it was brought in time.
  DiagnosisRun(const Recording& recording, Twin& twin, const DiagnosisOptions& options,
               std::optional<FrameFinding> lag);
  Diagnosis run();

 private:
  void report(const std::string& stage, double share) const {
    if (options_.cancelled && options_.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options_.on_progress) options_.on_progress({stage, share});
  }
  void measureFrameGain();
  /// Undoes what convention of delivery fits far better than the one stated; its name.
  std::optional<std::string> judgeDelivery();
  void judgeTone();
  void judgeNoise();
  std::string refusedByMaps(const HypothesisFit& f, const FindingGain& gain, std::vector<Refused>& refused);
  bool judgeChannels(int round);
  std::vector<RangeShift> takeRangeErrors(ModelState& state);
  std::vector<HypothesisFit> fitBest(int round);
  void recordChangedPaths();

  const Recording& recording_;
  Twin& twin_;
  const DiagnosisOptions& options_;
  std::optional<FrameFinding> lag_;
  bool few_;  ///< poses: too few for laws over them
  ReceivedSession received_;
  ChannelData& data_;
  PoseAccuracy accuracy_;
  double strongest_amplitude_ = 0;  ///< of the twin as given
  std::unique_ptr<ExpectedEchoes> source_;
  std::unique_ptr<ChannelLikelihood> model_;
  std::unique_ptr<HypothesisFitter> fitter_;
  std::unique_ptr<HypothesisRanking> ranking_;
  std::unique_ptr<GainMeasurement> gains_;
  std::unique_ptr<Selection> selection_;
  std::vector<NamedParameters> mechanisms_;  ///< as the engine simulates them
  std::vector<NamedParameters> extended_;    ///< the same with what was taken out of the data instead
  std::size_t family_ = 1;                   ///< hypotheses of a round
  Diagnosis result_;
};

DiagnosisRun::DiagnosisRun(const Recording& recording, Twin& twin, const DiagnosisOptions& options,
                           std::optional<FrameFinding> lag)
    : recording_(recording),
      twin_(twin),
      options_(options),
      lag_(std::move(lag)),
      few_(recording.poses.size() < kFewestForLaws),
      received_(receiveSession(recording, few_, readingProgress(options, "reading captures"))),
      data_(received_.data) {
  twin_.setSession(recording.poses);
  if (data_.radar.channels() > kMaxChannels) {
    throw InputError(recording.radar_file + ": has " + std::to_string(data_.radar.channels()) +
                     " virtual channels; a diagnosis takes up to " + std::to_string(kMaxChannels) +
                     ", record with fewer transmitters or receivers");
  }
  requireSameGrid(twin_, data_.radar);
  requirePlacesNear(twin_.scene(), data_, recording.source);
  // Levels relative to the strongest echo refer to this session's; poses inside something are left out here.
  std::vector<PoseChannels> usable;
  for (PoseChannels& p : data_.poses) {
    try {
      for (const PathRecord& r : twin_.trace(p.pose.T_map_radar)) {
        strongest_amplitude_ = std::max(strongest_amplitude_, r.amplitude);
      }
      usable.push_back(std::move(p));
    } catch (const InputError& error) {
      data_.problems.push_back({p.pose.name, "pose '" + p.pose.name + "': " + error.what()});
    }
  }
  data_.poses = std::move(usable);
  if (data_.poses.empty()) throw InputError(recording.source + ": " + data_.problems.back().message);
  numberLocations(data_);
  few_ = few_ || data_.poses.size() < kFewestForLaws;
  if (strongest_amplitude_ == 0) {
    throw InputError(recording.source + ": the twin has no echo at any pose; check that poses.csv and scene " +
                     twin.description().scene_file + " share one map, in metres");
  }
  twin_.setStrongestAmplitude(strongest_amplitude_);
  mechanisms_ = extended_ = twin_.description().mechanisms;
  expectClutter(twin_.scene(), data_);
  source_ = std::make_unique<ExpectedEchoes>(twin_, data_, accuracy_);
  model_ = std::make_unique<ChannelLikelihood>(data_, static_cast<int>(twin_.scene().actors.size()), accuracy_);
  fitter_ = std::make_unique<HypothesisFitter>(*source_, *model_, kFolds);
  ranking_ = std::make_unique<HypothesisRanking>(
      twin_, *source_, *model_, accuracy_, [this](const std::string& stage, double share) { report(stage, share); });
  gains_ = std::make_unique<GainMeasurement>(recording_, twin_, data_, *source_, *model_, *fitter_, options_);
  selection_ = std::make_unique<Selection>(twin_, data_, *source_, *model_, *fitter_, *gains_, accuracy_,
                                           result_.findings.findings, result_.tried,
                                           [this](const std::string& stage, double share) { report(stage, share); });
}

/// What leaving damaged samples out gains. That of several findings cannot be told apart: one average lacks all of
/// them.
void DiagnosisRun::measureFrameGain() {
  std::vector<Finding>& found = result_.findings.findings;
  if (few_ || found.size() != 1 || received_.frames.size() != 1) return;
  ChannelData recorded = data_;
  const SignalChain chain(data_.radar);
  for (PoseChannels& p : recorded.poses) {
    if (p.uncorrected_average.x.size() == 0) continue;
    p.grid = p.uncorrected_average;
    transformGrid(chain, p);
  }
  gains_->ofChange(recorded, mechanisms_, data_, mechanisms_, found.front());
}

std::optional<std::string> DiagnosisRun::judgeDelivery() {
  report("conventions", 0);
  const std::optional<SampleConvention> delivery = findSampleConvention(twin_, data_);
  if (!delivery) return std::nullopt;
  const ChannelData recorded = data_;
  undoSampleConvention(*delivery, data_);
  Finding f = findingOf(*delivery, data_.radar);
  gains_->ofChange(recorded, mechanisms_, data_, mechanisms_, f);
  // By chance some convention does best where nothing matches, or beside a transmitter that is late; one that is true
  // lets the twin explain more wherever it looks.
  if (f.gain && f.gain->explained_power.difference_ci95 && (*f.gain->explained_power.difference_ci95)[0] <= 0) {
    data_ = recorded;
    return std::nullopt;
  }
  addGainInNats(data_, {}, f);
  extended_.push_back(*f.mechanism);
  result_.findings.findings.push_back(f);
  return f.cause;
}

void DiagnosisRun::judgeTone() {
  report("radar's own echo", 0);
  for (const NamedParameters& m : mechanisms_) {
    if (m.mechanism == "tx_rx_leakage" || m.mechanism == "dc_offset") return;  // the twin has it already
  }
  const BodyFixedTone tone = findBodyFixedTone(data_);
  if (!isUnambiguous(tone)) return;
  const ChannelData recorded = data_;
  subtractTone(tone, data_);
  Finding f = findingOf(tone, data_);
  std::vector<NamedParameters> with = mechanisms_;
  with.push_back(*f.mechanism);
  gains_->ofChange(recorded, mechanisms_, recorded, with, f);
  addGainInNats(data_, {}, f);
  extended_.push_back(*f.mechanism);
  result_.findings.findings.push_back(std::move(f));
}

void DiagnosisRun::judgeNoise() {
  const auto stated = std::find_if(mechanisms_.begin(), mechanisms_.end(),
                                   [](const NamedParameters& m) { return m.mechanism == "noise_floor"; });
  if (stated == mechanisms_.end()) return;
  std::optional<Finding> f = noiseFloorFinding(data_, *stated);
  if (!f) return;
  addGainInNats(data_, {}, *f);
  replaceOrAppend(*f->mechanism, extended_);
  result_.findings.findings.push_back(std::move(*f));
}

/// Of a range that is far off the likelihood may have a top that steps from none do not reach: a screen 6.1 cm nearer
/// stood at 0.8 cm, and moved by 12 cm it gained 171 nats. Returns who seems shifted by more than such an error.
std::vector<RangeShift> DiagnosisRun::takeRangeErrors(ModelState& state) {
  std::vector<RangeShift> shifted = ranking_->shifted(state);
  const auto isError = [&](const RangeShift& s) {
    if (std::abs(s.shift_m) > kMostRangeError_m) return false;
    SessionLatents latents = withoutErrors(state.nuisance, s.actor);
    latents.actor_range_m[static_cast<std::size_t>(s.actor)] = s.shift_m;
    std::optional<ModelState> better = fitter_->improved(state, latents);
    if (better) state = std::move(*better);
    return better.has_value();
  };
  shifted.resize(std::min(kMostRangeErrors, shifted.size()));
  shifted.erase(std::remove_if(shifted.begin(), shifted.end(), isError), shifted.end());
  return shifted;
}

std::vector<HypothesisFit> DiagnosisRun::fitBest(int round) {
  const std::vector<Hypothesis> all = allHypotheses(twin_, selection_->extended());
  const std::vector<RangeShift> shifted = takeRangeErrors(selection_->state());
  std::vector<Screened> screened = ranking_->rank(all, selection_->state(), shifted);
  if (selection_->unknownNats() > 0) {  // one stands for all
    screened.erase(std::remove_if(screened.begin(), screened.end(),
                                  [](const Screened& s) { return !isCatalogued(s.hypothesis.mechanism.mechanism); }),
                   screened.end());
  }
  family_ = all.size() + static_cast<std::size_t>(kLawFamily);
  FitRound fits(*source_, *fitter_, data_, selection_->state(),
                [this](const std::string& stage, double share) { report(stage, share); });
  return fits.fit(std::move(screened), family_, round, result_.tried);
}

/// What every finding changes of the paths of the twin with those before it, and of the paper's metrics where its round
/// has not told.
void DiagnosisRun::recordChangedPaths() {
  std::vector<NamedParameters> mechanisms = twin_.description().mechanisms;
  for (Finding& f : result_.findings.findings) {
    if (!f.mechanism) continue;
    report("what " + f.cause + " changes", 0);
    std::vector<NamedParameters> with = mechanisms;
    replaceOrAppend(*f.mechanism, with);
    const bool of_frames = std::any_of(received_.frames.begin(), received_.frames.end(),
                                       [&](const FrameFinding& frames) { return frames.cause == f.cause; });
    if (f.maps && f.gain && std::isnan(f.gain->recall.after) && !of_frames) {
      gains_->addMetrics(mechanisms, with, *f.gain);
    }
    std::vector<std::string> poses;
    for (const FindingPlace& place : f.where) poses.insert(poses.end(), place.poses.begin(), place.poses.end());
    f.records = changedRecords(twin_, data_, poses, mechanisms, with);
    mechanisms = std::move(with);
  }
}

/// Why a fit that its likelihood speaks for is no finding by what the maps gain of it, "" where it is one. Adds to
/// `refused`, by pose, what is explained by those that are likelier and no finding.
std::string DiagnosisRun::refusedByMaps(const HypothesisFit& f, const FindingGain& gain,
                                        std::vector<Refused>& refused) {
  // Where the likelihood gains little and the maps nothing, it is the likelihood's own shortcomings that were fitted:
  // what a pose's error does at edges looks like a little of many things. Much of it may be real though no map shows it
  // (an image at -26 dB), unless the maps get plainly worse.
  const auto explained = *gain.explained_power.difference_ci95;
  const double by = gain.explained_power.after - gain.explained_power.before;
  const std::string by_how_much =
      ": " + number(by, 2) + " (" + number(explained[0], 2) + " to " + number(explained[1], 2) + ")";
  const bool in_maps = explained[0] > 0 && by >= kLeastExplained;
  const bool likelier = (*gain.log_likelihood_per_pose.difference_ci95)[0] > 0;
  const bool sure = explained[0] > 0 && likelier;
  if (!(in_maps && likelier) && isLikeClutter(f, by >= kLeastExplained, sure)) {
    return "clutter is like that, by what the maps gain" + by_how_much;
  }
  if (in_maps) return "";
  const bool traces = source_->altersGeometry(f.hypothesis.at(f.scaled_values));
  const double least_nats = leastNats(f.hypothesis, f.scaled_values, traces, data_.poses.size());
  const bool plainly_worse = explained[1] < 0 && by < -kLeastExplained;
  const bool in_nats = !plainly_worse && f.gain_without_best_place / f.overdispersion > least_nats;
  const double most_lost = isOfLevels(f.hypothesis) ? kMostLostOfLevels : kMostLost;
  // Maps of echoes that are many points' differ from what is expected of them by as much as they hold.
  // Few places see an actor: drawn without the best of them, little is left of what it gains.
  const bool plain = f.plain && !isFaintAddition(f.hypothesis, f.scaled_values);
  const bool much = (likelier || f.isFarAway()) && ((plain && (by > -most_lost || !plainly_worse)) || in_nats);
  // What explains less well what a better one was refused for is no name for it; a law without a name may be the cause
  // of something else beside it, and so may a name beside what is as wrong as the session's own errors.
  const Eigen::VectorXd explains = gainByPose(f, selection_->state());
  const bool named = isCatalogued(f.hypothesis.mechanism.mechanism);
  const bool again = std::any_of(refused.begin(), refused.end(), [&](const Refused& other) {
    const double same = correlation(explains, other.gain_by_pose);
    return same > (named && other.by_maps ? kExplainsSome : kExplainsSame);
  });
  if (much && !again) return "";
  if (likelier) refused.push_back({explains, true});
  return "the maps gain nothing" + by_how_much;
}

bool DiagnosisRun::judgeChannels(int round) {
  std::vector<HypothesisFit> fits = fitBest(round);
  const ModelState& state = selection_->state();
  preferAbsences(fits);
  preferMoves(fits, twin_.scene());
  preferBetterNames(fits, state);
  std::vector<Refused> refused;
  const double unknown_nats = selection_->unknownNats();
  for (HypothesisFit& f : fits) {
    std::string& verdict = triedAs(f, round, result_.tried).verdict;
    verdict = f.ranking() <= 0                         ? "gains less than its numbers cost"
              : f.false_alarm_rate > kFalseAlarm       ? "chance could do as well"
              : !(f.held_out_gain > 0)                 ? "loses on places not fitted"
              : f.gain < kBesideUnknown * unknown_nats ? "little beside what is unknown"
                                                       : rejectionReason(f, received_.frames);
    if (!verdict.empty()) continue;
    Finding finding = findingOf(f, fits, state, twin_.scene(), data_);
    if (data_.locations.size() > 1) {
      report("gain on held-out places", 0);
      gains_->ofFit(state, f, finding);
      verdict = refusedByMaps(f, *finding.gain, refused);
      if (!verdict.empty()) continue;
      gains_->addMetrics(selection_->extended(), f, *finding.gain);
    }
    report("found " + f.hypothesis.label() + ", " + number(f.gain, 4) + " nats", 1);
    if (source_->altersGeometry(*finding.mechanism)) ranking_->tryAllAgain();
    verdict = selection_->take(f, fits, std::move(finding), family_);
    if (verdict.empty()) {
      verdict = "found";
      return true;
    }
    report("taken back: " + f.hypothesis.label(), 1);
    // What an actor's own error does may be done by something else in truth.
    if (!f.hypothesis.isMove()) refused.push_back({gainByPose(f, state), false});
  }
  return false;
}

Diagnosis DiagnosisRun::run() {
  const auto add = [&](Finding finding, const std::map<std::string, double>& nats_by_pose = {}) {
    if (!differsFromStated(finding, twin_.description().mechanisms)) return;
    addGainInNats(data_, nats_by_pose, finding);
    replaceOrAppend(*finding.mechanism, extended_);
    result_.findings.findings.push_back(std::move(finding));
  };
  if (lag_) add(findingOf(*lag_));
  for (const FrameFinding& f : received_.frames) add(findingOf(f), f.nats_by_pose);
  measureFrameGain();
  for (const SampleConvention& d : received_.conventions) add(findingOf(d, data_.radar));
  const std::optional<std::string> convention = few_ ? std::nullopt : judgeDelivery();
  source_->setBaseline(mechanisms_);
  judgeTone();
  judgeNoise();
  if (few_) {
    if (const std::optional<ChannelErrors> errors = findChannelErrors(data_)) add(findingOf(*errors));
  }
  report("fitting the twin as it is", 0);
  source_->pointBeams(data_, mechanisms_, model_->firstBin());
  source_->setBaseline(mechanisms_);
  ModelState state = fitter_->state(mechanisms_, nullptr);
  for (Finding& f : result_.findings.findings) {
    if (f.cause != "tx_rx_leakage" && f.cause != "dc_offset") continue;
    referToStrongestEcho(twin_.changed(mechanisms_), data_, f);
    replaceOrAppend(*f.mechanism, extended_);
  }
  if (!options_.compared.empty()) takeRangeErrors(state);
  for (const TwinDescription& t : options_.compared) {
    source_->setBaseline(mechanisms_);  // each from where the twin as given stands, whatever was compared before it
    ModelState other = fitter_->state(t.mechanisms, &state.nuisance);
    takeRangeErrors(other);
    auto [low, high] = *likelihoodGain(data_, state.by_pose, other.by_pose).difference_ci95;
    const double poses = static_cast<double>(data_.poses.size());
    source_->setBaseline(t.mechanisms);
    result_.compared.push_back({t.file,
                                other.log_likelihood - state.log_likelihood,
                                {poses * low, poses * high},
                                explainedPower(cellPowers(data_, source_->echoes(t.mechanisms)))});
  }
  source_->setBaseline(mechanisms_);
  const std::vector<PoseEchoes> echoes = source_->echoes(mechanisms_);
  result_.explained_power = explainedPower(cellPowers(data_, echoes));
  std::optional<Finding> mismatch;
  if (!few_) mismatch = nothingMatches(data_, echoes, result_.explained_power);
  Findings& findings = result_.findings;
  findings.poses = static_cast<int>(data_.poses.size());
  findings.locations = static_cast<int>(data_.locations.size());
  findings.held_out = few_ ? "nothing: of fewer than 3 poses only frames and channels are judged"
                      : data_.locations.size() > 1 ? std::to_string(kFolds) + "-fold by location"
                                                   : "nothing: one location";
  if (mismatch) {
    // A convention that lets nothing match is none: one of several does best by chance.
    std::string alone;
    for (const Finding& other : findings.findings) {
      if (other.cause != convention) alone += (alone.empty() ? "" : ", ") + other.cause;
    }
    if (!alone.empty()) *mismatch->description += ". What needs no scene, told without one: " + alone;
    findings.findings = {std::move(*mismatch)};
    extended_ = twin_.description().mechanisms;
  } else {
    selection_->begin(mechanisms_, extended_, std::move(state));
    for (int round = 0; round < (few_ ? 0 : options_.most_findings); ++round) {
      if (!judgeChannels(round)) break;
    }
    selection_->orderByGain();
    mechanisms_ = selection_->mechanisms();
    extended_ = selection_->extended();
    for (Finding& f : findings.findings) {
      if (f.cause != "second_harmonic") continue;
      referToStrongestHost(twin_.changed(mechanisms_), data_, selection_->state().nuisance.log_gain,
                           strongest_amplitude_, f);
      replaceOrAppend(*f.mechanism, extended_);
    }
    addUnexplained(received_.unexplained, data_, twin_.description().mechanisms, findings, extended_);
  }
  recordChangedPaths();
  result_.extended = twin_.description();
  result_.extended.mechanisms = extended_;
  result_.problems = data_.problems;
  result_.plan = surveyPlan(&twin_.scene(), recording_.poses);
  return std::move(result_);
}

}  // namespace

Diagnosis diagnose(const Recording& recording, Twin& twin, const DiagnosisOptions& options) {
  std::unique_ptr<tbb::global_control> limit;
  if (options.jobs > 0) {
    limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                  static_cast<std::size_t>(options.jobs));
  }
  const TimedRecording timed =
      inTime(recording, twin.description().mechanisms, readingProgress(options, "frames on the way"));
  return DiagnosisRun(timed.recording, twin, options, timed.finding).run();
}

}  // namespace mmradartwin
