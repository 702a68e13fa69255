#include "diagnosis/rounds/hypothesis_finding.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/fit/likelihood_climb.h"
#include "diagnosis/hypotheses/fitted_parameters.h"
#include "diagnosis/hypotheses/law_words.h"
#include "diagnosis/numbers/number_text.h"
#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

/// Share of the gain below which a difference of rankings is rounding.
constexpr double kRounding = 1e-6;

/// Candidates of a finding: hypotheses that explain nearly as much share the probability. Hypotheses of the finding's
/// own cause about something else are candidates where nothing at all tells them from it; their parameters say which.
std::vector<CauseProbability> candidatesOf(const HypothesisFit& best, const std::vector<HypothesisFit>& fits,
                                           std::size_t locations) {
  const std::string own = best.hypothesis.mechanism.mechanism;
  std::vector<CauseProbability> alike;
  std::vector<std::string> labels;
  double sum = 0;
  const auto add = [&](const HypothesisFit& fit, const std::string& cause, double weight) {
    alike.push_back({cause, weight});
    labels.push_back(fit.hypothesis.label());
    sum += weight;
    if (cause != own || !isCatalogued(cause)) return;
    alike.back().parameters = fittedParameters(fit.hypothesis, fit.scaled_values, fit.standard_error, cause, locations);
  };
  for (const HypothesisFit& other : fits) {
    const double behind = (best.ranking() - other.ranking()) / best.overdispersion;
    // Fits ahead of this one were rejected, or state the same cause.
    if (behind > bounds::kNotToldApart_nats || behind < 0 || !(other.gain > 0)) continue;
    const std::string& name = other.hypothesis.mechanism.mechanism;
    const std::string cause = isCatalogued(name) ? name : "unknown";
    const bool is_there =
        std::any_of(alike.begin(), alike.end(), [&](const CauseProbability& a) { return a.cause == cause; });
    const bool is_tie = cause == own && behind <= kRounding * std::max(1.0, std::abs(best.gain)) &&
                        std::find(labels.begin(), labels.end(), other.hypothesis.label()) == labels.end();
    if (!is_there || is_tie) add(other, cause, std::exp(-behind));
  }
  const auto of_own =
      std::count_if(alike.begin(), alike.end(), [&](const CauseProbability& a) { return a.cause == own; });
  for (CauseProbability& candidate : alike) {
    candidate.probability /= sum;
    if (of_own < 2) candidate.parameters.clear();
  }
  return alike;
}

}  // namespace

Finding findingOf(const HypothesisFit& best, const std::vector<HypothesisFit>& fits, const ModelState& before,
                  const Scene& scene, const ChannelData& data) {
  Finding finding;
  const NamedParameters mechanism = best.hypothesis.at(best.scaled_values);
  const bool named = isCatalogued(mechanism.mechanism);
  finding.cause = named ? mechanism.mechanism : "unknown";
  finding.mechanism = mechanism;
  finding.parameters =
      fittedParameters(best.hypothesis, best.scaled_values, best.standard_error, finding.cause, data.locations.size());
  finding.candidates = candidatesOf(best, fits, data.locations.size());
  if (finding.candidates.size() > 1) finding.experiment = experimentFor(finding.candidates);
  for (const HypothesisFit& other : fits) {
    // Fits ahead of this one were rejected.
    if (other.hypothesis.mechanism.mechanism == mechanism.mechanism || other.ranking() > best.ranking()) continue;
    const std::string& name = other.hypothesis.mechanism.mechanism;
    finding.evidence.runner_up = isCatalogued(name) ? name : "unknown";
    finding.evidence.margin = best.gain - std::max(0.0, other.gain);
    break;
  }
  FindingPlace place;
  if (scene.actorIndex(best.hypothesis.subject) >= 0) place.actors = {best.hypothesis.subject};
  if (const std::optional<Eigen::Vector2d> at = placeOf(mechanism, scene)) {
    place.x_m = at->x();
    place.y_m = at->y();
  }
  finding.where.push_back(std::move(place));
  if (best.hypothesis.stated) {
    std::string states;
    for (const Coordinate& c : best.hypothesis.coordinates) {
      states += (states.empty() ? "" : ", ") + c.parameter + " " + number(c.neutral);
    }
    finding.description = "instead of what the twin states: " + states;
  }
  describeGain(best, before, data, finding);
  return finding;
}

