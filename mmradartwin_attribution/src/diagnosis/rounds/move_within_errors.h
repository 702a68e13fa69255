#pragma once

#include <optional>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::rounds {

/// Move of the same actor by no more than actors err along each axis, where the session does not tell it from `far`, a
/// fit of a move beyond that; nothing elsewhere. An actor that slides along its own surface changes little but what its
/// edges hide: the small error that it has gains the nats, and takes the slide along. null: the state that both are
/// compared with.
std::optional<HypothesisFit> moveWithinErrors(DiagnosisContext& context, const ModelState& null,
                                              const HypothesisFit& far);

}  // namespace mmradartwin::diagnosis::rounds
