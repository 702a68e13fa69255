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
/// Gain by which other latents of a state have to be better to replace its own; see
/// docs/calibration_of_bounds.md#kleastnatsofbetterlatents
inline constexpr double kLeastNatsOfBetterLatents = 0.5;
/// Distance of two sets of latents below which both climb to one optimum; see
/// docs/calibration_of_bounds.md#ksameoptimum_nats
inline constexpr double kSameOptimum_nats = 1;
/// Gain, the best place left out, from which on a finding is plain whatever its scatter over places; see
/// docs/calibration_of_bounds.md#kplain_nats_per_pose
inline constexpr double kPlain_nats_per_pose = 5;
/// Most that the false-alarm rate of a plain finding is; see docs/calibration_of_bounds.md#kfalsealarmrateofplain
inline constexpr double kFalseAlarmRateOfPlain = 0.01;
/// Gain over its overdispersion from which on a move far away is believed; see
/// docs/calibration_of_bounds.md#kleastnatsoffaraway
inline constexpr double kLeastNatsOfFarAway = 60;
/// Price of each fitted or searched number when hypotheses are ranked; see
/// docs/calibration_of_bounds.md#kpriceofnumber_nats
inline constexpr double kPriceOfNumber_nats = 5;
/// Further price of an object that the twin lacks: it is the best of many places; see
/// docs/calibration_of_bounds.md#kpriceofplace_nats
inline constexpr double kPriceOfPlace_nats = 10;
/// Share of its gain by which a law without a name is ranked beside names; see
/// docs/calibration_of_bounds.md#krankedshareoflaw
inline constexpr double kRankedShareOfLaw = 2.0 / 3;
/// Share of their gain by which several searched steps of the gain are ranked; see
/// docs/calibration_of_bounds.md#krankedshareofsteps
inline constexpr double kRankedShareOfSteps = 0.9;
/// Share of its gain by which a law of channels or directions is ranked; see
/// docs/calibration_of_bounds.md#krankedshareofnestinglaw
inline constexpr double kRankedShareOfNestingLaw = 0.9;

// ---- receiver

// ---- search

// ---- gain

// ---- rounds

// ---- conductor

/// Share of the measured power that a twin has to explain beyond what chance explains before scene and recording belong
/// together; see docs/calibration_of_bounds.md#kleastexplainedbeyondchance
inline constexpr double kLeastExplainedBeyondChance = 0.05;

}  // namespace mmradartwin::diagnosis::bounds
