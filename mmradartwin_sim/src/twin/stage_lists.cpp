#include "twin/stage_lists.h"

namespace mmradartwin {
namespace {

template <typename Stage>
void addTo(std::vector<const Stage*>& list, const Mechanism& mechanism) {
  if (const auto* stage = dynamic_cast<const Stage*>(&mechanism)) list.push_back(stage);
}

}  // namespace

StageLists::StageLists(const std::vector<std::unique_ptr<Mechanism>>& mechanisms) {
  for (const auto& m : mechanisms) {
    addTo(scene, *m);
    addTo(mounting, *m);
    if (const auto* stage = dynamic_cast<const PathStage*>(m.get())) paths.push_back({stage, m.get()});
    addTo(weights, *m);
    addTo(replicas, *m);
    addTo(tones, *m);
    addTo(distortions, *m);
    addTo(receive, *m);
    addTo(chirp_paths, *m);
    addTo(modulations, *m);
    addTo(chirps, *m);
    addTo(digitise, *m);
    addTo(transport, *m);
    needs_strongest = needs_strongest || m->needsStrongestAmplitude();
  }
}

}  // namespace mmradartwin
