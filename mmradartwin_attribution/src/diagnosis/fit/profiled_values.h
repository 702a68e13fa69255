#pragma once

#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// Coordinates of several hypotheses in a row.
struct ProfiledValues {
  std::vector<double> scaled_values;
  std::vector<double> standard_error;  ///< of the values (not scaled)
};

/// Values and their standard errors about a fit, by how far the likelihood with all latents refitted falls to both
/// sides, and by how much its slope scatters over places. Slopes alone promise far too much where paths come and go
/// within millimetres: steps are as wide as the likelihood takes to fall by some nats. The values move to the top of
/// that fall where the likelihood gains by it.
/// `fit`: coordinates of the parts over `base`, with standard errors that steps begin with; again: how often it begins
/// anew where the top lies beyond its steps. The source has to be settled on base with the parts as fitted.
ProfiledValues profiled(ExpectedEchoes& source, const ChannelLikelihood& model,
                        const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                        const PoseAccuracy& accuracy, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                        int again = 2);

/// The same of several hypotheses over `base`, in place: together where they have few numbers, else one by one beside
/// the others as they are. What has too many by itself (a channel error) knows nothing of the others and stays as it
/// is.
void profileParts(ExpectedEchoes& source, const ChannelLikelihood& model, const std::vector<NamedParameters>& base,
                  const SessionLatents& nuisance, const PoseAccuracy& accuracy, const std::vector<Hypothesis>& parts,
                  std::vector<ProfiledValues>& fits);

}  // namespace mmradartwin::diagnosis::fit
