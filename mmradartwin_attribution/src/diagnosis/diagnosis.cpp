#include "mmradartwin_attribution/diagnosis.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "body_fixed_tone.h"
#include "changed_records.h"
#include "channel_data.h"
#include "clutter_field.h"
#include "delivery.h"
#include "empirical_hypothesis.h"
#include "evidence_bounds.h"
#include "finding_figure.h"
#include "fit_round.h"
#include "fitted_parameters.h"
#include "held_out_gain.h"
#include "hypothesis_finding.h"
#include "hypothesis_fit.h"
#include "hypothesis_ranking.h"
#include "law_screen.h"
#include "map_metrics.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"
#include "profiled_values.h"
#include "receiver_finding.h"
#include "scene_match.h"
#include "session_model.h"

namespace mmradartwin {
namespace {

constexpr int kFolds = 5;
constexpr double kFalseAlarm = 0.01;       ///< family-wise, per round
constexpr std::size_t kFewestForLaws = 3;  ///< poses: of fewer only frames and channels are judged
// Of the measured power: what explains less is no finding, unless it is worth leastNats(), inflation taken off, and is
// not like clutter; and to explain less by less than that is no loss.
constexpr double kLeastExplained = 0.002;
constexpr double kMostLost = 0.015;     ///< of the explained power, by what the likelihood plainly gains of
constexpr std::size_t kWaysToErr = 4;   ///< geometries that alike errors of actors and poses look like
constexpr double kExplainsSame = 0.5;   ///< correlation over poses of what two fits gain
constexpr double kFarAway_m = 0.12;     ///< six times what a scene's actors err by,
constexpr double kOutOfPlace_m = 0.08;  ///< and four times: of some twenty actors none is farther away by chance
constexpr double kTogether_m = 0.005;   ///< what sixteen of them err by together
constexpr double kRival = 0.7;          ///< of a finding's gain, by a name that may be the right one
constexpr std::size_t kMostRivals = 2;
/// Of what an unknown gains: what its law leaves over looks like a little of many names.
constexpr double kBesideUnknown = 0.25;

class Session {
 public:
  Session(const Recording& recording, Twin& twin, const DiagnosisOptions& options);
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
  bool judgeChannels(int round);
  std::vector<HypothesisFit> fitBest(int round);
  void refitTogether();
  void profileFound();
  void takeOutImage();
  bool isWithinErrors(const HypothesisFit& f) const;
  struct Accepted;
  void restate();
  std::vector<PoseEchoes> heldOutEchoes(const HypothesisFit& fit, const std::vector<double>& actor_range_m);
  void measureGain(HypothesisFit& fit, Finding& f);
  void addMetrics(const HypothesisFit& fit, FindingGain& gain) const;
  EvaluationOptions evaluationOptions() const;
  void measureGain(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                   const ChannelData& after_data, const std::vector<NamedParameters>& after, Finding& f);

