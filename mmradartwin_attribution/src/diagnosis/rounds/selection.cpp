#include "diagnosis/rounds/selection.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/fit/hypothesis_fitter.h"
#include "diagnosis/fit/profiled_values.h"
#include "diagnosis/hypotheses/fitted_parameters.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/receiver/receiver_image.h"
#include "diagnosis/rounds/hypothesis_finding.h"
#include "diagnosis/rounds/knife_edges.h"
#include "diagnosis/rounds/pattern_curve.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

constexpr std::size_t kGeometriesOfCommonErrors = 4;  ///< geometries that common errors of actors and poses resemble
constexpr std::size_t kMostRivals = 2;                ///< rivals kept of each finding

}  // namespace

Selection::Selection(DiagnosisContext& context, GainMeasurement& gains, std::vector<Finding>& findings,
                     std::vector<TriedHypothesis>& tried)
    : context_(context), gains_(gains), findings_(findings), tried_(tried) {}

void Selection::begin(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& extended,
                      ModelState state) {
  mechanisms_ = before_rounds_ = mechanisms;
  extended_ = extended_before_rounds_ = extended;
  state_ = std::move(state);
}

std::vector<Selection::Accepted>::const_iterator Selection::acceptedAs(const Hypothesis& h) const {
  return std::find_if(accepted_.begin(), accepted_.end(),
                      [&](const Accepted& a) { return a.hypothesis.label() == h.label(); });
}

double Selection::unknownNats() const {
  return accepted_.empty() || findings_.back().cause != "unknown" ? 0 : findings_.back().evidence.log_likelihood_gain;
}

std::string Selection::take(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding,
                            std::size_t family) {
  const auto accepted = accepted_;
  const auto findings = findings_;
  const SessionLatents latents_before = state_.latents;
  const bool profiled_before = all_profiled_;
  family_ = family;
  accept(fit, fits, std::move(finding));
  state_.latents = fit.state.latents;
  writeBackFindings();
  if (accepted_.size() > 1) refitTogether();
  context_.echoes.setBaseline(mechanisms_);
  if (acceptedAs(fit.hypothesis) != accepted_.end()) {
    // An unknown judges all others by their intervals; the last round profiles what is left.
    profileFound(unknownNats() > 0 ? std::nullopt : std::optional<std::size_t>(accepted_.size() - 1));
    withdrawExplainedByUnknown();
  }
  const bool stands = acceptedAs(fit.hypothesis) != accepted_.end();
  const bool is_nothing = stands && mayBeNothing(fit.hypothesis);
  const std::string implausible =
      stands ? implausibility(fit.hypothesis.at(acceptedAs(fit.hypothesis)->scaled_values)) : "";
  if (!stands || is_nothing || !implausible.empty() || isWithinErrors(fit)) {
    accepted_ = accepted;
    findings_ = findings;
    writeBackFindings();
    state_.latents = latents_before;
    all_profiled_ = profiled_before;
    context_.echoes.setBaseline(mechanisms_);
    if (is_nothing) return "its interval holds the value that does nothing";
    if (!implausible.empty()) return implausible;
    return stands ? "no larger than what errors of actors and poses look like" : "worth nothing beside the rest";
  }
  for (const Accepted& before : accepted) {
    if (acceptedAs(before.hypothesis) == accepted_.end()) {
      renameVerdict(before.hypothesis.label(), "found, taken back beside " + fit.hypothesis.label());
    }
  }
  exchangeNames();
  joinPattern();
  takeOutImage();
  refitState();
  return "";
}

void Selection::allowFor(const std::vector<HypothesisFit>& things) {
  for (const HypothesisFit& thing : things) before_rounds_.push_back(thing.hypothesis.at(thing.scaled_values));
  writeBackFindings();
  refitState();
}

