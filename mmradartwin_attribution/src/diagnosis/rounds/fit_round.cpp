#include "diagnosis/rounds/fit_round.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/numbers/number_text.h"
#include "diagnosis/rounds/hypothesis_finding.h"
#include "diagnosis/search/hypothesis_ranking.h"
#include "diagnosis/search/law_screen.h"
#include "diagnosis/search/object_search.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

constexpr std::size_t kMostNames = 5;       ///< named causes fitted in a round
constexpr std::size_t kMostGeometries = 6;  ///< errors of all ranges or directions
constexpr std::size_t kMostLaws = 4;
constexpr double kMostFits = 20;         ///< of a round, for the progress display
constexpr double kLeastForFit_nats = 4;  ///< screened gain
constexpr double kLeastForFitOfGeometry_nats = 0.5;
constexpr double kStartFactors[] = {1.5, 2};  ///< factors on the starts of a geometry
constexpr double kLeastForBox_nats = 15;      ///< gain of a point object from which a box is tried
constexpr double kLeastShareForBox = 0.3;     ///< screened gain of a box, over the gain of the best fit
constexpr double kLeastShareOfRound =
    1 / 40.0;  ///< screened gain over that of an overwhelming named cause; others wait for the next round
/// Gain over that of an overwhelming named cause; a climb that will not reach it stops.
constexpr double kLeastShareOfOverwhelming = 0.25;
/// Places that a session resolves in a room of 8 by 6 m, as a family of hypotheses.
constexpr double kObjectPlaces = 500;

bool isObject(const Hypothesis& h) { return h.form() == MechanismForm::kUnmodelledObject; }
bool isPlaced(const Hypothesis& h) { return isObject(h) || h.form() == MechanismForm::kLateEcho; }

}  // namespace

void FitRound::considerBox(const HypothesisFit& cylinder) {
  const bool thing = cylinder.size_m() > bounds::kLeastSize_m;
  const std::pair<bool, double> evidence{thing, cylinder.gain_without_best_place};
  if (evidence.second <= kLeastForBox_nats || evidence <= boxed_) return;
  if (boxed_.second > 0) screened_.pop_back();
  boxed_ = evidence;
  screened_.push_back(asBox(context_.data, state_, cylinder));  // last, since it is the slowest fit
}

void FitRound::fitOne(Screened screened) {
  const bool law = !isCatalogued(screened.hypothesis.mechanism.mechanism), box = isUnmodelledBox(screened.hypothesis);
  if (screened.hypothesis.isGeometry()) {
    // Latents absorb a part of a geometry, within their priors: longer starts are tried as well.
    const std::vector<std::vector<double>> starts = screened.starts;
    for (double longer : kStartFactors) {
      for (std::vector<double> start : starts) {
        for (double& scaled_values : start) scaled_values *= longer;
        screened.starts.push_back(std::move(start));
      }
    }
  }
  context_.report("fitting " + screened.hypothesis.label(),
                  std::min(1.0, static_cast<double>(fits_.size()) / kMostFits));
  const bool around = screened.hypothesis.isMove() || box || screened.hypothesis.form() == MechanismForm::kLateEcho;
  // A geometry climbs slowly at first.
  const double least_nats = screened.hypothesis.isGeometry() ? 0 : kLeastShareOfOverwhelming * best_overwhelming_name_;
  fits_.push_back(around ? fitObject(context_.fitter, state_, screened)
                         : context_.fitter.fit(state_, screened.hypothesis, screened.starts, least_nats));
  context_.echoes.setBaseline(state_.mechanisms);
  if (!law && context_.fitter.isOverwhelming(fits_.back().gain_without_best_place))
    best_overwhelming_name_ = std::max(best_overwhelming_name_, fits_.back().gain);
  if (isObject(screened.hypothesis) && !box) considerBox(fits_.back());
  // Better latents that a fit has found are no gain of its hypothesis: they become the null's.
  if (std::optional<ModelState> better = context_.fitter.improved(state_, fits_.back().state.latents)) {
    const double nats = better->log_likelihood - state_.log_likelihood;
    state_ = std::move(*better);
    // A large improvement moves the optimum of the earlier fits: they are fitted again.
    for (HypothesisFit& earlier : fits_) {
      if (nats > kLeastForFit_nats && &earlier != &fits_.back()) {
        earlier = context_.fitter.fit(state_, earlier.hypothesis, {earlier.scaled_values});
        context_.echoes.setBaseline(state_.mechanisms);
      } else {
        context_.fitter.gainOver(state_, earlier);
      }
    }
  }
  std::stable_sort(fits_.begin(), fits_.end(),
                   [](const HypothesisFit& a, const HypothesisFit& b) { return a.ranking() > b.ranking(); });
}