  const Recording& recording_;
  Twin& twin_;
  const DiagnosisOptions& options_;
  bool few_;  ///< poses: too few for laws over them
  ReceivedSession received_;
  ChannelData& data_;
  PoseAccuracy accuracy_;
  double strongest_amplitude_ = 0;  ///< of the twin as given
  std::unique_ptr<EchoSource> source_;
  std::unique_ptr<SessionModel> model_;
  std::unique_ptr<HypothesisFitter> fitter_;
  std::unique_ptr<HypothesisRanking> ranking_;
  std::vector<NamedParameters> mechanisms_;  ///< as the engine simulates them
  std::vector<NamedParameters> extended_;    ///< the same with what was taken out of the data instead
  ModelState state_;
  /// What rounds have found, as it was fitted last; `finding` is its place in result_.findings.
  struct Accepted {
    Hypothesis hypothesis;
    std::vector<double> scaled, standard_error;
    bool plain;
    std::size_t finding;
    /// Labels of those beside which its gain was measured; none where it was not.
    std::optional<std::vector<std::string>> beside;
    /// Other names that explained nearly as much in its round, with their numbers.
    std::vector<std::pair<Hypothesis, std::vector<double>>> rivals;
  };
  std::vector<Accepted> accepted_;
  std::vector<Accepted>::const_iterator acceptedAs(const Hypothesis& h) const {
    return std::find_if(accepted_.begin(), accepted_.end(),
                        [&](const Accepted& a) { return a.hypothesis.label() == h.label(); });
  }
  /// Nats of the unknown that was found; 0 where there is none.
  double unknownNats() const {
    const std::vector<Finding>& all = result_.findings.findings;
    return accepted_.empty() || all.back().cause != "unknown" ? 0 : all.back().evidence.log_likelihood_gain;
  }
  void accept(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding);
  void exchangeNames();
  void orderByGain();
  void measureAgain(const Accepted& a);
  void tellChanges();
  /// mechanisms_ and extended_ without what rounds have found.
  std::vector<NamedParameters> before_rounds_, extended_before_rounds_;
  std::size_t family_ = 1;  ///< hypotheses of a round
  Diagnosis result_;
};

Session::Session(const Recording& recording, Twin& twin, const DiagnosisOptions& options)
    : recording_(recording),
      twin_(twin),
      options_(options),
      few_(recording.poses.size() < kFewestForLaws),
      received_(receiveSession(recording, few_,
                               [&](std::size_t done, std::size_t all) {
                                 report("reading captures", static_cast<double>(done) / static_cast<double>(all));
                               })),
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
  source_ = std::make_unique<EchoSource>(twin_, data_, accuracy_);
  model_ = std::make_unique<SessionModel>(data_, static_cast<int>(twin_.scene().actors.size()), accuracy_);
  fitter_ = std::make_unique<HypothesisFitter>(*source_, *model_, kFolds);
  ranking_ = std::make_unique<HypothesisRanking>(
      twin_, *source_, *model_, accuracy_, [this](const std::string& stage, double share) { report(stage, share); });
}

/// What leaving damaged samples out gains. That of several findings cannot be told apart: one average lacks all of
/// them.
void Session::measureFrameGain() {
  std::vector<Finding>& found = result_.findings.findings;
  if (few_ || found.size() != 1 || received_.frames.size() != 1) return;
  ChannelData recorded = data_;
  const SignalChain chain(data_.radar);
  for (PoseChannels& p : recorded.poses) {
    if (p.plain.x.size() == 0) continue;
    p.grid = p.plain;
    transformGrid(chain, p);
  }
  measureGain(recorded, mechanisms_, data_, mechanisms_, found.front());
}

std::optional<std::string> Session::judgeDelivery() {
  report("conventions", 0);
  const std::optional<Delivery> delivery = findDelivery(twin_, data_);
  if (!delivery) return std::nullopt;
  const ChannelData recorded = data_;
  undoDelivery(*delivery, data_);
  Finding f = findingOf(*delivery, data_.radar);
  measureGain(recorded, mechanisms_, data_, mechanisms_, f);
  addGainInNats(data_, {}, f);
  extended_.push_back(*f.mechanism);
  result_.findings.findings.push_back(f);
  return f.cause;
}

void Session::judgeTone() {
  report("radar's own echo", 0);
  for (const NamedParameters& m : mechanisms_) {
    if (m.mechanism == "tx_rx_leakage" || m.mechanism == "dc_offset") return;  // the twin has it already
  }
  const BodyFixedTone tone = findBodyFixedTone(data_);
  if (!isPlain(tone)) return;
  const ChannelData recorded = data_;
  subtractTone(tone, data_);
  Finding f = findingOf(tone, data_);
  std::vector<NamedParameters> with = mechanisms_;
  with.push_back(*f.mechanism);
  measureGain(recorded, mechanisms_, recorded, with, f);
  addGainInNats(data_, {}, f);
  extended_.push_back(*f.mechanism);
  result_.findings.findings.push_back(std::move(f));
}

void Session::judgeNoise() {
  const auto stated = std::find_if(mechanisms_.begin(), mechanisms_.end(),
                                   [](const NamedParameters& m) { return m.mechanism == "noise_floor"; });
  if (stated == mechanisms_.end()) return;
  std::optional<Finding> f = noiseFloorFinding(data_, *stated);
  if (!f) return;
  addGainInNats(data_, {}, *f);
  putIn(*f->mechanism, extended_);
  result_.findings.findings.push_back(std::move(*f));
}

std::vector<HypothesisFit> Session::fitBest(int round) {
  const std::vector<Hypothesis> all = hypotheses(twin_, extended_);
  std::vector<Screened> screened = ranking_->rank(all, state_);
  if (unknownNats() > 0) {  // one stands for all
    screened.erase(std::remove_if(screened.begin(), screened.end(),
                                  [](const Screened& s) { return !isCatalogued(s.hypothesis.mechanism.mechanism); }),
                   screened.end());
  }
  family_ = all.size() + static_cast<std::size_t>(kLawFamily);
  FitRound fits(*source_, *fitter_, data_, state_,
                [this](const std::string& stage, double share) { report(stage, share); });
  return fits.fit(std::move(screened), family_, round, result_.tried);
}

std::vector<PoseEchoes> Session::heldOutEchoes(const HypothesisFit& fit, const std::vector<double>& actor_range_m) {
  std::vector<PoseEchoes> echoes(data_.poses.size());
  for (int k = 0; k < kFolds; ++k) {
    std::vector<int> poses;
    for (std::size_t i = 0; i < data_.poses.size(); ++i) {
      if (fitter_->fold(data_.poses[i].location) == k) poses.push_back(static_cast<int>(i));
    }
    if (poses.empty()) continue;
    std::vector<NamedParameters> mechanisms = mechanisms_;
    putIn(fit.hypothesis.at(fit.fold_scaled[static_cast<std::size_t>(k)]), mechanisms);
    std::vector<PoseEchoes> part = source_->echoes(mechanisms, poses, actor_range_m);
    for (std::size_t j = 0; j < poses.size(); ++j) echoes[static_cast<std::size_t>(poses[j])] = std::move(part[j]);
  }
  return echoes;
}

void Session::measureGain(HypothesisFit& fit, Finding& f) {
  report("gain on held-out places", 0);
  fitter_->settleFolds(state_, fit);
  compareMaps(data_, cellPowers(data_, source_->echoes(mechanisms_)), cellPowers(data_, heldOutEchoes(fit, {})), f);
  std::vector<double> likelihood;
  model_->logLikelihood(heldOutEchoes(fit, fit.state.actor_range_m), fit.state.nuisance, &likelihood);
  source_->settle(mechanisms_);
  f.gain->log_likelihood_per_pose = likelihoodGain(data_, state_.by_pose, likelihood);
}

void Session::measureGain(const ChannelData& before_data, const std::vector<NamedParameters>& before,
                          const ChannelData& after_data, const std::vector<NamedParameters>& after, Finding& f) {
  if (data_.locations.size() < 2) return;
  const std::vector<PoseEchoes> b = source_->echoes(before), a = source_->echoes(after);
  source_->settle(mechanisms_);
  compareMaps(data_, cellPowers(before_data, b), cellPowers(after_data, a), f);
}

void Session::addMetrics(const HypothesisFit& fit, FindingGain& gain) const {
  std::vector<std::vector<NamedParameters>> after;
  for (int k = 0; k < kFolds; ++k) {
    after.push_back(extended_);
    putIn(fit.hypothesis.at(fit.fold_scaled[static_cast<std::size_t>(k)]), after.back());
  }
  addMapMetrics(
      recording_, twin_, data_, {extended_}, after, [&](int location) { return fitter_->fold(location); },
      evaluationOptions(), gain);
}

EvaluationOptions Session::evaluationOptions() const {
  EvaluationOptions options;
  options.config = options_.config;
  options.jobs = options_.jobs;
  return options;
}

/// All that rounds have found, fitted at once; what is then worth nothing beside the rest is taken back.
void Session::refitTogether() {
  while (true) {
    report("fitting all findings together", 0);
    std::vector<Hypothesis> parts;
    std::vector<std::vector<double>> start;
    for (const Accepted& a : accepted_) {
      parts.push_back(a.hypothesis);
      start.push_back(a.scaled);
    }
    const JointFit fit = fitter_->refit(before_rounds_, state_.nuisance, parts, start);
    state_.nuisance = fit.nuisance;
    std::size_t weakest = 0;
    double weakest_rate = -1;
    for (std::size_t i = 0; i < accepted_.size(); ++i) {
      Accepted& a = accepted_[i];
      a.scaled = fit.scaled[i];
      a.standard_error = fit.standard_error[i];
      const std::size_t numbers = a.hypothesis.coordinates.size();
      // There or not, or plain whatever its scatter: its own round has judged it.
      if (numbers == 0 || a.plain) continue;
      const double rate = fitter_->falseAlarmRate(fit.worth[i], a.hypothesis, numbers, family_);
      if (rate > weakest_rate) {
        weakest = i;
        weakest_rate = rate;
      }
    }
    if (weakest_rate <= kFalseAlarm || accepted_.size() < 2) break;
    const Accepted gone = accepted_[weakest];
    report("taken back: " + gone.hypothesis.label(), 1);
    std::vector<Finding>& findings = result_.findings.findings;
    findings.erase(findings.begin() + static_cast<std::ptrdiff_t>(gone.finding));
    accepted_.erase(accepted_.begin() + static_cast<std::ptrdiff_t>(weakest));
    for (Accepted& a : accepted_) a.finding -= a.finding > gone.finding ? 1 : 0;
  }
  restate();
}

/// Values and intervals of all that rounds have found, on the likelihood that is settled on them.
void Session::profileFound() {
  report("errors of what was found", 0);
  std::vector<Hypothesis> parts;
  std::vector<ProfiledValues> fits;
  for (const Accepted& a : accepted_) {
    parts.push_back(a.hypothesis);
    fits.push_back({a.scaled, a.standard_error});
  }
  profileParts(*source_, *model_, before_rounds_, state_.nuisance, accuracy_, parts, fits);
  for (std::size_t i = 0; i < accepted_.size(); ++i) {
    Accepted& a = accepted_[i];
    a.scaled = fits[i].scaled;
    a.standard_error = fits[i].standard_error;
    if (a.hypothesis.mechanism.mechanism == "channel_phase_error") {
      widenGains(data_, a.hypothesis, a.standard_error);
    }
  }
  restate();
}

/// Where paths come and go with every millimetre, the likelihood may gain much by a geometry whose numbers are no
/// larger than the actors' and poses' own errors make them (1.6 and 2 cm of registration, 255 and 269 nats, in a
/// corridor of doors and niches); an actor that is no farther away than that has not moved, whatever its likelihood
/// gains.
bool Session::isWithinErrors(const HypothesisFit& f) const {
  const Hypothesis& h = f.hypothesis;
  const auto a = acceptedAs(h);
  if (a == accepted_.end() || !(h.isMove() || h.isGeometry())) return false;
  if (h.isMove()) {
    const NamedParameters move = h.at(a->scaled);
    const Actor& actor = twin_.scene().actors[static_cast<std::size_t>(twin_.scene().actorIndex(h.subject))];
    const double reach_m = actor.bounds.sizes().head<2>().norm() / 2;
    const double farthest_m = std::hypot(move.values.number("dx_m"), move.values.number("dy_m")) +
                              std::abs(move.values.number("dyaw_deg")) * M_PI / 180 * reach_m;
    if (farthest_m < kOutOfPlace_m) return true;
  }
  if (f.plain && f.moved_m() > kFarAway_m) return false;  // an interval may be wide where the likelihood is rough
  std::vector<double> errors = a->standard_error;
  bool shifts = false;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (h.coordinates[i].unit != "m") continue;
    shifts = true;
    errors[i] = std::max(errors[i], kTogether_m);
  }
  if (f.plain && !shifts) return false;
  const double nats = natsFromNothing(h, a->scaled, errors);
  return fitter_->falseAlarmRate(nats, h, h.coordinates.size(), kWaysToErr) > kFalseAlarm;
}

