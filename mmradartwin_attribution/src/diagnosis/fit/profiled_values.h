#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

/// Values of the coordinates of several hypotheses, one hypothesis after the other.
struct ProfiledValues {
  std::vector<double> scaled_values;
  std::vector<double> standard_error;  ///< [coordinates] of the values in their units
};

/// Model in which values are profiled.
struct ProfiledModel {
  ExpectedEchoes& source;  ///< its baseline is `base` with the parts as fitted
  const ChannelLikelihood& likelihood;
  const PoseAccuracy& accuracy;
  const std::vector<NamedParameters>& base;  ///< mechanisms without the parts
  const SessionLatents& latents;             ///< start of each refit of the latents
};

/// Values and standard errors about a fit, by the profile likelihood: its fall to both sides with all latents refitted,
/// and the scatter of its slope over places. A step is as wide as a fall by some nats needs: slopes at the fit
/// understate errors where paths appear and vanish within millimetres. The values move to the maximum of the fitted
/// quadratic where the likelihood gains by it.
/// fit: coordinates of the parts, with the standard errors that set the first steps. again: how often the profile may
/// be repeated where the maximum lies beyond its steps.
ProfiledValues profiled(const ProfiledModel& model, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                        int again = 2);

/// Profiles several hypotheses in place: jointly where they have few numbers, else one at a time given the others. A
/// hypothesis with too many numbers (channel errors) is left unchanged. only: index of the part that is profiled, with
/// those that are profiled jointly with it; without it all are. Returns true where no other part would be.
bool profileParts(const ProfiledModel& model, const std::vector<Hypothesis>& parts, std::vector<ProfiledValues>& fits,
                  std::optional<std::size_t> only = std::nullopt);

}  // namespace mmradartwin::diagnosis::fit