void describeGain(const HypothesisFit& fit, const ModelState& before, const ChannelData& data, Finding& finding) {
  finding.evidence.log_likelihood_gain = fit.gain;
  finding.evidence.false_alarm_rate = fit.false_alarm_rate;
  std::vector<std::pair<double, std::string>> poses;
  for (std::size_t i = 0; i < before.by_pose.size(); ++i) {
    poses.emplace_back(fit.state.by_pose[i] - before.by_pose[i], data.poses[i].pose.name);
  }
  std::stable_sort(poses.begin(), poses.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  finding.where.front().poses.clear();
  for (std::size_t i = 0; i < std::min<std::size_t>(10, poses.size()) && poses[i].first > 1; ++i) {
    finding.where.front().poses.push_back(poses[i].second);
  }
  if (finding.cause == "unknown") {
    finding.description = "no cause of the catalogue explains this; what it looks like: " +
                          describeLaw(fit.hypothesis, *finding.mechanism) + "; " + number(fit.gain, 4) + " nats over " +
                          std::to_string(data.poses.size()) + " poses";
  }
}

std::optional<Eigen::Vector2d> placeOf(const NamedParameters& mechanism, const Scene& scene) {
  const MechanismForm form = traitsOf(mechanism.mechanism).form;
  const bool of_place = form == MechanismForm::kUnmodelledObject || form == MechanismForm::kLateEcho ||
                        (form == MechanismForm::kLaw && LawVariable::isAboutPlace(mechanism.values.text("variable")));
  if (of_place) return Eigen::Vector2d(mechanism.values.number("x_m"), mechanism.values.number("y_m"));
  const bool moved = form == MechanismForm::kActorMoved;
  const bool of_actor =
      moved || form == MechanismForm::kActorAbsent || form == MechanismForm::kReplica || form == MechanismForm::kLaw;
  if (!of_actor) return std::nullopt;
  const int actor = scene.actorIndex(mechanism.values.text("actor"));
  if (actor < 0) return std::nullopt;
  const Eigen::Vector2d middle = scene.actors[static_cast<std::size_t>(actor)].bounds.center().head<2>();
  return moved ? middle + Eigen::Vector2d(mechanism.values.number("dx_m"), mechanism.values.number("dy_m")) : middle;
}

namespace {

/// Reason why an object is no finding, "" where it may be one.
std::string rejectionOfObject(const Parameters& values, const std::vector<FrameFinding>& walkers) {
  const double size_m = values.number("size_m"), x_m = values.number("x_m"), y_m = values.number("y_m");
  const std::string which = ": " + number(size_m) + " m at (" + number(x_m) + ", " + number(y_m) + ")";
  if (size_m <= bounds::kLeastSize_m) return "no larger than clutter is" + which;
  for (const FrameFinding& walker : walkers) {
    if (walker.cause != "moving_target" || size_m > bounds::kMostPersonSize_m) continue;
    for (const FindingPlace& place : walker.where) {
      if (place.x_m && place.y_m && std::hypot(*place.x_m - x_m, *place.y_m - y_m) < bounds::kWalkReach_m) {
        return "what is left of someone who walks there" + which;
      }
    }
  }
  return "";
}

}  // namespace

std::string implausibility(const NamedParameters& mechanism) {
  for (const PlausibleRange& range : traitsOf(mechanism.mechanism).plausible) {
    const double value = mechanism.values.number(range.parameter);
    if (value < range.low) return range.too_low + number(value) + range.unit;
    if (value > range.high) return range.too_high + number(value) + range.unit;
  }
  return "";
}

std::string rejectionReason(const HypothesisFit& fit, const std::vector<FrameFinding>& walkers) {
  const NamedParameters mechanism = fit.hypothesis.at(fit.scaled_values);
  const Parameters& values = mechanism.values;
  const MechanismTraits& traits = traitsOf(mechanism.mechanism);
  if (std::string reason = implausibility(mechanism); !reason.empty()) return reason;
  if (traits.form == MechanismForm::kSurfaceClutter) return "what lies on " + values.text("actor") + " is clutter";
  return traits.form == MechanismForm::kUnmodelledObject ? rejectionOfObject(values, walkers) : "";
}

bool isLikeClutter(const HypothesisFit& fit, bool explains_more, bool sure) {
  const MechanismTraits& traits = traitsOf(fit.hypothesis.mechanism.mechanism);
  const auto is_below_bound = [&] {
    return fit.hypothesis.at(fit.scaled_values).values.number(traits.clutter_parameter) < traits.clutter_bound;
  };
  switch (traits.clutter) {
    case ClutterLikeness::kNone:
      return false;
    case ClutterLikeness::kUnlessMapsGain:
      return !explains_more;
    case ClutterLikeness::kUnlessMapsGainOrLarge:
      return !explains_more || (!sure && is_below_bound());
    case ClutterLikeness::kUnlessMapsGainOrLoud:
      return !explains_more && !fit.hypothesis.subject.empty() && is_below_bound();
    case ClutterLikeness::kUnlessSure:
      return !sure && !fit.overwhelming;
    case ClutterLikeness::kUnlessSureOrStrong:
      return !sure && !fit.overwhelming && is_below_bound();
  }
  return false;
}

void preferAbsences(std::vector<HypothesisFit>& fits) {
  for (HypothesisFit& gone : fits) {
    if (traitsOf(gone.hypothesis.mechanism.mechanism).form != MechanismForm::kActorAbsent) continue;
    for (const HypothesisFit& moved : fits) {
      if (moved.hypothesis.isMove() && moved.hypothesis.subject == gone.hypothesis.subject &&
          gone.ranking() >= moved.ranking()) {
        gone.false_alarm_rate = std::min(gone.false_alarm_rate, moved.false_alarm_rate);
      }
    }
  }
}

void preferMoves(std::vector<HypothesisFit>& fits, const Scene& scene) {
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const NamedParameters object = fits[i].hypothesis.at(fits[i].scaled_values);
    if (traitsOf(object.mechanism).form != MechanismForm::kUnmodelledObject) continue;
    const Eigen::Vector2d at(object.values.number("x_m"), object.values.number("y_m"));
    for (std::size_t j = i + 1; j < fits.size(); ++j) {
      if (!fits[j].hypothesis.isMove() || fits[j].gain < bounds::kShareOfSimpler * fits[i].gain) continue;
      const NamedParameters move = fits[j].hypothesis.at(fits[j].scaled_values);
      const Actor& actor = scene.actors[static_cast<std::size_t>(scene.actorIndex(fits[j].hypothesis.subject))];
      const Eigen::Vector2d by(move.values.number("dx_m"), move.values.number("dy_m"));
      const Eigen::AlignedBox2d plan(actor.bounds.min().head<2>(), actor.bounds.max().head<2>());
      if (plan.exteriorDistance(at - by) > bounds::kStandsThere_m) continue;
      std::rotate(fits.begin() + static_cast<std::ptrdiff_t>(i), fits.begin() + static_cast<std::ptrdiff_t>(j),
                  fits.begin() + static_cast<std::ptrdiff_t>(j) + 1);
      break;
    }
  }
}