/// An image, once found, is measured against its hosts and taken out: as a power it would be 2 dB high, and what that
/// leaves beside it looks like echoes.
void Session::takeOutImage() {
  const auto image = std::find_if(accepted_.begin(), accepted_.end(),
                                  [](const Accepted& a) { return a.hypothesis.mechanism.mechanism == "iq_imbalance"; });
  if (image == accepted_.end()) return;
  Finding& f = result_.findings.findings[image->finding];
  if (!measureImage(data_, f)) return;
  subtractImage(*f.mechanism, data_);
  extended_before_rounds_.push_back(*f.mechanism);
  accepted_.erase(image);
  restate();
}

/// The values of what rounds have found, wherever they stand.
void Session::restate() {
  mechanisms_ = before_rounds_;
  extended_ = extended_before_rounds_;
  for (const Accepted& a : accepted_) {
    Finding& f = result_.findings.findings[a.finding];
    f.mechanism = a.hypothesis.at(a.scaled);
    f.parameters = fittedParameters(a.hypothesis, a.scaled, a.standard_error, f.cause, data_.locations.size());
    for (FindingPlace& place : f.where) {
      const std::optional<Eigen::Vector2d> at = placeOf(*f.mechanism, twin_.scene());
      if (!place.x_m || !at) continue;
      place.x_m = at->x();
      place.y_m = at->y();
    }
    putIn(*f.mechanism, mechanisms_);
    putIn(*f.mechanism, extended_);
  }
}

