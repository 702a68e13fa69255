#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// Kinds of mechanisms that a step of the diagnosis treats in a way of their own. The default, kOrdinary, is for all
/// others: numbers that are fitted against nothing, once per actor or material where the mechanism names one.
enum class MechanismForm {
  kOrdinary,
  kActorMoved,        ///< an actor that stands elsewhere: dx_m, dy_m, dyaw_deg
  kActorAbsent,       ///< an actor that is gone
  kUnmodelledObject,  ///< an object that the scene lacks: x_m, y_m, size_m
  kLateEcho,          ///< an echo from a place where nothing stands: x_m, y_m
  kLaw,               ///< a law without a name, of a variable
  kSurfaceClutter,    ///< small things that lie about on an actor: actor
  kReplica,           ///< a second echo behind each echo
  kLossOverRange,     ///< levels that fall with range
  kGainOverTime,      ///< levels that change with time
  kRadarOffset,       ///< the radar stands elsewhere: forward_m, left_m
  kSceneOffset,       ///< the scene stands elsewhere: x_m, y_m
  kMaterialLevel,     ///< level of a material's or an actor's echoes
  kTransmitterDelay,  ///< one transmitter's channels come later: slot, delay_m, phase_deg
  kChannelErrors,     ///< a level and a phase per channel
  kReceiverImage,     ///< an image at the mirrored frequency, measured against its hosts
  kHarmonic,          ///< a level that refers to the strongest echo, fitted against its hosts
  kBodyFixedTone,     ///< a tone of the radar's own
  kNoiseFloor         ///< the level of the thermal noise
};

/// Clutter that looks like a mechanism: what speaks for the mechanism all the same.
enum class ClutterLikeness {
  kNone,                   ///< clutter does not look like it
  kUnlessMapsGain,         ///< believed where the maps explain more
  kUnlessMapsGainOrLarge,  ///< of an object: believed where the maps explain more, if it is small only surely so
  kUnlessMapsGainOrLoud,   ///< of one actor: believed where the maps explain more, or from a level on
  kUnlessSure,             ///< believed where the maps surely explain more, or much evidence stands for it
  kUnlessSureOrStrong      ///< the same, or from a value on
};

/// Range of a parameter outside of which a fitted value is no finding, with the reason that the report gives.
struct PlausibleRange {
  std::string parameter, unit;  ///< unit: as it stands behind the value in the reason, "" for none
  double low, high;
  std::string too_low, too_high;  ///< reasons
};

/// Experiment that tells a cause from its neighbours. Of several candidates the first one of this order is proposed.
enum class Experiment { kReflector, kHighPassCode, kTurnAndMeasure, kRaise, kSurface, kAbsorber };

/// Everything that the diagnosis knows of a mechanism beside its parameters. It stands in the mechanism's row of the
/// catalogue; the engine asks for it and knows no names.
struct MechanismTraits {
  MechanismForm form = MechanismForm::kOrdinary;
  Experiment experiment = Experiment::kAbsorber;
  ClutterLikeness clutter = ClutterLikeness::kNone;
  std::string clutter_parameter = {};  ///< whose value kUnlessMapsGainOrLoud and kUnlessSureOrStrong look at
  double clutter_bound = 0;            ///< value from which on it is no clutter
  std::vector<PlausibleRange> plausible = {};
};

/// Traits of a mechanism, whether it is a cause of the catalogue or describes something without a name.
const MechanismTraits& traitsOf(const std::string& mechanism);
/// Mechanism of the simulator that has this form; "" for kOrdinary.
const std::string& mechanismOfForm(MechanismForm form);

}  // namespace mmradartwin
