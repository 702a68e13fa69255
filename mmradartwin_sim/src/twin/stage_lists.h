#pragma once

#include <memory>
#include <vector>

#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin {

/// A mechanism that adds paths, as its stage and by itself.
struct PathSource {
  const PathStage* stage;
  const Mechanism* mechanism;
};

/// The mechanisms of a twin by the stage that they act in, each list by rank.
struct StageLists {
  StageLists() = default;
  explicit StageLists(const std::vector<std::unique_ptr<Mechanism>>& mechanisms);

  std::vector<const SceneStage*> scene;
  std::vector<const MountingStage*> mounting;
  std::vector<PathSource> paths;
  std::vector<const WeightStage*> weights;
  std::vector<const ReplicaStage*> replicas;
  std::vector<const ToneStage*> tones;
  std::vector<const DistortionStage*> distortions;
  std::vector<const ReceiveStage*> receive;
  std::vector<const ChirpPathStage*> chirp_paths;
  std::vector<const ModulationStage*> modulations;
  std::vector<const ChirpStage*> chirps;
  std::vector<const DigitiseStage*> digitise;
  std::vector<const TransportStage*> transport;
  bool needs_strongest = false;  ///< Mechanism::needsStrongestAmplitude() of any
};

}  // namespace mmradartwin