/// A finding more; an unknown stays the last one. `fits`: all of its round.
void Session::accept(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding) {
  std::vector<Finding>& all = result_.findings.findings;
  const std::size_t at = all.size() - (unknownNats() > 0 ? 1 : 0);
  for (Accepted& a : accepted_) a.finding += a.finding >= at ? 1 : 0;
  std::vector<std::string> beside;
  for (const Accepted& a : accepted_) beside.push_back(a.hypothesis.label());
  accepted_.push_back({fit.hypothesis, fit.scaled, fit.standard_error, fit.plain, at, std::move(beside), {}});
  for (const HypothesisFit& other : fits) {
    const bool rival = other.hypothesis.label() != fit.hypothesis.label() && other.gain > kRival * fit.gain &&
                       isCatalogued(other.hypothesis.mechanism.mechanism);
    if (rival && accepted_.back().rivals.size() < kMostRivals) {
      accepted_.back().rivals.emplace_back(other.hypothesis, other.scaled);
    }
  }
  all.insert(all.begin() + static_cast<std::ptrdiff_t>(at), std::move(finding));
}

/// What a cause was taken for while others were not known yet may be explained as well by a simpler name beside them
/// (a transmitter's error and a turned mount look like an error of every channel): of each finding but the last, the
/// rivals of its round are fitted anew.
void Session::exchangeNames() {
  bool exchanged = false;
  for (std::size_t i = 0; i + 1 < accepted_.size(); ++i) {
    Accepted& a = accepted_[i];
    std::vector<NamedParameters> others = before_rounds_;
    for (const Accepted& other : accepted_) {
      if (&other != &a) putIn(other.hypothesis.at(other.scaled), others);
    }
    std::optional<ModelState> null;
    std::optional<HypothesisFit> own, best;
    for (const auto& [rival, scaled] : a.rivals) {
      const bool free = std::none_of(accepted_.begin(), accepted_.end(), [&](const Accepted& other) {
        return &other != &a && excludeEachOther(rival.mechanism, other.hypothesis.mechanism);
      });
      if (!free) continue;
      if (!null) {
        report("names beside what was found since", 0);
        source_->settle(others);
        null = fitter_->state(others, &state_.nuisance);
        own = fitter_->fit(*null, a.hypothesis, {a.scaled});
      }
      HypothesisFit f = fitter_->fit(*null, rival, {scaled});
      fitter_->judge(f, family_);
      if (f.false_alarm_rate > kFalseAlarm || f.ranking() <= (best ? *best : *own).ranking()) continue;
      best = std::move(f);
    }
    if (!best) continue;
    const std::string was = a.hypothesis.label();
    report("found " + best->hypothesis.label() + " instead of " + was, 1);
    for (TriedHypothesis& t : result_.tried) {
      if (t.label == was && t.verdict == "found") t.verdict = "found, later called " + best->hypothesis.label();
    }
    Finding& f = result_.findings.findings[a.finding];
    f = findingOf(*best, {*best, *own}, *null, twin_.scene(), data_);
    if (data_.locations.size() > 1) f.gain.emplace();
    a.hypothesis = best->hypothesis;
    a.scaled = best->scaled;
    a.standard_error = best->standard_error;
    a.plain = best->plain;
    a.beside.reset();
    a.rivals.clear();
    state_.nuisance = best->state.nuisance;
    exchanged = true;
  }
  if (!exchanged) return;
  restate();
  refitTogether();
  source_->settle(mechanisms_);
  profileFound();
}

