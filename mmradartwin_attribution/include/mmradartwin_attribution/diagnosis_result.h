#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// A hypothesis that was looked at, for the report.
struct TriedHypothesis {
  std::string label;
  double screened_nats = 0;  ///< nats by the score test
  double gain = 0;           ///< nats after the fit, NaN where it was not fitted, and so what follows
  int round = 0;
  double gain_without_best_place = 0;  ///< nats without the place that gains most
  double overdispersion = 1;           ///< of chance over places, by which that is divided before it is judged
  double held_out_gain = 0;            ///< nats on places that the fit did not see
  double false_alarm_rate = 1;         ///< family-wise
  std::string fitted;                  ///< its numbers, as "forward_m 0.031; left_m -0.002"
  std::string verdict;                 ///< "found", or what speaks against it; "" where none was needed
};

/// Another twin of the same session: how much likelier the data are under it.
struct ComparedTwin {
  std::string file;
  double log_likelihood_gain = 0;  ///< nats over the twin as given, actors' and poses' errors fitted with each
  std::array<double, 2> log_likelihood_gain_ci95{};  ///< by bootstrap over locations
  double explained_power = 0;                        ///< all poses
};

/// How an actor's echoes differ from those that the twin expects of it, beside what was found: posterior mean and
/// standard deviation, per reflection. What all actors share is left out: that is the radar's.
struct ActorErrors {
  std::string actor;
  double level_db = 0, level_sd_db = 0;
  double range_m = 0, range_sd_m = 0;  ///< one-way
};

/// The survey seen from above, in map, for the findings' figures.
struct SurveyPlan {
  struct Wall {  ///< an upright triangle of an actor
    std::string actor;
    Eigen::Vector2d from_m, to_m;
  };
  struct Station {
    std::string pose;
    Eigen::Vector2d at_m;
    Eigen::Vector2d boresight;
  };
  std::vector<Wall> walls;  ///< none without a scene
  std::vector<Station> stations;
};

struct Diagnosis {
  Findings findings;
  bool has_twin = true;               ///< false where there was no scene to simulate
  TwinDescription extended;           ///< the twin with all findings' mechanisms
  std::vector<PoseProblem> problems;  ///< poses that were left out
  std::vector<TriedHypothesis> tried;
  double explained_power = 0;  ///< of the twin as given, all poses
  /// Nats that the twin as given gained by `knife_edges: 1`, where all was judged so; the extended twin then has it.
  std::optional<double> knife_edges_nats;
  std::vector<ActorErrors> actors;  ///< of which the session says more than what was stated
  std::vector<ComparedTwin> compared;
  SurveyPlan plan;
};

}  // namespace mmradartwin
