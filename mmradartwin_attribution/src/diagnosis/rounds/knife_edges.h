#pragma once

#include <optional>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin::diagnosis::rounds {

/// Mechanisms whose edges weigh a path by the field behind them (`knife_edges: 1`) and not by 0 or 1; nothing where
/// none has the choice, or all have made it.
std::optional<std::vector<NamedParameters>> withKnifeEdges(std::vector<NamedParameters> mechanisms);

/// State of the twin with knife edges where the session is likelier under it than under `plain`, at more places than
/// chance would have it; nothing elsewhere. The plain rule is a step of the likelihood, and its errors of several dB
/// near an edge resemble causes. No number is fitted to the data but the latents.
std::optional<ModelState> likelierWithKnifeEdges(DiagnosisContext& context, const ModelState& plain);

}  // namespace mmradartwin::diagnosis::rounds
