#pragma once

#include <cstddef>
#include <vector>

#include "diagnosis/hypotheses/hypothesis.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::hypotheses {

/// Least gain in nats, divided by the overdispersion, by which a hypothesis with these scaled values stands although no
/// map gains by it. traces: the hypothesis moves echoes in the room. See
/// docs/verification/calibration_of_bounds.md#least-nats-by-kind.
double leastNats(const Hypothesis& hypothesis, const std::vector<double>& scaled_values, bool traces,
                 std::size_t poses);

/// True of edges, and of paths over floor and ceiling, at levels well below those that theory gives. Clutter about a
/// room looks like them, much of it at some places and little at others.
bool isFaintAddition(const Hypothesis& hypothesis, const std::vector<double>& scaled_values);

/// True of hypotheses that change the levels of echoes by a law, and neither add nor move echoes.
bool isOfLevels(const Hypothesis& hypothesis);

/// Overdispersion that scores of such a hypothesis have over places when it is not the cause, and the number of places
/// whose scatter weighs as much as this prior knowledge. places is 0 where the overdispersion differs from session to
/// session.
struct UsualScatter {
  double overdispersion = 1, places = 0;
};
UsualScatter usualScatter(const Hypothesis& hypothesis);
/// Mean of the measured overdispersion over so many locations and the usual one (usualScatter()), weighted by the
/// degrees of freedom of both; at least 1.
double shrunkOverdispersion(double overdispersion, const Hypothesis& hypothesis, std::size_t locations);

}  // namespace mmradartwin::diagnosis::hypotheses
