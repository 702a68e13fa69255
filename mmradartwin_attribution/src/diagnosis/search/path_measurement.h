#pragma once

#include <string>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin::diagnosis::search {

/// Property of an echo that a law without a name may change: a parameter of empirical_law.
struct Observable {
  enum class Kind { kGain, kDelay, kAngle, kAngleOfPose, kChannelGain, kChannelPhase } kind;
  const char *parameter, *unit;
  double typical, limit;              ///< of a law's values, in `unit`
  double usual;                       ///< prior standard deviation of a law's values
  double floor;                       ///< lower limit of a path's scatter
  bool constant;                      ///< a constant is fitted as well; not for the gain, which the session has already
  std::vector<std::string> over;      ///< variables over which laws of all paths are searched for
  std::vector<double> channels = {};  ///< weights of these channels, compared with the others; empty: all channels

  bool isOfChannels() const { return !channels.empty(); }
};

/// Observables of a radar; the gain comes first.
std::vector<Observable> observables(const RadarConfig& radar);

/// Path that stands out where it is expected, and its deviations.
struct MeasuredPath {
  PathRecord record;        ///< as received
  double share = 1;         ///< of the cell's expected power; a law on the path shows by this share
  bool alone = false;       ///< the channels hold little else
  std::vector<double> off;  ///< [observables] measured minus expected, in the observable's unit
};

/// Measured paths of one pose.
struct MeasuredPose {
  int location = 0;
  LawVariable::PathPlace where;
  std::vector<MeasuredPath> paths;
};

/// Measures the paths of one pose one by one: level, range, azimuth and channels relative to what the state expects.
/// twin: with the state's mechanisms; the result refers to its scene.
MeasuredPose measurePaths(const Twin& twin, const ChannelLikelihood& model, const ModelState& state, int pose,
                          double session_s, const std::vector<Observable>& of);

}  // namespace mmradartwin::diagnosis::search
