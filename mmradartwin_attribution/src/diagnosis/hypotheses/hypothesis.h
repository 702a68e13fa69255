#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/mechanism_traits.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::hypotheses {

/// A number of a mechanism that is fitted, on a scale where 0 is where it does nothing and 1 its typical value.
struct Coordinate {
  std::string parameter, unit;
  int element = -1;  ///< of a list, -1 for a plain number
  double neutral = 0, typical = 1, min = 0, max = 0;
  std::vector<double> shape = {};  ///< of a list: adds value() times this to all of it, neutral being 0; else empty

  /// True for levels in dB whose neutral value stands for nothing at all: then the scale is one of power.
  bool logarithmic() const { return (unit == "dB" || unit == "dBsm") && neutral <= -60; }
  /// True for corner frequencies that do nothing when they are far above: then the scale is one of 1/frequency.
  bool reciprocal() const { return unit == "Hz" && neutral > typical; }
  /// True where it has one side: what is there or not, more or less.
  bool oneSided() const { return logarithmic() || min >= neutral || max <= neutral; }
  double value(double scaled_values) const;
  double scaled(double value) const;
  /// Derivative of value() by the scale.
  double slope(double scaled_values) const;
};

/// A change of the twin that data may support: one mechanism with what is free in it.
struct Hypothesis {
  NamedParameters mechanism;            ///< texts set, numbers at their neutral values
  std::vector<Coordinate> coordinates;  ///< empty: it is there or not
  std::string subject;                  ///< actor or material it is about, "" for none
  std::string variant;                  ///< what tells it from others of that mechanism and subject, "" for nothing
  int searched = 0;                     ///< further numbers (edges, a period) that were looked for, not fitted
  bool stated = false;                  ///< the twin as given has it: neutral values are those that it states

  NamedParameters at(const std::vector<double>& scaled_values) const;
  std::string label() const;
  /// True where all of it is there or not, more or less.
  bool isOneSided() const;
  /// True for a named error of all ranges or directions in a few numbers.
  bool isGeometry() const;
  MechanismForm form() const;
  /// True for an actor that stands elsewhere.
  bool isMove() const;
};

/// Steps of a gain over a session are tried up to this number.
constexpr int kMostSteps = 3;
/// A gain may change at once instead of at a rate: the same with so many steps (steps_db) in place of all other
/// numbers, at equal parts of the session; nothing where its mechanism has no steps.
std::optional<Hypothesis> withSteps(Hypothesis h, int steps);

/// Puts it in place of what it excludes, else behind all.
void replaceOrAppend(const NamedParameters& mechanism, std::vector<NamedParameters>& mechanisms);
/// `base` with the parts, their coordinates in a row: behind it, or in place of what the twin states.
std::vector<NamedParameters> mechanismsWith(std::vector<NamedParameters> base, const std::vector<Hypothesis>& parts,
                                            const std::vector<double>& scaled_values);

/// Every registered mechanism that says how to try it, once per actor or material where it concerns one, and those that
/// are there or not. Of those in `present` that the twin as given states, other values than it states; levels that may
/// be nothing, corner frequencies, what is there or not, and all else in `present` are left out.
std::vector<Hypothesis> allHypotheses(const Twin& twin, const std::vector<NamedParameters>& present);

}  // namespace mmradartwin::diagnosis::hypotheses