/// Findings of rounds by falling gain, an unknown last; gains that were measured beside others than those that now
/// stand before them are measured again.
void Session::orderByGain() {
  std::vector<Finding>& all = result_.findings.findings;
  std::vector<std::size_t> places;
  for (const Accepted& a : accepted_) places.push_back(a.finding);
  std::sort(places.begin(), places.end());
  std::stable_sort(accepted_.begin(), accepted_.end(), [&](const Accepted& a, const Accepted& b) {
    const Finding &x = all[a.finding], &y = all[b.finding];
    if ((x.cause == "unknown") != (y.cause == "unknown")) return y.cause == "unknown";
    return x.evidence.log_likelihood_gain > y.evidence.log_likelihood_gain;
  });
  std::vector<Finding> ordered;
  for (const Accepted& a : accepted_) ordered.push_back(std::move(all[a.finding]));
  for (std::size_t i = 0; i < places.size(); ++i) {
    all[places[i]] = std::move(ordered[i]);
    accepted_[i].finding = places[i];
  }
  const Nuisance found = state_.nuisance;
  mechanisms_ = before_rounds_;
  extended_ = extended_before_rounds_;
  std::vector<std::string> before;
  for (const Accepted& a : accepted_) {
    if (!a.beside || !std::is_permutation(a.beside->begin(), a.beside->end(), before.begin(), before.end())) {
      measureAgain(a);
    }
    before.push_back(a.hypothesis.label());
    putIn(a.hypothesis.at(a.scaled), mechanisms_);
    putIn(a.hypothesis.at(a.scaled), extended_);
  }
  state_.nuisance = found;
}

