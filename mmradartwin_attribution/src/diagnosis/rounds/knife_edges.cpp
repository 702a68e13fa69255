#include "diagnosis/rounds/knife_edges.h"

#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/gain/held_out_gain.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

constexpr const char* kKnifeEdges = "knife_edges";

}  // namespace

std::optional<std::vector<NamedParameters>> withKnifeEdges(std::vector<NamedParameters> mechanisms) {
  bool changed = false;
  for (NamedParameters& m : mechanisms) {
    if (!m.values.has(kKnifeEdges) || m.values.number(kKnifeEdges) > 0.5) continue;
    m.values.set(kKnifeEdges, 1.0);
    changed = true;
  }
  if (!changed) return std::nullopt;
  return mechanisms;
}

std::optional<ModelState> likelierWithKnifeEdges(DiagnosisContext& context, const ModelState& plain) {
  const std::optional<std::vector<NamedParameters>> mechanisms = withKnifeEdges(plain.mechanisms);
  if (!mechanisms) return std::nullopt;
  context.report("fields behind edges", 0);
  context.echoes.setBaseline(*mechanisms);
  ModelState state = context.fitter.state(*mechanisms, &plain.latents);
  const double nats = state.log_likelihood - plain.log_likelihood;
  const bool at_many_places = context.data.locations.size() < 2 ||
                              (*likelihoodGain(context.data, plain.by_pose, state.by_pose).difference_ci95)[0] > 0;
  if (nats > bounds::kNotToldApart_nats && at_many_places) return state;
  context.echoes.setBaseline(plain.mechanisms);
  return std::nullopt;
}

}  // namespace mmradartwin::diagnosis::rounds
