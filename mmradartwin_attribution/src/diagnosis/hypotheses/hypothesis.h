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

/// Fitted number of a mechanism. Its scale is 0 where the mechanism does nothing and 1 at the typical value.
struct Coordinate {
  std::string parameter, unit;
  int element = -1;  ///< of a list; -1 for a single number
  double neutral = 0, typical = 1, min = 0, max = 0;
  std::vector<double> shape =
      {};  ///< of a list: value() times this is added to the list, whose neutral value is 0; else empty

  /// True for levels in dB whose neutral value means no power at all. Their scale is linear in power.
  bool logarithmic() const { return (unit == "dB" || unit == "dBsm") && neutral <= -60; }
  /// True for corner frequencies that do nothing when they are high. Their scale is linear in 1/frequency.
  bool reciprocal() const { return unit == "Hz" && neutral > typical; }
  /// True where values lie on one side of the neutral value only: the effect is absent or present to some degree.
  bool oneSided() const { return logarithmic() || min >= neutral || max <= neutral; }
  double value(double scaled_values) const;
  double scaled(double value) const;
  /// Derivative of value() by the scaled value.
  double slope(double scaled_values) const;
};

/// Change of the twin that the data may support: one mechanism with its free numbers.
struct Hypothesis {
  NamedParameters mechanism;            ///< texts set, numbers at their neutral values
  std::vector<Coordinate> coordinates;  ///< empty where the mechanism is present or absent without a number
  std::string subject;                  ///< actor or material that it concerns, "" for none
  std::string variant;                  ///< distinguishes hypotheses of one mechanism and subject, else ""
  int searched = 0;                     ///< further numbers (edges, a period) that were searched for, not fitted
  bool stated = false;                  ///< the given twin has the mechanism: neutral values are those that it states

  NamedParameters at(const std::vector<double>& scaled_values) const;
  std::string label() const;
  /// True where all coordinates are one-sided, or where there is none.
  bool isOneSided() const;
  /// True for a named error of all ranges or directions that has few numbers.
  bool isGeometry() const;
  MechanismForm form() const;
  /// True where the hypothesis moves an actor.
  bool isMove() const;
};

/// Largest number of steps of a gain over a session.
constexpr int kMostSteps = 3;
/// Hypothesis that a gain changes in that many steps (steps_db, at equal parts of the session) instead of at a rate.
/// The steps replace all other numbers. Nothing where the mechanism has no steps.
std::optional<Hypothesis> withSteps(Hypothesis h, int steps);

/// Replaces the mechanism in the list that this one excludes, else appends this one.
void replaceOrAppend(const NamedParameters& mechanism, std::vector<NamedParameters>& mechanisms);
/// `base` with the parts' mechanisms, appended or in place of those that the twin states. scaled_values: [coordinates
/// of all parts, one part after the other].
std::vector<NamedParameters> mechanismsWith(std::vector<NamedParameters> base, const std::vector<Hypothesis>& parts,
                                            const std::vector<double>& scaled_values);

/// Hypotheses of all registered mechanisms that state how to try them: one per actor or material where a mechanism
/// concerns one, and those that are present or absent. A mechanism in `present` that the given twin states yields
/// hypotheses of other values, except for levels that may vanish, corner frequencies, and what is present or absent.
/// Other mechanisms in `present` yield none.
std::vector<Hypothesis> allHypotheses(const Twin& twin, const std::vector<NamedParameters>& present);

}  // namespace mmradartwin::diagnosis::hypotheses
