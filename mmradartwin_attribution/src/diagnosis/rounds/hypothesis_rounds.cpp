#include "diagnosis/rounds/hypothesis_rounds.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "diagnosis/numbers/number_text.h"
#include "diagnosis/receiver/receiver_image.h"
#include "diagnosis/rounds/fit_round.h"
#include "diagnosis/rounds/hypothesis_finding.h"
#include "diagnosis/rounds/map_evidence.h"
#include "diagnosis/rounds/move_within_errors.h"
#include "diagnosis/search/law_screen.h"
#include "diagnosis/search/places_apart.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

constexpr std::size_t kMostRangeErrors = 4;  ///< actors whose range error is searched for in a round
constexpr std::size_t kMostAllowedFor =
    12;  ///< things that stand out of the clutter and moves within the scene's error

/// True of a transmitter's delay that is no larger than its error: its phase alone is another cause's.
bool isPhaseOnly(const HypothesisFit& fit) {
  if (fit.hypothesis.form() != MechanismForm::kTransmitterDelay) return false;
  for (std::size_t j = 0; j < fit.scaled_values.size(); ++j) {
    const Coordinate& c = fit.hypothesis.coordinates[j];
    if (c.unit != "m") continue;
    return std::abs(c.value(fit.scaled_values[j])) <
           std::max(bounds::kLeastDelay_m, bounds::kLeastDelay_sigmas * fit.standard_error[j]);
  }
  return false;
}

/// True of two small things at one place. What lies about on an actor is at no place.
bool isSameThing(const HypothesisFit& a, const HypothesisFit& b) {
  if (a.hypothesis.form() != MechanismForm::kUnmodelledObject || b.hypothesis.form() != a.hypothesis.form()) {
    return false;
  }
  const Parameters p = a.hypothesis.at(a.scaled_values).values, q = b.hypothesis.at(b.scaled_values).values;
  return std::hypot(p.number("x_m") - q.number("x_m"), p.number("y_m") - q.number("y_m")) < kPlacesApart_m;
}

/// Gives a receiver's image the pattern over the receivers that the data show, where they differ. One level is fitted.
void setMeasuredImage(const ChannelData& data, std::vector<Hypothesis>& all) {
  for (Hypothesis& h : all) {
    if (h.form() != MechanismForm::kReceiverImage || h.stated || h.coordinates.size() != 1) continue;
    const std::optional<receiver::MeasuredImage> image = receiver::readImage(data);
    if (!image || !image->differ) return;
    const double rms = std::sqrt(image->beta.squaredNorm() / static_cast<double>(image->beta.size()));
    std::vector<double> level_db, phase_deg;
    for (const std::complex<double>& beta : image->beta) {
      level_db.push_back(20 * std::log10(std::abs(beta) / rms));
      phase_deg.push_back(std::arg(beta) * 180 / M_PI);
    }
    h.coordinates.front().shape.assign(level_db.size(), 1.0);
    h.mechanism.values.set(h.coordinates.front().parameter, std::move(level_db));
    h.mechanism.values.set("phase_deg", std::move(phase_deg));
    h.variant = "of each receiver";
    h.searched = 2 * static_cast<int>(image->beta.size()) - 1;
  }
}

}  // namespace

HypothesisRounds::HypothesisRounds(DiagnosisContext& context, GainMeasurement& gains,
                                   const std::vector<FrameFinding>& frames, Diagnosis& result)
    : context_(context),
      gains_(gains),
      frames_(frames),
      result_(result),
      ranking_(context),
      selection_(context, gains, result.findings.findings, result.tried) {}

std::vector<RangeShift> HypothesisRounds::takeRangeErrors(ModelState& state) {
  const double most_error_m = StatedBounds(context_.accuracy).mostRangeError_m();
  std::vector<RangeShift> shifted = ranking_.shifted(state);
  const auto is_error = [&](const RangeShift& shift) {
    if (std::abs(shift.shift_m) > most_error_m) return false;
    SessionLatents latents = withoutErrors(state.latents, shift.actor);
    latents.actor_range_m[static_cast<std::size_t>(shift.actor)] = shift.shift_m;
    std::optional<ModelState> better = context_.fitter.improved(state, latents);
    if (better) state = std::move(*better);
    return better.has_value();
  };
  elsewhere_.assign(shifted.begin() + static_cast<std::ptrdiff_t>(std::min(kMostRangeErrors, shifted.size())),
                    shifted.end());
  shifted.resize(std::min(kMostRangeErrors, shifted.size()));
  shifted.erase(std::remove_if(shifted.begin(), shifted.end(), is_error), shifted.end());
  elsewhere_.insert(elsewhere_.begin(), shifted.begin(), shifted.end());
  return shifted;
}

