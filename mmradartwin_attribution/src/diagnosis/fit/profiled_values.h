#pragma once

#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// Values of the coordinates of several hypotheses, in a row.
struct ProfiledValues {
  std::vector<double> scaled_values;
  std::vector<double> standard_error;  ///< of the values (not scaled)
};

/// Model in which values are profiled.
struct ProfiledModel {
  ExpectedEchoes& source;  ///< its baseline is `base` with the parts as fitted
  const ChannelLikelihood& likelihood;
  const PoseAccuracy& accuracy;
  const std::vector<NamedParameters>& base;  ///< mechanisms without the parts
  const SessionLatents& latents;             ///< from which latents are refitted
};

/// Values and standard errors about a fit, by the profile likelihood: how far the likelihood with all latents refitted
/// falls to both sides, and how much its slope scatters over places. Steps are as wide as the likelihood takes to fall
/// by some nats, since slopes alone promise far too much where paths come and go within millimetres. The values move to
/// the top of that fall where the likelihood gains by it.
/// fit: coordinates of the parts, with standard errors that steps begin with. again: how often the steps may begin anew
/// where the top lies beyond them.
ProfiledValues profiled(const ProfiledModel& model, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                        int again = 2);

/// Profiles several hypotheses in place: together where they have few numbers, else one by one beside the others. A
/// hypothesis with too many numbers of its own (a channel error) stays as it is.
void profileParts(const ProfiledModel& model, const std::vector<Hypothesis>& parts, std::vector<ProfiledValues>& fits);

}  // namespace mmradartwin::diagnosis::fit
