#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/likelihood/bounded_step.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::fit {

constexpr double kLeastForSearch_nats = 25;  ///< gain along slopes from which a rough likelihood is also searched

/// Place of the highest likelihood that a climb has found.
struct Optimum {
  std::vector<double> scaled_values;
  ModelState state;
  Scores scores;  ///< at the last place whose derivatives were taken
};

/// Task of a climb: to maximise the likelihood over the coordinates of several hypotheses.
struct ClimbTask {
  const std::vector<NamedParameters>& base;  ///< mechanisms without the hypotheses
  const SessionLatents& latents;             ///< latents to start from
  const std::vector<Hypothesis>& parts;
  const std::vector<std::vector<double>>& starts;  ///< [starts][coordinates of all parts] scaled
  int steps;                                       ///< Fisher steps; more are made while each gains much
  /// State without the hypotheses. A geometry is searched without slopes only where it gains over this state at more
  /// than one place; always where null.
  const ModelState* null = nullptr;
  double least_nats = 0;  ///< gain over the null that matters; a climb that will not reach it stops
  const HypothesisFit* known =
      nullptr;  ///< earlier fit of the same hypothesis, whose optimum needs no search; may be null
};

/// Maximises a likelihood by Fisher scoring from the best start. Where paths appear and vanish within millimetres, a
/// search without slopes follows.
class LikelihoodClimb {
 public:
  /// Keeps references.
  LikelihoodClimb(ExpectedEchoes& source, const ChannelLikelihood& model, const ClimbTask& task);
  Optimum run();

 private:
  std::vector<NamedParameters> mechanismsAt(const std::vector<double>& scaled_values) const {
    return mechanismsWith(task_.base, task_.parts, scaled_values);
  }
  /// Latents that each start is tried with: those given, and those without errors that may have absorbed the cause.
  std::vector<SessionLatents> startingLatents() const;
  ModelState stateAt(const std::vector<double>& scaled_values, const SessionLatents& latents) const;
  /// Makes a state the optimum where its likelihood is higher.
  void take(const ModelState& state, const std::vector<double>& scaled_values);
  /// Tries values with each of the starting latents. Returns the state of highest likelihood.
  ModelState consider(const std::vector<double>& scaled_values);
  void tryStarts();
  Scores derivatives(const ModelState& state, const std::vector<double>& scaled_values) const;
  void climb();
  /// Step of the globals and of the coordinates that the quadratic at the optimum promises most for.
  likelihood::BoundedStep bestStep() const;
  /// Climbs once more from the optimum with latents out of their trap, see ChannelLikelihood::fitWithoutTrap().
  void climbOutOfTrap();
  /// Climbs once more from where the subject has taken over what latent errors of its actors stand for. Seen from one
  /// side, a move and an error of its range are alike, a material's level and its actors' own, and a climb ends early
  /// on the ridge between them.
  void takeOverErrors();
  /// Takes the longest share of a step that gains, and more of a step that gains more than it promises. Returns the
  /// gain, 0 where no share gains.
  double stepBy(const likelihood::BoundedStep& best);
  /// Makes a share of a step the optimum where it is likelier. Returns how much.
  std::optional<double> tryStep(const Eigen::VectorXd& step, const Optimum& from, double share);
  /// Tries values over the whole range of a single number, and climbs from one that is likelier than the optimum.
  /// Values of a range lie half a bin apart.
  void scan();
  /// Climbs from another value, and keeps what it reaches where that is likelier than the optimum.
  void climbFrom(ModelState state, std::vector<double> scaled_values);
  /// True for a range that may be off by many bins.
  bool spansBins(const Coordinate& c) const;
  /// [values] scaled values over the whole range of a number.
  std::vector<double> scannedValues(const Coordinate& c) const;
  /// Those of a list of values of the only number that are likelier than their neighbours: the likeliest few, by some
  /// of the poses, with these latents.
  std::vector<double> peaks(const std::vector<double>& values, const SessionLatents& latents) const;
  bool needsSearch() const;
  /// Searches without slopes around the optimum; first_step is scaled.
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

/// Gain in nats of a state over the null, without the location that gains most.
double gainWithoutBestPlace(const ChannelData& data, const ModelState& null, const ModelState& state);
/// [locations] gain in nats of a state over the null.
std::vector<double> gainByLocation(const ChannelData& data, const ModelState& null, const ModelState& state);

}  // namespace mmradartwin::diagnosis::fit
