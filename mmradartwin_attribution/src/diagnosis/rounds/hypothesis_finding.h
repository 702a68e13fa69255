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

/// What a fitted hypothesis says, as a finding without its gain on held-out places. `fits`: all of the round, by rank;
/// `before`: what the twin without it came to.
Finding findingOf(const HypothesisFit& best, const std::vector<HypothesisFit>& fits, const ModelState& before,
                  const Scene& scene, const ChannelData& data);

/// Sets what of a finding its fit says over `before`: evidence but for its rival, the poses that carry it most, an
/// unknown's description.
void describeGain(const HypothesisFit& fit, const ModelState& before, const ChannelData& data, Finding& f);

/// Where in map a mechanism says that something is: an object, a place, the middle of an actor that moved (where it
/// then stands), is gone or has a law of its own; nothing of all others.
std::optional<Eigen::Vector2d> placeOf(const NamedParameters& mechanism, const Scene& scene);

/// Why something fitted is nothing found, "" where it may be: an object or a scattering that clutter is as large as, a
/// panel that lets all through, a ghost of edges alone, an object where one of the `walkers` (other causes are passed
/// over) walks, whose echo does not average out over a pose's frames.
std::string rejectionReason(const HypothesisFit& fit, const std::vector<FrameFinding>& walkers);

/// True where the likelihood may have gained by what stands about in any room and no scene has: an object, a late echo
/// or one actor's weak replica that explains no more of the measured power (explains_more), or a small object, a
/// material that scatters somewhat and what shines through a panel of which it is not `sure` that they explain more, by
/// however little.
bool isLikeClutter(const HypothesisFit& fit, bool explains_more, bool sure);

/// An actor that is gone explains as much as the same one moved away, without a number: that something is wrong with it
/// is then as sure.
void preferAbsences(std::vector<HypothesisFit>& fits);
/// Of an object that the scene lacks and an actor that moved to its place and explains nearly as much, the actor comes
/// first: a box of any size at any angle bends to more, and who stands where it stood would have lost its echoes there.
void preferMoves(std::vector<HypothesisFit>& fits, const Scene& scene);

/// Nats by which a fit explains each pose better [poses].
Eigen::VectorXd gainByPose(const HypothesisFit& fit, const ModelState& before);
/// Pearson's, of two gains: near 1 where they explain the same.
double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b);

/// That something is wrong with all echoes is as sure as the surest name for it; which name, its likelihood says: where
/// two gain alike over poses, the likelier one is as sure as the other.
void preferBetterNames(std::vector<HypothesisFit>& fits, const ModelState& before);

}  // namespace mmradartwin::diagnosis::rounds
