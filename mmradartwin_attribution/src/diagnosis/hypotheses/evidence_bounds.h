#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::hypotheses {

/// Nats, inflation taken off, from which on a hypothesis with such values (scaled) stands though no map gains by it.
/// traces: it moves echoes in the room. Set by sessions with nothing hidden: see evidence_bounds.cpp.
double leastNats(const Hypothesis& hypothesis, const std::vector<double>& scaled_values, bool traces,
                 std::size_t poses);

/// True of edges, and of ways over floor and ceiling, well below the size that theory gives them: what lies about a
/// room looks like that, at some places much and at others not (clutter of another generator was worth 286 nats of
/// edges of 0.42 at 30 poses, with eight times the scatter that its likelihood expects; edges of 1.8 had the scatter
/// expected).
bool isFaintAddition(const Hypothesis& hypothesis, const std::vector<double>& scaled_values);

/// True of what makes echoes stronger or weaker by a law: neither adds any nor moves them.
bool isOfLevels(const Hypothesis& hypothesis);

/// How far scores scatter over places beyond what the likelihood expects, in sessions with nothing hidden, and how many
/// places' scatter it is worth to know that; 0 where it differs from session to session.
struct UsualScatter {
  double overdispersion = 1, places = 0;
};
UsualScatter usualScatter(const Hypothesis& hypothesis);
/// Of scatter over so many places and the usual one (usualScatter()), weighed by what each is known by; at least 1.
double shrunkOverdispersion(double overdispersion, const Hypothesis& hypothesis, std::size_t locations);

}  // namespace mmradartwin::diagnosis::hypotheses