std::optional<double> Selection::takeKnifeEdges() {
  std::optional<ModelState> graded = likelierWithKnifeEdges(context_, state_);
  if (!graded) return std::nullopt;
  const double nats = graded->log_likelihood - state_.log_likelihood;
  before_rounds_ = *withKnifeEdges(std::move(before_rounds_));
  extended_before_rounds_ = *withKnifeEdges(std::move(extended_before_rounds_));
  state_ = std::move(*graded);
  writeBackFindings();
  if (!accepted_.empty()) {
    refitAndProfile();
    refitState();
    for (Accepted& a : accepted_) a.beside.reset();
  }
  return nats;
}

/// Fits all findings of rounds jointly, and withdraws findings that then gain nothing given the others.
void Selection::refitTogether() {
  while (true) {
    context_.report("fitting all findings together", 0);
    std::vector<Hypothesis> parts;
    std::vector<std::vector<double>> start;
    for (const Accepted& a : accepted_) {
      parts.push_back(a.hypothesis);
      start.push_back(a.scaled_values);
    }
    const JointFit fit = context_.fitter.refit(before_rounds_, state_.latents, parts, start);
    state_.latents = fit.latents;
    std::size_t weakest = 0;
    double weakest_rate = -1;
    for (std::size_t i = 0; i < accepted_.size(); ++i) {
      Accepted& a = accepted_[i];
      a.scaled_values = fit.scaled_values[i];
      a.standard_error = fit.standard_error[i];
      const std::size_t numbers = a.hypothesis.coordinates.size();
      // A finding without numbers, or with an overwhelming gain, was judged by its own round. A law is judged again: it
      // may have stood for a named cause that had not been fitted yet.
      a.plain_beside_others = a.overwhelming && context_.fitter.isOverwhelming(fit.evidence[i].nats);
      const bool plausible = implausibility(a.hypothesis.at(a.scaled_values)).empty();
      if (plausible && (numbers == 0 || a.plain_beside_others)) continue;
      const double rate =
          plausible ? context_.fitter.falseAlarmRate(fit.evidence[i].scattered(), a.hypothesis, numbers, family_) : 1;
      if (rate > weakest_rate) {
        weakest = i;
        weakest_rate = rate;
      }
    }
    if (weakest_rate <= bounds::kFalseAlarmRateOfRound || accepted_.size() < 2) break;
    withdraw(weakest);
  }
  writeBackFindings();
}

void Selection::withdraw(std::size_t i) {
  const Accepted gone = accepted_[i];
  context_.report("taken back: " + gone.hypothesis.label(), 1);
  findings_.erase(findings_.begin() + static_cast<std::ptrdiff_t>(gone.finding));
  accepted_.erase(accepted_.begin() + static_cast<std::ptrdiff_t>(i));
  for (Accepted& a : accepted_) a.finding -= a.finding > gone.finding ? 1 : 0;
}

/// Withdraws causes of all echoes that are no larger than their own errors where something is unknown: the residual of
/// the unknown's law resembles a little of such a cause. See
/// docs/verification/calibration_of_bounds.md#causes-beside-an-unknown.
void Selection::withdrawExplainedByUnknown() {
  const auto is_doubtful = [&](const Accepted& a) {
    const Hypothesis& h = a.hypothesis;
    if (!isCatalogued(h.mechanism.mechanism) || !h.subject.empty() || h.isGeometry() || h.coordinates.empty()) {
      return false;
    }
    if (a.plain_beside_others) return false;  // whatever its interval says, which is wide where a number is a level
    const std::size_t numbers = h.coordinates.size();
    return context_.fitter.falseAlarmRate(natsFromNothing(h, a.scaled_values, a.standard_error), h, numbers, family_) >
           bounds::kFalseAlarmRateOfRound;
  };
  bool taken = false;
  while (unknownNats() > 0) {
    const auto doubtful = std::find_if(accepted_.begin(), accepted_.end(), is_doubtful);
    if (doubtful == accepted_.end()) break;
    withdraw(static_cast<std::size_t>(doubtful - accepted_.begin()));
    taken = true;
  }
  if (taken) refitAndProfile();
}

