#include <algorithm>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

const std::vector<CauseDescription>& causeDescriptions() {
  constexpr ResidualClass kC1 = ResidualClass::kMissingSupport, kC2 = ResidualClass::kWeakSupport,
                          kC3 = ResidualClass::kUnsupportedAnchor, kC4 = ResidualClass::kShiftedResponse,
                          kC5 = ResidualClass::kMissingMechanism;
  constexpr ParameterKind kNumber = ParameterKind::kNumber, kText = ParameterKind::kText,
                          kNumbers = ParameterKind::kNumbers, kTexts = ParameterKind::kTexts;
  static const std::vector<CauseDescription> causes = {
      {"tx_rx_leakage", kC3, {{"range_m", "m"}, {"level_db", "dB"}}},
      {"range_bias", kC4, {{"range_m", "m"}}},
      {"range_scale", kC4, {{"scale", "1"}}},
      {"carrier_scale", kC4, {{"scale", "1"}}},
      {"if_highpass", kC3, {{"corner_hz", "Hz"}}},
      {"if_lowpass", kC3, {{"corner_hz", "Hz"}}},
      {"excess_attenuation", kC3, {{"db_per_m", "dB/m"}}},
      {"gain_drift", kC3, {{"db_per_hour", "dB/h", kNumber, 1}, {"steps_db", "dB", kNumbers, 1}}},
      {"iq_imbalance", kC5, {{"image_db", "dB"}}},
      {"dc_offset", kC3, {{"level_db", "dB"}}},
      {"second_harmonic", kC5, {{"level_db", "dB"}}},
      {"adc_saturation", kC3, {{"clipped_fraction", "1"}}},
      {"noise_floor", kC3, {{"delta_db", "dB"}}},
      {"radar_yaw_offset", kC4, {{"yaw_deg", "deg"}}},
      {"radar_position_offset", kC4, {{"forward_m", "m"}, {"left_m", "m"}}},
      {"scene_registration", kC4, {{"x_m", "m"}, {"y_m", "m"}, {"yaw_deg", "deg"}}},
      {"radar_pitch_offset", kC4, {{"pitch_deg", "deg"}}},
      {"pose_time_lag", kC4, {{"lag_s", "s"}}},
      {"channel_phase_error", kC4, {{"phase_deg", "deg", kNumbers}, {"gain_db", "dB", kNumbers}}},
      {"tx_imbalance", kC4, {{"phase_deg", "deg"}, {"gain_db", "dB"}}},
      {"iq_conjugation", kC4, {}},
      {"channel_conjugation", kC4, {}},
      {"channel_permutation", kC4, {{"order", "1", kNumbers}}},
      {"element_pattern", kC3, {{"cos_exponent", "1", kNumber, 1}, {"gain_db", "dB", kNumbers, 1}}},
      {"elevation_pattern", kC3, {{"cos_exponent", "1"}}},
      {"material_reflectivity", kC2, {{"material", "", kText, 1}, {"actor", "", kText, 1}, {"delta_db", "dB"}}},
      {"surface_roughness", kC2, {{"material", "", kText}, {"roughness_rms_m", "m"}}},
      {"diffuse_scattering", kC5, {{"material", "", kText}, {"scattering_coefficient", "1"}}},
      {"edge_diffraction", kC5, {{"level", "1"}}},
      {"floor_ceiling_multipath", kC5, {{"level", "1"}}},
      {"corner_reflection", kC1, {{"actors", "", kTexts}}},
      {"wall_ghost", kC5, {{"walls", "", kTexts}}},
      {"transmission", kC5, {{"actor", "", kText}, {"one_way_db", "dB"}}},
      {"actor_absent", kC3, {{"actor", "", kText}}},
      {"actor_unmodelled", kC5, {{"x_m", "m"}, {"y_m", "m"}, {"size_m", "m"}}},
      {"actor_moved", kC4, {{"actor", "", kText}, {"dx_m", "m"}, {"dy_m", "m"}, {"dyaw_deg", "deg"}}},
      {"moving_target", kC5, {{"x_m", "m"}, {"y_m", "m"}, {"speed_m_per_s", "m/s"}}},
      {"interference", kC5, {{"frame_fraction", "1"}}},
      {"phase_drift", kC3, {{"rad_per_frame", "rad"}}},
      {"packet_loss", kC3, {{"lost_fraction", "1"}}},
      {"packet_misalignment", kC5, {{"pose", "", kText}}},
      {"unknown", kC5, {}}};
  return causes;
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
