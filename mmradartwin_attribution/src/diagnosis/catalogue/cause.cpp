#include <algorithm>
#include <limits>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

namespace {

using Form = MechanismForm;
using Clutter = ClutterLikeness;
namespace bounds = diagnosis::bounds;

constexpr double kAny = std::numeric_limits<double>::infinity();

std::vector<CauseDescription> builtInCauses() {  // NOLINT(readability-function-size): a table
  constexpr ResidualClass kC1 = ResidualClass::kMissingSupport, kC2 = ResidualClass::kWeakSupport,
                          kC3 = ResidualClass::kUnsupportedAnchor, kC4 = ResidualClass::kShiftedResponse,
                          kC5 = ResidualClass::kMissingMechanism;
  constexpr ParameterKind kNumber = ParameterKind::kNumber, kText = ParameterKind::kText,
                          kNumbers = ParameterKind::kNumbers, kTexts = ParameterKind::kTexts;
  return {{"tx_rx_leakage", kC3, {{"range_m", "m"}, {"level_db", "dB"}}, {Form::kBodyFixedTone}},
          {"range_bias", kC4, {{"range_m", "m"}}, {Form::kOrdinary, Experiment::kTurnAndMeasure}},
          {"range_scale", kC4, {{"scale", "1"}}, {Form::kOrdinary, Experiment::kTurnAndMeasure}},
          {"carrier_scale", kC4, {{"scale", "1"}}, {Form::kOrdinary, Experiment::kReflector}},
          {"if_highpass", kC3, {{"corner_hz", "Hz"}}, {Form::kOrdinary, Experiment::kHighPassCode}},
          {"if_lowpass", kC3, {{"corner_hz", "Hz"}}, {Form::kOrdinary, Experiment::kHighPassCode}},
          {"excess_attenuation", kC3, {{"db_per_m", "dB/m"}}, {Form::kLossOverRange, Experiment::kHighPassCode}},
          {"gain_drift",
           kC3,
           {{"db_per_hour", "dB/h", kNumber, 1}, {"steps_db", "dB", kNumbers, 1}},
           {Form::kGainOverTime, Experiment::kRaise}},
          {"iq_imbalance",
           kC5,
           {{"image_db", "dB", kNumber, 0, false, true}, {"phase_deg", "deg", kNumber, 0, true, true}},
           {Form::kReceiverImage}},
          {"dc_offset", kC3, {{"level_db", "dB"}}, {Form::kBodyFixedTone}},
          {"second_harmonic", kC5, {{"level_db", "dB"}}, {Form::kHarmonic}},
          {"adc_saturation", kC3, {{"clipped_fraction", "1"}}},
          {"noise_floor", kC3, {{"delta_db", "dB"}}, {Form::kNoiseFloor}},
          {"radar_yaw_offset", kC4, {{"yaw_deg", "deg"}}, {Form::kOrdinary, Experiment::kReflector}},
          {"radar_position_offset",
           kC4,
           {{"forward_m", "m"}, {"left_m", "m"}},
           {Form::kRadarOffset, Experiment::kTurnAndMeasure}},
          {"scene_registration",
           kC4,
           {{"x_m", "m"}, {"y_m", "m"}, {"yaw_deg", "deg"}},
           {Form::kSceneOffset, Experiment::kTurnAndMeasure}},
          {"scene_scale", kC4, {{"scale", "1"}}, {Form::kOrdinary, Experiment::kTurnAndMeasure}},
          {"radar_pitch_offset", kC4, {{"pitch_deg", "deg"}}, {Form::kOrdinary, Experiment::kRaise}},
          {"pose_time_lag", kC4, {{"lag_s", "s"}}},
          {"channel_phase_error",
           kC4,
           {{"phase_deg", "deg", kNumbers}, {"gain_db", "dB", kNumbers}},
           {Form::kChannelErrors, Experiment::kReflector}},
          {"tx_imbalance", kC4, {{"phase_deg", "deg"}, {"gain_db", "dB"}}, {Form::kOrdinary, Experiment::kReflector}},
          {"tx_delay", kC4, {{"slot", "1"}, {"delay_m", "m"}}, {Form::kTransmitterDelay, Experiment::kReflector}},
          {"iq_conjugation", kC4, {}},
          {"channel_conjugation", kC4, {}},
          {"channel_permutation", kC4, {{"order", "1", kNumbers}}},
          {"element_pattern", kC3, {{"cos_exponent", "1", kNumber, 1}, {"gain_db", "dB", kNumbers, 1}}},
          {"elevation_pattern", kC3, {{"cos_exponent", "1"}}, {Form::kOrdinary, Experiment::kRaise}},
          {"material_reflectivity",
           kC2,
           {{"material", "", kText, 1}, {"actor", "", kText, 1}, {"delta_db", "dB"}},
           {Form::kMaterialLevel,
            Experiment::kSurface,
            Clutter::kNone,
            "",
            0,
            {{"delta_db", " dB", -kAny, bounds::kMostReflectivity_db, "", "no surface reflects so much more: "}}}},
          {"surface_roughness",
           kC2,
           {{"material", "", kText}, {"roughness_rms_m", "m"}},
           {Form::kOrdinary, Experiment::kSurface}},
          {"diffuse_scattering",
           kC5,
           {{"material", "", kText}, {"scattering_coefficient", "1"}},
           {Form::kOrdinary,
            Experiment::kSurface,
            Clutter::kUnlessSureOrStrong,
            "scattering_coefficient",
            bounds::kStrongScattering,
            {{"scattering_coefficient", "", bounds::kLeastScattering, bounds::kMostScattering,
              "no more than clutter is: S = ", "no surface scatters all that it reflects: S = "}}}},
          {"edge_diffraction", kC5, {{"level", "1"}}},
          {"floor_ceiling_multipath",
           kC5,
           {{"level", "1"}, {"max_elevation_deg", "deg", kNumber, 0, true}},
           {Form::kOrdinary, Experiment::kRaise}},
          {"trace_coverage", kC1, {{"max_bounces", "1"}}},
          {"corner_reflection", kC1, {{"actors", "", kTexts}}},
          {"wall_ghost",
           kC5,
           {{"walls", "", kTexts}},
           {Form::kOrdinary,
            Experiment::kAbsorber,
            Clutter::kNone,
            "",
            0,
            {{"gain_db", " dB", bounds::kLeastGhost_db, kAny, "no ghost has edges and nothing else: ", ""}}}},
          {"transmission",
           kC5,
           {{"actor", "", kText}, {"one_way_db", "dB"}},
           {Form::kOrdinary,
            Experiment::kAbsorber,
            Clutter::kUnlessSure,
            "",
            0,
            {{"one_way_db", " dB", -kAny, -bounds::kLeastLoss_db, "", "no panel lets all through: "}}}},
          {"actor_absent", kC3, {{"actor", "", kText}}, {Form::kActorAbsent}},
          {"actor_unmodelled",
           kC5,
           {{"x_m", "m"}, {"y_m", "m"}, {"size_m", "m"}},
           {Form::kUnmodelledObject,
            Experiment::kAbsorber,
            Clutter::kUnlessMapsGainOrLarge,
            "size_m",
            bounds::kFurniture_m,
            {}}},
          {"actor_moved",
           kC4,
           {{"actor", "", kText},
            {"dx_m", "m"},
            {"dy_m", "m"},
            {"dyaw_deg", "deg"},
            {"dz_m", "m", kNumber, 0, true},
            {"dpitch_deg", "deg", kNumber, 0, true},
            {"droll_deg", "deg", kNumber, 0, true}},
           {Form::kActorMoved}},
          {"moving_target", kC5, {{"x_m", "m"}, {"y_m", "m"}, {"speed_m_per_s", "m/s"}}},
          {"interference", kC5, {{"frame_fraction", "1"}}},
          {"phase_drift", kC3, {{"rad_per_frame", "rad"}}},
          {"packet_loss", kC3, {{"lost_fraction", "1"}}},
          {"packet_misalignment", kC5, {{"pose", "", kText}}},
          {"unknown", kC5, {}}};
}

std::vector<CauseDescription>& causes() {
  static std::vector<CauseDescription> all = builtInCauses();
  return all;
}

/// A mechanism that describes what no cause of the catalogue explains.
struct Nameless {
  std::string mechanism;
  MechanismTraits traits;
};
const std::vector<Nameless>& namelessMechanisms() {
  static const std::vector<Nameless> all = {
      {"empirical_law", {Form::kLaw}},
      {"empirical_echo", {Form::kLateEcho, Experiment::kAbsorber, Clutter::kUnlessMapsGain}},
      {"empirical_clutter", {Form::kSurfaceClutter}},
      {"echo_replica",
       {Form::kReplica, Experiment::kAbsorber, Clutter::kUnlessMapsGainOrLoud, "level_db", bounds::kLoudReplica_db}}};
  return all;
}

}  // namespace

