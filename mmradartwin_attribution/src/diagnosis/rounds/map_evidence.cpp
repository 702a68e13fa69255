#include "diagnosis/rounds/map_evidence.h"

#include <algorithm>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/hypotheses/evidence_bounds.h"
#include "diagnosis/numbers/number_text.h"
#include "diagnosis/rounds/hypothesis_finding.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

/// True of causes of the catalogue that put echoes into the room which the twin lacks. What the receiver adds lies tens
/// of dB below its echo, too low for maps.
bool addsEchoes(const Hypothesis& hypothesis) {
  const std::string& name = hypothesis.mechanism.mechanism;
  return isCatalogued(name) && causeDescription(name).residual_class == ResidualClass::kMissingMechanism &&
         hypothesis.form() != MechanismForm::kReceiverImage && hypothesis.form() != MechanismForm::kHarmonic;
}

}  // namespace

// The likelihood gains a little by its own errors: a pose error resembles small amounts of many effects at edges. Where
// the maps do not gain, a fit needs more evidence. Real effects need not show in maps (a receiver image at -26 dB), so
// that only clearly worse maps speak against much evidence.
std::string MapEvidence::rejection(const HypothesisFit& fit, const FindingGain& gain) {
  const auto explained = *gain.explained_power.difference_ci95;
  const double explained_more = gain.explained_power.after - gain.explained_power.before;
  const std::string by_how_much =
      ": " + number(explained_more, 2) + " (" + number(explained[0], 2) + " to " + number(explained[1], 2) + ")";
  const bool in_maps = explained[0] > 0 && explained_more >= bounds::kLeastExplainedMore;
  const bool likelier = (*gain.log_likelihood_per_pose.difference_ci95)[0] > 0;
  const bool sure = explained[0] > 0 && likelier;
  if (!(in_maps && likelier) && isLikeClutter(fit, explained_more >= bounds::kLeastExplainedMore, sure)) {
    return "clutter is like that, by what the maps gain" + by_how_much;
  }
  if (in_maps) return "";
  // The likelihood knows the errors that it was given and trusts the twin in all else; what makes maps worse has no
  // second witness. A law without a name only describes the data: where it describes no more of the power, it tells
  // nothing.
  const bool named = isCatalogued(fit.hypothesis.mechanism.mechanism);
  const bool clearly_worse = explained_more < -bounds::kLeastExplainedMore && explained[1] < 0;
  // Echoes that are there add to the power that is explained. What is put in for others has its power in other cells.
  const bool worse = clearly_worse || (addsEchoes(fit.hypothesis) && explained_more < 0);
  const Eigen::VectorXd nats_by_pose = gainByPose(fit, before_);
  if (named && !worse && hasEnoughEvidence(fit, likelier, explained[0] > 0) && !explainsTheSame(fit, nats_by_pose))
    return "";
  if (likelier) rejected_.push_back({nats_by_pose, true});
  return (worse ? "the maps get worse" : "the maps gain nothing") + by_how_much;
}

void MapEvidence::addRejected(const HypothesisFit& fit) { rejected_.push_back({gainByPose(fit, before_), false}); }

/// True of a fit that has enough evidence although the maps do not gain. Maps of many scatter points differ from their
/// expectation by as much as they hold. Few places see one actor, so that little of its gain is left without the best
/// place. Evidence that is overwhelming whatever its scatter over places needs maps that gain surely, however little:
/// an actor put where no map shows it can gain much at few places.
bool MapEvidence::hasEnoughEvidence(const HypothesisFit& fit, bool likelier, bool maps_gain_surely) {
  const bool traces = context_.echoes.altersGeometry(fit.hypothesis.at(fit.scaled_values));
  const double least_nats = leastNats(fit.hypothesis, fit.scaled_values, traces, context_.data.poses.size());
  const bool overwhelming = fit.overwhelming && maps_gain_surely && !isFaintAddition(fit.hypothesis, fit.scaled_values);
  return (likelier || fit.isFarAway()) &&
         (overwhelming || fit.gain_without_best_place / fit.overdispersion > least_nats);
}

/// True where a better, rejected fit explains the same poses. Two kinds are exempt: a law without a name, which may be
/// the cause of something else, and a named cause given errors of the session.
bool MapEvidence::explainsTheSame(const HypothesisFit& fit, const Eigen::VectorXd& nats_by_pose) const {
  const bool named = isCatalogued(fit.hypothesis.mechanism.mechanism);
  return std::any_of(rejected_.begin(), rejected_.end(), [&](const Rejected& other) {
    const double same = correlation(nats_by_pose, other.nats_by_pose);
    return same > (named && other.by_maps ? bounds::kCorrelationOfSomeShared : bounds::kCorrelationOfSame);
  });
}

}  // namespace mmradartwin::diagnosis::rounds