void Selection::refitAndProfile() {
  refitTogether();
  context_.echoes.setBaseline(mechanisms_);
  profileFound(std::nullopt);
}

void Selection::renameVerdict(const std::string& label, const std::string& verdict) {
  for (TriedHypothesis& t : tried_) {
    if (t.label == label && t.verdict == "found") t.verdict = verdict;
  }
}

/// Profiles the values and intervals of all findings of rounds, or of only one and what is profiled with it.
void Selection::profileFound(std::optional<std::size_t> only) {
  context_.report("errors of what was found", 0);
  // A climb of the values leaves the latents short of their optimum, from where other values look likelier. What
  // follows starts from where the climb left them: latents at their optimum take in what a further cause would explain.
  const SessionLatents latents = context_.fitter.state(mechanisms_, &state_.latents).latents;
  std::vector<Hypothesis> parts;
  std::vector<ProfiledValues> fits;
  for (const Accepted& a : accepted_) {
    parts.push_back(a.hypothesis);
    fits.push_back({a.scaled_values, a.standard_error});
  }
  all_profiled_ = profileParts({context_.echoes, context_.likelihood, context_.pose_accuracy, before_rounds_, latents},
                               parts, fits, only);
  for (std::size_t i = 0; i < accepted_.size(); ++i) {
    Accepted& a = accepted_[i];
    a.scaled_values = fits[i].scaled_values;
    a.standard_error = fits[i].standard_error;
    if (a.hypothesis.form() == MechanismForm::kChannelErrors) {
      widenGains(context_.data, a.hypothesis, a.standard_error);
    }
  }
  writeBackFindings();
}

/// True where the 95 % interval of what was found holds the values that do nothing. One-sided numbers have no such
/// interval: they are there or not.
bool Selection::mayBeNothing(const Hypothesis& hypothesis) const {
  const auto found = acceptedAs(hypothesis);
  if (hypothesis.coordinates.empty() || hypothesis.isOneSided()) return false;
  const boost::math::chi_squared distribution(static_cast<double>(hypothesis.coordinates.size()));
  return 2 * natsFromNothing(hypothesis, found->scaled_values, found->standard_error) <
         boost::math::quantile(distribution, 0.95);
}

/// True of a geometry whose numbers are within the errors of actors and poses, and of a move within an actor's range
/// error. The likelihood may gain much by either where paths appear and vanish with each millimetre. See
/// docs/verification/calibration_of_bounds.md#sure-offset.
bool Selection::isWithinErrors(const HypothesisFit& fit) const {
  const Hypothesis& hypothesis = fit.hypothesis;
  const auto accepted = acceptedAs(hypothesis);
  if (accepted == accepted_.end() || !(hypothesis.isMove() || hypothesis.isGeometry())) return false;
  const double per_pose =
      fit.gain_without_best_place / fit.overdispersion / static_cast<double>(context_.data.poses.size());
  if (hypothesis.isMove()) {
    const NamedParameters move = hypothesis.at(accepted->scaled_values);
    const Actor& actor =
        context_.twin.scene().actors[static_cast<std::size_t>(context_.twin.scene().actorIndex(hypothesis.subject))];
    const double reach_m = actor.bounds.sizes().head<2>().norm() / 2;
    const double farthest_m = std::hypot(move.values.number("dx_m"), move.values.number("dy_m")) +
                              std::abs(move.values.number("dyaw_deg")) * M_PI / 180 * reach_m;
    const bool is_sure = farthest_m > fit.stated.leastMove_m() && per_pose > bounds::kLeastNatsOfOffsetPerPose;
    if (farthest_m < fit.stated.mostRangeError_m() && !is_sure) return true;
  }
  // The interval of an offset may be wide where the likelihood is rough. A large offset with much evidence is therefore
  // accepted whatever its interval.
  const bool is_aside = hypothesis.isGeometry() && fit.moved_m() > fit.stated.sureOffset_m() &&
                        per_pose > bounds::kLeastNatsOfOffsetPerPose;
  if (fit.isFarAway() || is_aside) return false;
  std::vector<double> errors = accepted->standard_error;
  bool shifts = false;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (hypothesis.coordinates[i].unit != "m") continue;
    shifts = true;
    errors[i] = std::max(errors[i], fit.stated.commonOffset_m());
  }
  if (fit.overwhelming && !shifts) return false;
  const double nats = natsFromNothing(hypothesis, accepted->scaled_values, errors);
  return context_.fitter.falseAlarmRate(nats, hypothesis, hypothesis.coordinates.size(), kGeometriesOfCommonErrors) >
         bounds::kFalseAlarmRateOfRound;
}