Eigen::VectorXd gainByPose(const HypothesisFit& fit, const ModelState& before) {
  Eigen::VectorXd gain(static_cast<Eigen::Index>(before.by_pose.size()));
  for (std::size_t i = 0; i < before.by_pose.size(); ++i) {
    gain[static_cast<Eigen::Index>(i)] = fit.state.by_pose[i] - before.by_pose[i];
  }
  return gain;
}

double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd x = a.array() - a.mean(), y = b.array() - b.mean();
  return x.dot(y) / std::max(1e-300, x.norm() * y.norm());
}

double natsApart(const HypothesisFit& a, const HypothesisFit& b, const ChannelData& data) {
  const std::vector<double> by_location = gainByLocation(data, b.state, a.state);
  const Eigen::Map<const Eigen::ArrayXd> more(by_location.data(), static_cast<Eigen::Index>(by_location.size()));
  const double places = static_cast<double>(more.size()), sum = more.sum();
  if (places < 2) return std::abs(sum);
  const double variance = places / (places - 1) * (more - more.mean()).square().sum();
  return std::min(std::abs(sum), 0.5 * sum * sum / std::max(variance, 1e-300));
}

void preferSimplerGeometry(std::vector<HypothesisFit>& fits, const ChannelData& data) {
  const auto isGeometry = [](const HypothesisFit& f) { return f.hypothesis.isGeometry(); };
  const auto best = std::find_if(fits.begin(), fits.end(), isGeometry);
  auto simplest = best;
  for (auto rival = best; rival != fits.end(); ++rival) {
    if (isGeometry(*rival) && rival->ranking() > 0 && rival->numbers() < simplest->numbers() &&
        natsApart(*best, *rival, data) <= bounds::kNotToldApart_nats) {
      simplest = rival;
    }
  }
  if (simplest != fits.end()) std::rotate(best, simplest, simplest + 1);
}

