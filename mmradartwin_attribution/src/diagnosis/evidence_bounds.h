#pragma once

#include <cstddef>

#include "hypothesis.h"

namespace mmradartwin {

/// Nats, inflation taken off, from which on a hypothesis stands though no map gains by it. traces: it moves echoes in
/// the room. Set by sessions with nothing hidden: see evidence_bounds.cpp.
double leastNats(const Hypothesis& hypothesis, bool traces, std::size_t poses);

}  // namespace mmradartwin