/// A finding's gain over mechanisms_, in nats, maps and metrics.
void Session::measureAgain(const Accepted& a) {
  report("gain of " + a.hypothesis.label() + " beside those before it", 0);
  Finding& f = result_.findings.findings[a.finding];
  source_->settle(mechanisms_);
  const Nuisance nuisance = state_.nuisance;
  state_ = fitter_->state(mechanisms_, &nuisance);
  HypothesisFit fit = fitter_->fit(state_, a.hypothesis, {a.scaled});
  fitter_->judge(fit, family_);
  tellGain(fit, state_, data_, f);
  if (!f.gain) return;  // one location
  f.where.front().range_m = f.where.front().azimuth_deg = std::nullopt;
  measureGain(fit, f);
  addMetrics(fit, *f.gain);
}

/// What every finding changes of the paths of the twin with those before it, and of the paper's metrics where its round
/// has not told.
void Session::tellChanges() {
  std::vector<NamedParameters> mechanisms = twin_.description().mechanisms;
  for (Finding& f : result_.findings.findings) {
    if (!f.mechanism) continue;
    report("what " + f.cause + " changes", 0);
    std::vector<NamedParameters> with = mechanisms;
    putIn(*f.mechanism, with);
    const bool of_frames = std::any_of(received_.frames.begin(), received_.frames.end(),
                                       [&](const FrameFinding& frames) { return frames.cause == f.cause; });
    if (f.maps && f.gain && std::isnan(f.gain->recall.after) && !of_frames) {
      addMapMetrics(
          recording_, twin_, data_, {mechanisms}, {with}, [](int) { return 0; }, evaluationOptions(), *f.gain);
    }
    std::vector<std::string> poses;
    for (const FindingPlace& place : f.where) poses.insert(poses.end(), place.poses.begin(), place.poses.end());
    f.records = changedRecords(twin_, data_, poses, mechanisms, with);
    mechanisms = std::move(with);
  }
}