/// Measures a receiver image that was found against its hosts, and removes it from the data. Fitted as a power, its
/// level would be some 2 dB high and its residual would look like echoes.
void Selection::takeOutImage() {
  const auto image = std::find_if(accepted_.begin(), accepted_.end(), [](const Accepted& a) {
    return a.hypothesis.form() == MechanismForm::kReceiverImage;
  });
  if (image == accepted_.end()) return;
  Finding& f = findings_[image->finding];
  if (!measureImage(context_.data, f)) return;
  subtractImage(*f.mechanism, context_.data);
  extended_before_rounds_.push_back(*f.mechanism);
  accepted_.erase(image);
  writeBackFindings();
}

/// Writes the fitted values of all findings of rounds into the findings and the two lists of mechanisms.
void Selection::writeBackFindings() {
  mechanisms_ = before_rounds_;
  extended_ = extended_before_rounds_;
  for (const Accepted& a : accepted_) {
    Finding& finding = findings_[a.finding];
    finding.mechanism = a.hypothesis.at(a.scaled_values);
    finding.parameters = fittedParameters(a.hypothesis, a.scaled_values, a.standard_error, finding.cause,
                                          context_.data.locations.size());
    for (FindingPlace& place : finding.where) {
      const std::optional<Eigen::Vector2d> at = placeOf(*finding.mechanism, context_.twin.scene());
      if (!place.x_m || !at) continue;
      place.x_m = at->x();
      place.y_m = at->y();
    }
    replaceOrAppend(*finding.mechanism, mechanisms_);
    replaceOrAppend(*finding.mechanism, extended_);
  }
}

/// Adds a finding; an unknown stays last. fits: all fits of its round.
void Selection::accept(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding) {
  const std::size_t at = findings_.size() - (unknownNats() > 0 ? 1 : 0);
  for (Accepted& a : accepted_) a.finding += a.finding >= at ? 1 : 0;
  std::vector<std::string> beside;
  for (const Accepted& a : accepted_) beside.push_back(a.hypothesis.label());
  accepted_.push_back(
      {fit.hypothesis, fit.scaled_values, fit.standard_error, fit.overwhelming, at, std::move(beside), {}});
  for (const HypothesisFit& other : fits) {
    // Fits ahead of this one were rejected.
    const bool rival = other.ranking() < fit.ranking() && other.numbers() < fit.numbers() &&
                       other.gain > bounds::kLeastShareOfRival * fit.gain &&
                       isCatalogued(other.hypothesis.mechanism.mechanism);
    if (rival && accepted_.back().rivals.size() < kMostRivals) {
      accepted_.back().rivals.emplace_back(other.hypothesis, other.scaled_values);
    }
  }
  findings_.insert(findings_.begin() + static_cast<std::ptrdiff_t>(at), std::move(finding));
}