const std::vector<CauseDescription>& causeDescriptions() { return causes(); }

void addCause(CauseDescription cause) {
  if (isCatalogued(cause.name)) {
    throw InputError("cause '" + cause.name + "' is in the catalogue already; give the plug-in's another name");
  }
  causes().insert(causes().end() - 1, std::move(cause));  // `unknown` stays last
}

const MechanismTraits& traitsOf(const std::string& mechanism) {
  for (const CauseDescription& cause : causes()) {
    if (cause.name == mechanism) return cause.traits;
  }
  for (const Nameless& nameless : namelessMechanisms()) {
    if (nameless.mechanism == mechanism) return nameless.traits;
  }
  static const MechanismTraits ordinary;
  return ordinary;
}

const std::string& mechanismOfForm(MechanismForm form) {
  static const std::string none;
  if (form == MechanismForm::kOrdinary) return none;
  for (const CauseDescription& cause : causes()) {
    if (cause.traits.form == form) return cause.name;
  }
  for (const Nameless& nameless : namelessMechanisms()) {
    if (nameless.traits.form == form) return nameless.mechanism;
  }
  return none;
}

bool isCatalogued(const std::string& cause) {
  const auto& all = causeDescriptions();
  return std::any_of(all.begin(), all.end(), [&](const CauseDescription& c) { return c.name == cause; });
}

const CauseDescription& causeDescription(const std::string& cause) {
  std::string known;
  for (const CauseDescription& c : causeDescriptions()) {
    if (c.name == cause) return c;
    known += (known.empty() ? "" : ", ") + c.name;
  }
  throw InputError("cause '" + cause + "' is unknown; allowed: " + known);
}

}  // namespace mmradartwin