bool Session::judgeChannels(int round) {
  std::vector<HypothesisFit> fits = fitBest(round);
  believeAbsences(fits);
  believeMoves(fits, twin_.scene());
  believeBetterNames(fits, state_);
  struct Refused {
    Eigen::VectorXd gain;  // by pose
    bool of_one_actor;
  };
  std::vector<Refused> refused;
  const double unknown_nats = unknownNats();
  for (HypothesisFit& f : fits) {
    std::string& verdict = triedAs(f, round, result_.tried).verdict;
    verdict = f.ranking() <= 0                         ? "gains less than its numbers cost"
              : f.false_alarm_rate > kFalseAlarm       ? "chance could do as well"
              : !(f.held_out_gain > 0)                 ? "loses on places not fitted"
              : f.gain < kBesideUnknown * unknown_nats ? "little beside what is unknown"
                                                       : noFindingBecause(f, received_.frames);
    if (!verdict.empty()) continue;
    Finding finding = findingOf(f, fits, state_, twin_.scene(), data_);
    if (data_.locations.size() > 1) {
      measureGain(f, finding);
      // Where the likelihood gains little and the maps nothing, it is the likelihood's own shortcomings that were
      // fitted: what a pose's error does at edges looks like a little of many things. Much of it may be real though no
      // map shows it (an image at -26 dB), unless the maps get plainly worse.
      const auto explained = *finding.gain->explained_power.difference_ci95;
      const double by = finding.gain->explained_power.after - finding.gain->explained_power.before;
      const bool in_maps = explained[0] > 0 && by >= kLeastExplained;
      const bool likelier = (*finding.gain->log_likelihood_per_pose.difference_ci95)[0] > 0;
      const auto refuse = [&](const std::string& why) {
        verdict = why + ": " + number(by, 2) + " (" + number(explained[0], 2) + " to " + number(explained[1], 2) + ")";
      };
      const bool sure = explained[0] > 0 && likelier;
      if (!(in_maps && likelier) && isLikeClutter(f, by >= kLeastExplained, sure)) {
        refuse("clutter is like that, by what the maps gain");
        continue;
      }
      const bool traces = source_->altersGeometry(f.hypothesis.at(f.scaled));
      const double least_nats = leastNats(f.hypothesis, f.scaled, traces, data_.poses.size());
      const bool plainly_worse = explained[1] < 0 && by < -kLeastExplained;
      const bool in_nats = !plainly_worse && f.broad_gain / f.inflation > least_nats;
      // Maps of echoes that are many points' differ from what is expected of them by as much as they hold.
      const bool much = likelier && ((f.plain && (by > -kMostLost || !plainly_worse)) || in_nats);
      // What explains less well what a better one was refused for is no name for it. Beside that, a law without a name
      // may be the cause of something else, and what one actor's place explains leaves other names as they are.
      const Eigen::VectorXd explains = gainByPose(f, state_);
      const bool named = isCatalogued(f.hypothesis.mechanism.mechanism);
      const bool again = std::any_of(refused.begin(), refused.end(), [&](const auto& other) {
        return (named && !other.of_one_actor) || correlation(explains, other.gain) > kExplainsSame;
      });
      if (!in_maps && (!much || again)) {
        if (likelier) refused.push_back({explains, false});
        refuse("the maps gain nothing");
        continue;
      }
      addMetrics(f, *finding.gain);
    }
    verdict = "found";
    report("found " + f.hypothesis.label() + ", " + number(f.gain, 4) + " nats", 1);
    const auto accepted = accepted_;
    const auto findings = result_.findings.findings;
    const Nuisance latents = state_.nuisance;
    if (source_->altersGeometry(*finding.mechanism)) ranking_->tryAllAgain();
    accept(f, fits, std::move(finding));
    state_.nuisance = f.state.nuisance;
    restate();
    if (accepted_.size() > 1) refitTogether();
    source_->settle(mechanisms_);
    const bool stands = acceptedAs(f.hypothesis) != accepted_.end();
    if (stands) profileFound();
    if (!stands || isWithinErrors(f)) {
      accepted_ = accepted;
      result_.findings.findings = findings;
      restate();
      state_.nuisance = latents;
      source_->settle(mechanisms_);
      refused.push_back({gainByPose(f, state_), stands && f.hypothesis.isMove()});
      verdict = stands ? "no larger than what errors of actors and poses look like" : "worth nothing beside the rest";
      report("taken back: " + f.hypothesis.label(), 1);
      continue;
    }
    exchangeNames();
    takeOutImage();
    source_->settle(mechanisms_);
    const Nuisance nuisance = state_.nuisance;
    state_ = fitter_->state(mechanisms_, &nuisance);
    return true;
  }
  return false;
}