/// Rival of a finding's round that explains more than the finding, given all other findings; it then replaces the
/// finding. Nothing where there is none.
std::optional<HypothesisFit> Selection::betterName(const Accepted& accepted) {
  std::vector<NamedParameters> others = before_rounds_;
  for (const Accepted& other : accepted_) {
    if (&other != &accepted) replaceOrAppend(other.hypothesis.at(other.scaled_values), others);
  }
  std::optional<ModelState> null;
  std::optional<HypothesisFit> own, best;
  for (const auto& [rival, scaled_values] : accepted.rivals) {
    const bool free = std::none_of(accepted_.begin(), accepted_.end(), [&, &r = rival](const Accepted& other) {
      return &other != &accepted && excludeEachOther(r.mechanism, other.hypothesis.mechanism);
    });
    if (!free) continue;
    if (!null) {
      context_.report("names beside what was found since", 0);
      context_.echoes.setBaseline(others);
      null = context_.fitter.state(others, &state_.latents);
      own = context_.fitter.fit(*null, accepted.hypothesis, {accepted.scaled_values});
    }
    HypothesisFit f = context_.fitter.fit(*null, rival, {scaled_values});
    context_.fitter.judge(f, family_);
    const bool stands = f.false_alarm_rate <= bounds::kFalseAlarmRateOfRound && rejectionReason(f, {}).empty();
    if (!stands || f.ranking() <= (best ? *best : *own).ranking()) continue;
    best = std::move(f);
  }
  if (!best) return best;
  Finding& f = findings_[accepted.finding];
  f = findingOf(*best, {*best, *own}, *null, context_.twin.scene(), context_.data);
  if (context_.data.locations.size() > 1) f.gain.emplace();
  return best;
}

/// Fits the rivals of each finding but the last again. A cause that was named before others were known may have a
/// simpler name given them: a transmitter's error and a turned mount together look like an error of every channel.
void Selection::exchangeNames() {
  bool exchanged = false;
  for (std::size_t i = 0; i + 1 < accepted_.size(); ++i) {
    Accepted& a = accepted_[i];
    const std::optional<HypothesisFit> better = betterName(a);
    if (!better) continue;
    const std::string was = a.hypothesis.label(), is = better->hypothesis.label();
    context_.report("found " + is + " instead of " + was, 1);
    renameVerdict(was, "found, later called " + is);
    a = {better->hypothesis, better->scaled_values, better->standard_error, better->overwhelming, a.finding, {}, {}};
    state_.latents = better->state.latents;
    exchanged = true;
  }
  if (exchanged) refitAndProfile();
}

/// A pattern of the elements that is a power of the cosine, and a law without a name of all levels over the same angle,
/// are one pattern that is a curve. It takes the place of both where the data are as likely under it.
void Selection::joinPattern() {
  const auto pattern = std::find_if(accepted_.begin(), accepted_.end(), [](const Accepted& a) {
    return angleOfPattern(a.hypothesis).has_value() && a.hypothesis.variant.empty();
  });
  if (pattern == accepted_.end()) return;
  const auto law = std::find_if(accepted_.begin(), accepted_.end(), [&](const Accepted& a) {
    return isLawOfAllLevels(a.hypothesis, *angleOfPattern(pattern->hypothesis));
  });
  if (law == accepted_.end()) return;
  context_.report("the pattern as a curve", 0);
  const auto [curve, start] = patternCurve(pattern->hypothesis, pattern->hypothesis.at(pattern->scaled_values).values,
                                           law->hypothesis.at(law->scaled_values).values);
  std::vector<NamedParameters> others = before_rounds_;
  for (const Accepted& a : accepted_) {
    if (&a != &*pattern && &a != &*law) replaceOrAppend(a.hypothesis.at(a.scaled_values), others);
  }
  refitState();  // with both
  const double with_both = state_.log_likelihood;
  context_.echoes.setBaseline(others);
  const ModelState null = context_.fitter.state(others, &state_.latents);
  HypothesisFit fit = context_.fitter.fit(null, curve, {start});
  context_.fitter.judge(fit, family_);
  if (fit.state.log_likelihood < with_both - bounds::kNotToldApart_nats) {
    context_.echoes.setBaseline(mechanisms_);
    return;
  }
  context_.report("found " + fit.hypothesis.label() + " instead of two laws", 1);
  renameVerdict(pattern->hypothesis.label(), "found, later called " + fit.hypothesis.label());
  renameVerdict(law->hypothesis.label(), "found, later a part of " + fit.hypothesis.label());
  const std::size_t at = pattern->finding;
  findings_[at] = findingOf(fit, {fit}, null, context_.twin.scene(), context_.data);
  if (context_.data.locations.size() > 1) findings_[at].gain.emplace();
  accepted_[static_cast<std::size_t>(pattern - accepted_.begin())] = {
      fit.hypothesis, fit.scaled_values, fit.standard_error, fit.overwhelming, at, {}, {}};
  state_.latents = fit.state.latents;
  withdraw(static_cast<std::size_t>(law - accepted_.begin()));
  refitAndProfile();
}

