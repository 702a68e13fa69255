#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis {

/// Posterior of a level displacement of an actor, in map.
struct ActorShift {
  Eigen::Vector2d mean_m = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance_m2 = Eigen::Matrix2d::Zero();
};

/// Displacements of all actors, and a range that all of them share.
struct PosteriorShifts {
  std::vector<ActorShift> actors;  ///< [errors, see errorOf()]
  double shared_m = 0;
};

/// Displacements of all actors by their echoes' ranges from several places: an actor that moves by d is farther by u.d
/// from a place that sees it in direction u (of echoes over several actors: half of what both legs gain). Ranges enter
/// as in rangeEvidence(), with all else refitted; a range that all actors share is one more unknown.
class ActorShifts {
 public:
  /// Traces the poses once. u is the mean over an actor's echoes, weighted by power; where a place has none, the
  /// direction of its middle. The likelihood's slopes are taken where the displacements by all poses are.
  ActorShifts(DiagnosisContext& context, const ModelState& state);

  /// By what these poses say. Each level component is normal with the stated error of the scene.
  PosteriorShifts posterior(const std::vector<int>& poses) const;

  /// [errors] added one-way ranges at a pose where actors are displaced, less the shared one.
  std::vector<double> rangesAt(int pose, const PosteriorShifts& shifts) const;

 private:
  struct PoseTerms {
    Eigen::MatrixXd information;  ///< [globals][globals] without priors, the heading eliminated
    Eigen::VectorXd weighted;     ///< [globals] score and information times the ranges at which it was taken
    Eigen::MatrixX2d direction;   ///< [errors][2]
  };
  /// Slopes at a pose's own ranges.
  void takeSlopes(DiagnosisContext& context, const ModelState& state, int pose, const std::vector<double>& range_m);

  int globals_ = 0, errors_ = 0;
  double scene_m_ = 0;
  Eigen::MatrixXd prior_information_;  ///< [globals][globals]
  Eigen::VectorXd prior_score_;        ///< [globals]
  std::vector<PoseTerms> terms_;       ///< [poses]
};

}  // namespace mmradartwin::diagnosis
