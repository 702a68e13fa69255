#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Where an actor stands against where the scene has it, level, in map.
struct LevelShift {
  Eigen::Vector2d mean_m;
  Eigen::Matrix2d covariance_m2;
};

/// How much farther an actor's echoes come from than the scene has it.
struct RefinedActor {
  std::string actor;
  double range_m = 0;  ///< one way, positive: farther
  double std_m = 0;    ///< of range_m
  /// Where the places see it from several sides, so that both components are known better than is stated.
  std::optional<LevelShift> shift;
};

/// Places of a scene's actors by what a session's radar says, within the scene's stated error.
struct SceneRefinement {
  std::vector<RefinedActor> actors;  ///< of whose place the session says more than is stated; in the scene's order
  double scene_m = 0;                ///< the stated error that they were judged by, 1 sigma
  int poses = 0, locations = 0;
  /// Log-likelihood per pose with every actor where the scene has it, and where the other locations have it: each fifth
  /// of the locations is judged by shifts and ranges that it has no part in. Without an interval where there is one
  /// location.
  GainMetric held_out_nats_per_pose;

  /// YAML as refine_scene writes it (docs/room/scan_to_scene.md).
  std::string toYaml(const std::string& recording) const;
};

/// Posterior ranges of all actors under the likelihood of the diagnosis, all else of the session fitted with them: the
/// errors are normal with the stated error of the scene. What all actors share is no error of the scene (a range bias
/// has a name of its own) and is left out. Throws InputError where recording and twin cannot belong together or the
/// twin explains no more than chance, DiagnosisCancelled.
SceneRefinement refineScene(const Recording& recording, Twin& twin, const DiagnosisOptions& options);

}  // namespace mmradartwin
