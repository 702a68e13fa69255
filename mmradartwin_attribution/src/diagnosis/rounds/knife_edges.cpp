#include "diagnosis/rounds/knife_edges.h"

#include <cmath>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/gain/held_out_gain.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

constexpr const char* kKnifeEdges = "knife_edges";
constexpr std::size_t kPosesBeforeFit = 22;  ///< looked at, evenly spread; most sessions have more
constexpr double kSure_sigmas = 3;           ///< of a loss that no fit of latents turns into a gain

/// True where poses are surely less likely before the latents are fitted, which spares the fit: such a loss is far
/// larger than what fitted latents win; see docs/verification/speed.md#a-full-campaign.
bool surelyLoses(DiagnosisContext& context, const ModelState& plain, const std::vector<NamedParameters>& mechanisms) {
  const std::vector<int> poses = evenlySpread(plain.by_pose.size(), kPosesBeforeFit);
  const auto echoes = context.echoes.echoes(mechanisms, poses, plain.actor_range_m);
  const std::vector<double> nats = context.likelihood.byPose(echoes, plain.latents, poses);
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double gain = nats[i] - plain.by_pose[static_cast<std::size_t>(poses[i])];
    sum += gain;
    squares += gain * gain;
  }
  return sum < -kSure_sigmas * std::sqrt(squares);
}

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
  if (surelyLoses(context, plain, *mechanisms)) {
    context.echoes.setBaseline(plain.mechanisms);
    return std::nullopt;
  }
  ModelState state = context.fitter.state(*mechanisms, &plain.latents);
  const double nats = state.log_likelihood - plain.log_likelihood;
  const bool at_many_places = context.data.locations.size() < 2 ||
                              (*likelihoodGain(context.data, plain.by_pose, state.by_pose).difference_ci95)[0] > 0;
  if (nats > bounds::kNotToldApart_nats && at_many_places) return state;
  context.echoes.setBaseline(plain.mechanisms);
  return std::nullopt;
}

}  // namespace mmradartwin::diagnosis::rounds