void Selection::finish() {
  if (!all_profiled_) {
    profileFound(std::nullopt);
    refitState();
  }
  orderByGain();
}

/// Fits the latents given all findings.
void Selection::refitState() {
  context_.echoes.setBaseline(mechanisms_);
  const SessionLatents latents = state_.latents;
  state_ = context_.fitter.state(mechanisms_, &latents);
}

/// Sorts what was found by its gain, and measures gains again where the order changed.
void Selection::orderByGain() {
  std::vector<std::size_t> places;
  for (const Accepted& a : accepted_) places.push_back(a.finding);
  std::sort(places.begin(), places.end());
  std::stable_sort(accepted_.begin(), accepted_.end(), [&](const Accepted& a, const Accepted& b) {
    const Finding &x = findings_[a.finding], &y = findings_[b.finding];
    if ((x.cause == "unknown") != (y.cause == "unknown")) return y.cause == "unknown";
    return x.evidence.log_likelihood_gain > y.evidence.log_likelihood_gain;
  });
  std::vector<Finding> ordered;
  for (const Accepted& a : accepted_) ordered.push_back(std::move(findings_[a.finding]));
  for (std::size_t i = 0; i < places.size(); ++i) {
    findings_[places[i]] = std::move(ordered[i]);
    accepted_[i].finding = places[i];
  }
  const SessionLatents found = state_.latents;
  mechanisms_ = before_rounds_;
  extended_ = extended_before_rounds_;
  std::vector<std::string> before;
  bool measured = false;
  for (const Accepted& a : accepted_) {
    if (!a.beside || !std::is_permutation(a.beside->begin(), a.beside->end(), before.begin(), before.end())) {
      measureAgain(a);
      measured = true;
    }
    before.push_back(a.hypothesis.label());
    replaceOrAppend(a.hypothesis.at(a.scaled_values), mechanisms_);
    replaceOrAppend(a.hypothesis.at(a.scaled_values), extended_);
  }
  state_.latents = found;
  if (!measured) return;
  refitState();  // by it the rest of the session is judged
}

/// Measures a finding's gain over mechanisms_ again, in nats, explained power and metrics.
void Selection::measureAgain(const Accepted& a) {
  context_.report("gain of " + a.hypothesis.label() + " beside those before it", 0);
  Finding& finding = findings_[a.finding];
  refitState();
  HypothesisFit fit = context_.fitter.fit(state_, a.hypothesis, {a.scaled_values});
  context_.fitter.judge(fit, family_);
  describeGain(fit, state_, context_.data, finding);
  if (!finding.gain) return;  // with one location there is no gain
  finding.where.front().range_m = finding.where.front().azimuth_deg = std::nullopt;
  gains_.ofFit(state_, fit, finding);
  gains_.addMetrics(extended_, fit, *finding.gain);
}

}  // namespace mmradartwin::diagnosis::rounds
