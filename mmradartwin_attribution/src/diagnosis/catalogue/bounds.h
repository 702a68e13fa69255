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
/// Promise from which on a law without a name, or a replica of echoes, is worth a fit; see
/// docs/calibration_of_bounds.md#kleastnatsoflaw
inline constexpr double kLeastNatsOfLaw = 8;
/// Promise of the best of all places from which on an object there is taken for real; see
/// docs/calibration_of_bounds.md#kleastnatsofobject
inline constexpr double kLeastNatsOfObject = 3;
/// Promise from which on a second face of an actor is worth a fit; see
/// docs/calibration_of_bounds.md#kleastnatsofsecondface
inline constexpr double kLeastNatsOfSecondFace = 50;
/// Nats of an actor's own errors from which on the actor is looked for elsewhere; see
/// docs/calibration_of_bounds.md#kleastnatsoutofplace
inline constexpr double kLeastNatsOutOfPlace = 1.2;
/// Gain by all of an actor's echoes nearer or farther away from which on the actor is looked for elsewhere; see
/// docs/calibration_of_bounds.md#kleastnatselsewhere
inline constexpr double kLeastNatsElsewhere = 5;
/// Standard deviations from none at which an error that latents share is tried as a cause; see
/// docs/calibration_of_bounds.md#ksharedlatent_sigmas
inline constexpr double kSharedLatent_sigmas = 3;
/// Level of a law over passing paths, at most, for which something may hide what is behind it; see
/// docs/calibration_of_bounds.md#khides_db
inline constexpr double kHides_db = -6;
/// Price of each number of a law when laws are compared; see docs/calibration_of_bounds.md#kpriceoflawnumber_nats
inline constexpr double kPriceOfLawNumber_nats = 4;
/// Nats over the price that a law has at least; a fit sometimes finds what paths alone show less of; see
/// docs/calibration_of_bounds.md#kleastworthoflaw_nats
inline constexpr double kLeastWorthOfLaw_nats = -2;
/// Effective number of places that tell of a law with nothing outside a part of its variable, at least; see
/// docs/calibration_of_bounds.md#kfewestplacesoflaw
inline constexpr double kFewestPlacesOfLaw = 3;
/// Factor of the nats that time explains beyond which gains that differ from pose to pose follow no time; see
/// docs/calibration_of_bounds.md#kbeyondtime
inline constexpr double kBeyondTime = 1.5;

// ---- gain

// ---- rounds
/// Share of the measured power that a fit explains more before it counts as gaining in the maps, and less before the
/// maps count as plainly worse; see docs/calibration_of_bounds.md#kleastexplainedmore
inline constexpr double kLeastExplainedMore = 0.002;
/// Share of the measured power that a plain fit may explain less; see docs/calibration_of_bounds.md#kmostexplainedlost
inline constexpr double kMostExplainedLost = 0.015;
/// The same of a law of levels, beside which maps do not fit the actors' errors of level; see
/// docs/calibration_of_bounds.md#kmostexplainedlost
inline constexpr double kMostExplainedLostByLevels = 0.05;
/// Correlation over poses of the gains of two fits from which on a name explains some of what a better one was rejected
/// for by the maps; see docs/calibration_of_bounds.md#kcorrelationofsomeshared
inline constexpr double kCorrelationOfSomeShared = 0.2;
/// The same from which on two fits explain the same; see docs/calibration_of_bounds.md#kcorrelationofsomeshared
inline constexpr double kCorrelationOfSame = 0.5;
/// Share of an unknown's gain below which a name beside it is a leftover of the unknown's law; see
/// docs/calibration_of_bounds.md#ksharebesideunknown
inline constexpr double kShareBesideUnknown = 0.25;

// ---- conductor

/// Share of the measured power that a twin has to explain beyond what chance explains before scene and recording belong
/// together; see docs/calibration_of_bounds.md#kleastexplainedbeyondchance
inline constexpr double kLeastExplainedBeyondChance = 0.05;

}  // namespace mmradartwin::diagnosis::bounds