void preferSimplerNames(std::vector<HypothesisFit>& fits, const ModelState& before, const ChannelData& data) {
  const auto is_name = [](const HypothesisFit& f) {
    return isCatalogued(f.hypothesis.mechanism.mechanism) && !f.hypothesis.isGeometry() && f.ranking() > 0 &&
           f.false_alarm_rate <= bounds::kFalseAlarmRateOfRound;
  };
  for (std::size_t i = 0; i < fits.size(); ++i) {
    // A move by no more than actors err is expected of the scene, and no rival that a simpler name has to beat.
    const bool is_error = fits[i].hypothesis.isMove() && fits[i].moved_m() < fits[i].stated.leastMove_m();
    if (!is_name(fits[i]) || is_error) continue;
    const Eigen::VectorXd gained = gainByPose(fits[i], before);
    for (std::size_t j = i + 1; j < fits.size(); ++j) {
      const HypothesisFit& simpler = fits[j];
      if (!is_name(simpler) || simpler.numbers() >= fits[i].numbers() ||
          simpler.gain < bounds::kShareOfSimpler * fits[i].gain ||
          correlation(gained, gainByPose(simpler, before)) < bounds::kCorrelationOfSameName ||
          natsApart(fits[i], simpler, data) > bounds::kNotToldApart_nats) {
        continue;
      }
      std::rotate(fits.begin() + static_cast<std::ptrdiff_t>(i), fits.begin() + static_cast<std::ptrdiff_t>(j),
                  fits.begin() + static_cast<std::ptrdiff_t>(j) + 1);
      break;
    }
  }
}

void preferBetterNames(std::vector<HypothesisFit>& fits, const ModelState& before) {
  const auto ofAllEchoes = [](const HypothesisFit& f) {
    return f.hypothesis.subject.empty() && isCatalogued(f.hypothesis.mechanism.mechanism);
  };
  std::vector<Eigen::VectorXd> gained;
  for (const HypothesisFit& f : fits) gained.push_back(gainByPose(f, before));
  for (std::size_t i = 0; i < fits.size(); ++i) {
    for (std::size_t j = 0; j < fits.size(); ++j) {
      HypothesisFit& better = fits[i];
      const HypothesisFit& sure = fits[j];
      if (!ofAllEchoes(better) || !ofAllEchoes(sure) || better.ranking() <= sure.ranking()) continue;
      if (correlation(gained[i], gained[j]) < bounds::kCorrelationOfSameName) continue;
      better.false_alarm_rate = std::min(better.false_alarm_rate, sure.false_alarm_rate);
    }
  }
}

}  // namespace mmradartwin::diagnosis::rounds