std::vector<HypothesisFit> FitRound::fit(std::vector<Screened> screened, std::size_t family, int round,
                                         std::vector<TriedHypothesis>& tried) {
  screened_ = std::move(screened);
  std::size_t names_fitted = 0, geometries_fitted = 0, laws_fitted = 0, objects_fitted = 0;
  for (std::size_t i = 0; i < screened_.size(); ++i) {
    Screened screened = screened_[i];  // a copy, since more may be appended
    TriedHypothesis looked_at;
    looked_at.label = screened.hypothesis.label();
    looked_at.screened_nats = screened.screened_nats;
    looked_at.gain = std::numeric_limits<double>::quiet_NaN();
    looked_at.round = round;
    // The screened gain follows from a quadratic and is often far too small, most of all for geometries, places and
    // laws. Several named causes and four laws are therefore fitted. See
    // docs/verification/calibration_of_bounds.md#screened-gain-of-a-geometry.
    const bool law = !isCatalogued(screened.hypothesis.mechanism.mechanism);
    const bool object = isObject(screened.hypothesis), geometry = screened.hypothesis.isGeometry();
    const bool moved = screened.hypothesis.isMove();
    std::size_t& fitted = law ? laws_fitted : object ? objects_fitted : geometry ? geometries_fitted : names_fitted;
    const bool box = isUnmodelledBox(screened.hypothesis);
    const double rival = kLeastShareOfRound * best_overwhelming_name_;
    const double least_nats = box      ? (fits_.empty() ? kLeastForBox_nats : kLeastShareForBox * fits_.front().gain)
                              : object ? bounds::kLeastNatsOfObject
                              : law    ? bounds::kLeastNatsOfLaw
                              : geometry || moved ? kLeastForFitOfGeometry_nats
                                                  : std::max(kLeastForFit_nats, rival);
    // Only a fit knows where an actor went: its screened gain does not rank it.
    const std::size_t most = law        ? kMostLaws
                             : object   ? kMostObjects
                             : geometry ? kMostGeometries
                             : moved    ? kMostNames + kMostOutOfPlace
                                        : kMostNames;
    if (screened.screened_nats > least_nats && (box || fitted < most)) {
      ++fitted;
      fitOne(std::move(screened));
    } else if (least_nats == rival && screened.screened_nats > kLeastForFit_nats && screened.screened_nats <= rival) {
      looked_at.verdict = "promises little beside what is plain";
    }
    tried.push_back(looked_at);
  }
  // Where a geometry explains most, latents may hide that another geometry explains more: each is fitted then.
  const bool leads = !fits_.empty() && fits_.front().hypothesis.isGeometry() && fits_.front().ranking() > 0;
  for (const Screened& s : screened_) {
    const auto fitted = [&](const HypothesisFit& f) { return f.hypothesis.label() == s.hypothesis.label(); };
    if (leads && s.hypothesis.isGeometry() && std::none_of(fits_.begin(), fits_.end(), fitted)) fitOne(s);
  }
  for (HypothesisFit& fit : fits_) {
    context_.fitter.judge(fit, family + static_cast<std::size_t>(isPlaced(fit.hypothesis) ? kObjectPlaces : 0));
    TriedHypothesis& t = triedAs(fit, round, tried);
    t.gain = fit.gain;
    t.gain_without_best_place = fit.gain_without_best_place;
    t.overdispersion = fit.overdispersion;
    t.held_out_gain = fit.held_out_gain;
    t.false_alarm_rate = fit.false_alarm_rate;
    for (std::size_t i = 0; i < fit.scaled_values.size(); ++i) {
      const Coordinate& c = fit.hypothesis.coordinates[i];
      t.fitted += (i ? "; " : "") + c.parameter + " " + number(c.value(fit.scaled_values[i]));
    }
  }
  return std::move(fits_);
}

TriedHypothesis& triedAs(const HypothesisFit& fit, int round, std::vector<TriedHypothesis>& tried) {
  return *std::find_if(tried.begin(), tried.end(),
                       [&](const TriedHypothesis& t) { return t.round == round && t.label == fit.hypothesis.label(); });
}

}  // namespace mmradartwin::diagnosis::rounds
