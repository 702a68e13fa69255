#pragma once

#include <cstddef>
#include <optional>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::rounds {

/// Move of the same actor by no more than actors err along each axis, where chance could gain what `far`, a fit of a
/// move beyond that, gains over it; nothing elsewhere. An actor that slides along its own surface changes little but
/// what its edges hide: the small error that it has gains the nats, and takes the slide along. null: the state that
/// both are compared with. family: number of hypotheses that are tried.
std::optional<HypothesisFit> moveWithinErrors(DiagnosisContext& context, const ModelState& null,
                                              const HypothesisFit& far, std::size_t family);

}  // namespace mmradartwin::diagnosis::rounds