Diagnosis Session::run() {
  const auto add = [&](Finding finding, const std::map<std::string, double>& nats_by_pose = {}) {
    if (!isNews(finding, twin_.description().mechanisms)) return;
    addGainInNats(data_, nats_by_pose, finding);
    putIn(*finding.mechanism, extended_);
    result_.findings.findings.push_back(std::move(finding));
  };
  for (const FrameFinding& f : received_.frames) add(findingOf(f), f.nats_by_pose);
  measureFrameGain();
  for (const Delivery& d : received_.deliveries) add(findingOf(d, data_.radar));
  const std::optional<std::string> convention = few_ ? std::nullopt : judgeDelivery();
  source_->settle(mechanisms_);
  judgeTone();
  judgeNoise();
  if (few_) {
    if (const std::optional<ChannelErrors> errors = findChannelErrors(data_)) add(findingOf(*errors));
  }
  report("fitting the twin as it is", 0);
  source_->pointBeams(data_, mechanisms_, model_->firstBin());
  source_->settle(mechanisms_);
  state_ = fitter_->state(mechanisms_, nullptr);
  for (Finding& f : result_.findings.findings) {
    if (f.cause != "tx_rx_leakage" && f.cause != "dc_offset") continue;
    referToStrongestEcho(twin_.changed(mechanisms_), data_, f);
    putIn(*f.mechanism, extended_);
  }
  for (const TwinDescription& t : options_.compared) {
    const ModelState other = fitter_->state(t.mechanisms, &state_.nuisance);
    auto [low, high] = *likelihoodGain(data_, state_.by_pose, other.by_pose).difference_ci95;
    const double poses = static_cast<double>(data_.poses.size());
    source_->settle(t.mechanisms);
    result_.compared.push_back({t.file,
                                other.log_likelihood - state_.log_likelihood,
                                {poses * low, poses * high},
                                explainedPower(cellPowers(data_, source_->echoes(t.mechanisms)))});
  }
  source_->settle(mechanisms_);
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
    before_rounds_ = mechanisms_;
    extended_before_rounds_ = extended_;
    for (int round = 0; round < (few_ ? 0 : options_.most_findings); ++round) {
      if (!judgeChannels(round)) break;
    }
    orderByGain();
    for (Finding& f : findings.findings) {
      if (f.cause != "second_harmonic") continue;
      referToStrongestHost(twin_.changed(mechanisms_), data_, state_.nuisance.log_gain, strongest_amplitude_, f);
      putIn(*f.mechanism, extended_);
    }
    addUnexplained(received_.unexplained, data_, twin_.description().mechanisms, findings, extended_);
  }
  tellChanges();
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
  return Session(recording, twin, options).run();
}

}  // namespace mmradartwin