void HypothesisRounds::run(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& extended,
                           ModelState state, int most_rounds) {
  selection_.begin(mechanisms, extended, std::move(state));
  int found = 0;
  for (int round = 0; found < most_rounds; ++round) {
    const RoundEnd end = findOne(round);
    if (end == RoundEnd::kNothing) break;
    if (end == RoundEnd::kFound) ++found;
    // Beside a large error of the twin, edges do not tell how they hide.
    if (result_.knife_edges_nats) continue;
    result_.knife_edges_nats = selection_.takeKnifeEdges();
    if (result_.knife_edges_nats) ranking_.tryAllAgain();
  }
  selection_.finish();
}

std::vector<HypothesisFit> HypothesisRounds::fitBest(int round) {
  std::vector<Hypothesis> all = allHypotheses(context_.twin, selection_.extended());
  setMeasuredImage(context_.data, all);
  const std::vector<RangeShift> shifted = takeRangeErrors(selection_.state());
  std::vector<Screened> screened = ranking_.rank(all, selection_.state(), shifted);
  if (selection_.unknownNats() > 0) {  // one unknown stands for all
    screened.erase(std::remove_if(screened.begin(), screened.end(),
                                  [](const Screened& s) { return !isCatalogued(s.hypothesis.mechanism.mechanism); }),
                   screened.end());
  }
  family_ = all.size() + static_cast<std::size_t>(kLawFamily);
  return FitRound(context_, selection_.state()).fit(std::move(screened), family_, round, result_.tried);
}

std::string HypothesisRounds::rejectionByLikelihood(const HypothesisFit& fit) const {
  if (fit.ranking() <= 0) return "gains less than its numbers cost";
  if (fit.false_alarm_rate > bounds::kFalseAlarmRateOfRound) return "chance could do as well";
  if (!(fit.held_out_gain > 0)) return "loses on places not fitted";
  if (fit.gain < bounds::kShareBesideUnknown * selection_.unknownNats()) return "little beside what is unknown";
  if (isPhaseOnly(fit)) return "no delay beyond its error, a phase alone";
  return rejectionReason(fit, frames_);
}

bool HypothesisRounds::isClutter(const HypothesisFit& fit) const {
  const bool thing = fit.hypothesis.form() == MechanismForm::kUnmodelledObject && fit.size_m() <= bounds::kLeastSize_m;
  return (thing || fit.hypothesis.form() == MechanismForm::kSurfaceClutter) && fit.ranking() > 0 &&
         fit.false_alarm_rate <= bounds::kFalseAlarmRateOfRound && fit.held_out_gain > 0;
}

std::vector<HypothesisFit> HypothesisRounds::newClutter(const std::vector<HypothesisFit>& clutter) const {
  std::vector<HypothesisFit> apart;
  for (const HypothesisFit& thing : clutter) {
    const bool is_new =
        std::none_of(apart.begin(), apart.end(), [&](const HypothesisFit& other) { return isSameThing(thing, other); });
    if (is_new && allowed_for_ + apart.size() < kMostAllowedFor) apart.push_back(thing);
  }
  return apart;
}

std::vector<HypothesisFit> HypothesisRounds::newMoves(const std::vector<HypothesisFit>& moves,
                                                      std::size_t others) const {
  std::vector<HypothesisFit> fresh;
  for (const HypothesisFit& move : moves) {
    const bool is_new = std::find(moves_allowed_for_.begin(), moves_allowed_for_.end(), move.hypothesis.subject) ==
                        moves_allowed_for_.end();
    if (is_new && allowed_for_ + others + fresh.size() < kMostAllowedFor) fresh.push_back(move);
  }
  return fresh;
}

void HypothesisRounds::allowFor(const std::vector<HypothesisFit>& granted, int round) {
  for (const HypothesisFit& fit : granted) {
    triedAs(fit, round, result_.tried).verdict += ", allowed for in what follows";
    if (fit.hypothesis.isMove()) moves_allowed_for_.push_back(fit.hypothesis.subject);
  }
  context_.report("what is likelier and no cause", 1);
  selection_.allowFor(granted);
  allowed_for_ += granted.size();
  ranking_.tryAllAgain();
}

