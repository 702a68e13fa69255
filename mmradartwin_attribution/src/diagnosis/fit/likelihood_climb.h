#pragma once

#include <functional>
#include <vector>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

constexpr double kLeastForSearch_nats = 25;  ///< gain by slopes from which on a rough likelihood is searched

/// Highest likelihood that a climb has found.
struct Optimum {
  std::vector<double> scaled_values;
  ModelState state;
  Scores scores;  ///< at the last place with derivatives
};

/// Task of a climb: to maximise the likelihood over the coordinates of several hypotheses.
struct ClimbTask {
  const std::vector<NamedParameters>& base;  ///< mechanisms without the hypotheses
  const SessionLatents& latents;             ///< latents to start from
  const std::vector<Hypothesis>& parts;
  const std::vector<std::vector<double>>& starts;  ///< scaled coordinates of all parts
  int steps;                                       ///< Fisher steps, more while they gain much
  /// A geometry is searched without slopes only where it gains over this state at more than one place; always where it
  /// is null.
  const ModelState* null = nullptr;
  double least_nats = 0;                 ///< gain over the null that matters: a climb that will not reach it ends
  const HypothesisFit* known = nullptr;  ///< a fit of the same, whose optimum needs no search
};

/// Maximises a likelihood: from the best start by Fisher scoring, and where paths come and go within millimetres by a
/// search without slopes.
class LikelihoodClimb {
 public:
  /// Keeps references.
  LikelihoodClimb(ExpectedEchoes& source, const ChannelLikelihood& model, const ClimbTask& task);
  Optimum run();

 private:
  std::vector<NamedParameters> mechanismsAt(const std::vector<double>& scaled_values) const {
    return mechanismsWith(task_.base, task_.parts, scaled_values);
  }
  /// Latents with which a start is tried: as given, and without those that may stand in for the cause.
  std::vector<SessionLatents> startingLatents() const;
  ModelState stateAt(const std::vector<double>& scaled_values, const SessionLatents& latents) const;
  /// Takes a state for the optimum where its likelihood is higher.
  void take(const ModelState& state, const std::vector<double>& scaled_values);
  /// Tries values with each of the starting latents; returns the likeliest state.
  ModelState consider(const std::vector<double>& scaled_values);
  void tryStarts();
  Scores derivatives(const ModelState& state, const std::vector<double>& scaled_values) const;
  void climb();
  /// Takes the longest share of a step that gains; returns the gain, 0 where none does.
  double stepBy(const Eigen::VectorXd& step);
  bool needsSearch() const;
  /// Searches without slopes around the optimum, from one first step on.
  void search(double first_step);

  ExpectedEchoes& source_;
  const ChannelLikelihood& model_;
  const ClimbTask task_;
  std::vector<Coordinate> coordinates_;
  int globals_;
  bool geometric_;  ///< a part edits the scene or moves the radar
  std::vector<SessionLatents> latents_;
  std::vector<int> everyone_;
  Optimum optimum_;
};

/// Gain of a state over the null, without the location that gains most.
double gainWithoutBestPlace(const ChannelData& data, const ModelState& null, const ModelState& state);
/// [locations] gain of a state over the null.
std::vector<double> gainByLocation(const ChannelData& data, const ModelState& null, const ModelState& state);

}  // namespace mmradartwin::diagnosis::fit
