#pragma once

#include <cstddef>

/// Bounds of evidence: how many nats, how small a false-alarm rate or how large an effect a statement needs. Each has
/// its unit, its meaning and a reference to the run that set it, a section of docs/calibration_of_bounds.md. Bounds
/// that follow from the user's stated accuracies are derived from them in stated_bounds.h. Constants of numerics and of
/// effort (steps, starts, grids) stay where they are used.
namespace mmradartwin::diagnosis::bounds {

// ---- frames

// ---- channels

// ---- likelihood

// ---- hypotheses

// ---- fit

// ---- receiver

// ---- search

// ---- gain

// ---- rounds

// ---- conductor

/// Share of the measured power that a twin has to explain beyond what chance explains before scene and recording belong
/// together; see docs/calibration_of_bounds.md#kleastexplainedbeyondchance
inline constexpr double kLeastExplainedBeyondChance = 0.05;

}  // namespace mmradartwin::diagnosis::bounds
