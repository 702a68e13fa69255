#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis::rounds {

/// Finding that states a fitted hypothesis, without its gain on held-out places. fits: all of the round, by rank.
/// before: state of the twin without the hypothesis.
Finding findingOf(const HypothesisFit& best, const std::vector<HypothesisFit>& fits, const ModelState& before,
                  const Scene& scene, const ChannelData& data);

/// Sets what a finding says about its fit over `before`: the evidence except the runner-up, the poses that carry most
/// of it, and the description of an unknown.
void describeGain(const HypothesisFit& fit, const ModelState& before, const ChannelData& data, Finding& f);

/// Where in map a mechanism says that something is: an object, a location, the middle of an actor where it now stands,
/// is missing or has a law of its own. Nothing for other mechanisms.
std::optional<Eigen::Vector2d> placeOf(const NamedParameters& mechanism, const Scene& scene);

/// What speaks against the numbers of a cause by themselves, "" where nothing does.
std::string implausibility(const NamedParameters& mechanism);

/// Reason why a fit is no finding, "" where it may be one. Refused are: an object or a scattering as weak as clutter, a
/// panel that lets everything through, a second image (ghost) by edges alone, and an object where one of the `walkers`
/// walks, whose echo does not average out over a pose's frames. Other causes in `walkers` are ignored.
std::string rejectionReason(const HypothesisFit& fit, const std::vector<FrameFinding>& walkers);

/// True where the likelihood may have gained by clutter that no scene lists. That holds for an object, a late echo or
/// one actor's weak replica that explains no more of the measured power (explains_more). It also holds for a small
/// object, a scattering material and a transmitting panel where it is not `sure` that they explain more.
bool isLikeClutter(const HypothesisFit& fit, bool explains_more, bool sure);

/// Gives an absent actor that ranks no lower than the same actor moved away the lower false-alarm rate of the two: it
/// explains as much without a number.
void preferAbsences(std::vector<HypothesisFit>& fits);
/// Puts a moved actor before an object at its new place where both explain nearly as much. A box of any size and angle
/// adapts to more, and an actor at its old place would have lost its echoes there.
void preferMoves(std::vector<HypothesisFit>& fits, const Scene& scene);

/// [poses] nats by which a fit explains each pose better.
Eigen::VectorXd gainByPose(const HypothesisFit& fit, const ModelState& before);
/// Pearson correlation of two gains; near 1 where they explain the same poses.
double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// Nats by which one fit is likelier than another: the difference of their likelihoods, and no more than its scatter
/// over places allows, z^2 / 2 of its sum (Vuong, Econometrica 57, 1989).
double natsApart(const HypothesisFit& a, const HypothesisFit& b, const ChannelData& data);
/// Moves a geometry of fewer numbers before the likeliest one where places do not tell the two apart. Seen from places
/// that look one way, a bias of all ranges and a shift of the scene are alike, and more numbers take in more of what
/// the model lacks.
void preferSimplerGeometry(std::vector<HypothesisFit>& fits, const ChannelData& data);
/// Moves a name of fewer numbers before a likelier one that explains the same poses, and not much more of them, where
/// places do not tell the two apart.
void preferSimplerNames(std::vector<HypothesisFit>& fits, const ModelState& before, const ChannelData& data);
/// Gives the better of two causes of all echoes that gain alike over poses the lower false-alarm rate of the two. How
/// sure an error of all echoes is follows from its surest name; which name it has follows from the likelihood.
void preferBetterNames(std::vector<HypothesisFit>& fits, const ModelState& before);

}  // namespace mmradartwin::diagnosis::rounds