std::optional<std::size_t> HypothesisRounds::betterByMaps(std::vector<HypothesisFit>& fits, std::size_t best) {
  const ModelState& state = selection_.state();
  std::optional<std::vector<CellPowers>> of_best;
  for (std::size_t i = best + 1; i < fits.size(); ++i) {
    HypothesisFit& rival = fits[i];
    // Seen from places that look one way, geometries are alike, and more numbers take in more of what the twin lacks.
    const bool more_geometry =
        fits[best].hypothesis.isGeometry() && rival.hypothesis.isGeometry() && rival.numbers() > fits[best].numbers();
    if (more_geometry) continue;
    const double likelier_nats = natsApart(fits[best], rival, context_.data);
    if (likelier_nats > bounds::kNotToldApart_nats || rival.ranking() < bounds::kShareOfSimpler * fits[best].ranking())
      continue;
    if (!isCatalogued(rival.hypothesis.mechanism.mechanism) || !rejectionByLikelihood(rival).empty()) continue;
    // Both are read from the same places, so that their difference is surer than either.
    if (!of_best) of_best = gains_.heldOutPowers(state, fits[best]);
    const GainMetric gain = explainedPowerGain(context_.data, *of_best, gains_.heldOutPowers(state, rival));
    const double more = gain.after - gain.before;
    const auto [low, high] = *gain.difference_ci95;
    // Each witness by its own standard error; an interval of 95 % is 2 * 1.96 of them wide.
    const double by_maps = 2 * 1.96 * more / std::max(1e-9, high - low), by_likelihood = std::sqrt(2 * likelier_nats);
    if (more > bounds::kLeastExplainedMore && low > 0 && by_maps > by_likelihood) return i;
  }
  return std::nullopt;
}

HypothesisRounds::RoundEnd HypothesisRounds::findOne(int round) {
  std::vector<HypothesisFit> fits = fitBest(round);
  const ModelState& state = selection_.state();
  preferAbsences(fits);
  preferMoves(fits, context_.twin.scene());
  preferSimplerGeometry(fits, context_.data);
  preferBetterNames(fits, state);
  preferSimplerNames(fits, state, context_.data);
  MapEvidence maps(context_, state);
  std::vector<HypothesisFit> clutter, within_error;  // likelier than the fits that follow
  for (std::size_t i = 0; i < fits.size(); ++i) {
    HypothesisFit& fit = fits[i];
    std::string& verdict = triedAs(fit, round, result_.tried).verdict;
    verdict = rejectionByLikelihood(fit);
    if (isClutter(fit)) clutter.push_back(fit);
    if (!verdict.empty()) continue;
    if (std::optional<HypothesisFit> small = moveWithinErrors(context_, state, fit, family_)) {
      verdict = "a move within the errors of actors explains as much";
      within_error.push_back(std::move(*small));
      continue;
    }
    const bool placed = placeOf(fit.hypothesis.at(fit.scaled_values), context_.twin.scene()).has_value();
    std::vector<HypothesisFit> granted = placed ? std::vector<HypothesisFit>() : newClutter(clutter);
    const std::vector<HypothesisFit> moves = newMoves(within_error, granted.size());
    granted.insert(granted.end(), moves.begin(), moves.end());
    if (!granted.empty()) {
      verdict = "judged again beside what is likelier and no cause";
      allowFor(granted, round);
      return RoundEnd::kAllowedFor;
    }
    Finding finding = findingOf(fit, fits, state, context_.twin.scene(), context_.data);
    if (context_.data.locations.size() > 1) {
      context_.report("gain on held-out places", 0);
      gains_.ofFit(state, fit, finding);
      verdict = maps.rejection(fit, *finding.gain);
      if (!verdict.empty()) continue;
      if (const auto better = betterByMaps(fits, i)) {
        verdict = "no likelier than " + fits[*better].hypothesis.label() + ", which explains more";
        const auto next = fits.begin() + static_cast<std::ptrdiff_t>(i) + 1;
        std::rotate(next, fits.begin() + static_cast<std::ptrdiff_t>(*better),
                    fits.begin() + static_cast<std::ptrdiff_t>(*better) + 1);
        continue;
      }
      gains_.addMetrics(selection_.extended(), fit, *finding.gain);
    }
    context_.report("found " + fit.hypothesis.label() + ", " + number(fit.gain, 4) + " nats", 1);
    if (context_.echoes.altersGeometry(*finding.mechanism)) ranking_.tryAllAgain();
    verdict = selection_.take(fit, fits, std::move(finding), family_);
    if (verdict.empty()) {
      verdict = "found";
      return RoundEnd::kFound;
    }
    context_.report("taken back: " + fit.hypothesis.label(), 1);
    if (fit.hypothesis.isMove()) {
      within_error.push_back(fit);
    } else {
      maps.addRejected(fit);
    }
  }
  return RoundEnd::kNothing;
}

}  // namespace mmradartwin::diagnosis::rounds
