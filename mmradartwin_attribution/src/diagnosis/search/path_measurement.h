#pragma once

#include <string>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin::diagnosis::search {

/// What of an echo a law without a name may be of: a parameter of empirical_law.
struct Observable {
  enum class Kind { kGain, kDelay, kAngle, kAngleOfPose, kChannelGain, kChannelPhase } kind;
  const char *parameter, *unit;
  double typical, limit;
  double usual;                       ///< standard deviation that a law's values are given beforehand
  double floor;                       ///< least scatter of a path that is believed
  bool constant;                      ///< a constant of it is fitted along: the session's gain is free already
  std::vector<std::string> over;      ///< variables that a law of it is looked for over, of all paths
  std::vector<double> channels = {};  ///< against the others; all where none are given

  bool isOfChannels() const { return !channels.empty(); }
};

/// The gain comes first.
std::vector<Observable> observables(const RadarConfig& radar);

/// A path that stands out where it is expected, and how far off it is there.
struct MeasuredPath {
  PathRecord record;        ///< as received
  double share = 1;         ///< of the cell's expected power: so much of a law on the path shows
  bool alone = false;       ///< its channels hold little else
  std::vector<double> off;  ///< by observable, in its unit
};
struct MeasuredPose {
  int location = 0;
  LawVariable::PathPlace where;
  std::vector<MeasuredPath> paths;
};

/// Measures the paths of one pose, each by itself: level, range, azimuth and channels against what the state expects.
/// twin: with the state's mechanisms. What is returned refers to its scene.
MeasuredPose measurePaths(const Twin& twin, const ChannelLikelihood& model, const ModelState& state, int pose,
                          double session_s, const std::vector<Observable>& of);

}  // namespace mmradartwin::diagnosis::search
