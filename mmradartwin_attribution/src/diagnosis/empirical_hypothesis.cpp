#include "empirical_hypothesis.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <set>
#include <sstream>

#include "echo_source.h"

namespace mmradartwin {
namespace {

struct Law {
  const char* parameter;
  const char* unit;
  double typical, limit;
};
constexpr Law kLaws[] = {{"gain_db", "dB", 2.0, 200}, {"delay_m", "m", 0.02, 10}, {"angle_deg", "deg", 1.0, 90}};

std::vector<double> nodes(const std::string& variable, const ChannelData& data) {
  if (variable == "range_m") return {1, 2, 3, 4, 5.5, 7.5};
  if (variable == "azimuth_deg") return {-60, -40, -20, 0, 20, 40, 60};
  if (variable == "incidence_deg") return {0, 15, 30, 45, 60, 75};
  if (variable == "heading_deg") return {-180, -120, -60, 0, 60, 120, 180};
  double low = 1e9, high = -1e9;  // height_m
  for (const PoseChannels& p : data.poses) {
    low = std::min(low, p.pose.T_map_radar.translation().z());
    high = std::max(high, p.pose.T_map_radar.translation().z());
  }
  if (high - low < 0.1) return {};
  return {low, 0.5 * (low + high), high};
}

}  // namespace

std::vector<Hypothesis> empiricalHypotheses(const ChannelData& data, const std::vector<NamedParameters>& present) {
  std::vector<Hypothesis> result;
  for (const NamedParameters& m : present) {
    if (m.mechanism == "empirical_law") return result;  // twin.yaml knows it once
  }
  for (const char* variable : {"range_m", "azimuth_deg", "incidence_deg", "height_m", "heading_deg"}) {
    const std::vector<double> at = nodes(variable, data);
    if (at.empty()) continue;
    for (const Law& law : kLaws) {
      Hypothesis h;
      h.mechanism = defaultMechanism("empirical_law");
      h.mechanism.values.set("variable", std::string(variable));
      h.mechanism.values.set("at", at);
      h.mechanism.values.set(law.parameter, std::vector<double>(at.size(), 0.0));
      h.subject = std::string(law.parameter) + " over " + variable;
      const bool gauge = std::string(law.parameter) == "gain_db";  // the session's gain is free already
      for (std::size_t i = gauge ? 1 : 0; i < at.size(); ++i) {
        h.coordinates.push_back({law.parameter, law.unit, static_cast<int>(i), 0, law.typical, -law.limit, law.limit});
      }
      result.push_back(std::move(h));
    }
  }
  return result;
}

std::string describeLaw(const Hypothesis& hypothesis, const NamedParameters& fitted) {
  std::ostringstream out;
  out << std::setprecision(3);
  if (fitted.mechanism != "empirical_law") {
    out << "the mechanism " << fitted.mechanism;
    for (const Coordinate& c : hypothesis.coordinates) {
      if (c.element < 0) out << ", " << c.parameter << " = " << fitted.values.number(c.parameter);
    }
    return out.str();
  }
  const std::string variable = fitted.values.text("variable");
  const std::vector<double>& at = fitted.values.numbers("at");
  for (const Law& law : kLaws) {
    const std::vector<double>& values = fitted.values.numbers(law.parameter);
    if (values.empty()) continue;
    out << law.parameter << " of the echoes over " << variable << ":";
    for (std::size_t i = 0; i < values.size(); ++i) out << (i ? ", " : " ") << values[i] << " at " << at[i];
  }
  return out.str();
}

std::string experimentFor(const std::vector<CauseProbability>& candidates) {
  std::set<std::string> names;
  for (const CauseProbability& c : candidates) names.insert(c.cause);
  const auto any = [&](std::initializer_list<const char*> of) {
    return std::any_of(of.begin(), of.end(), [&](const char* n) { return names.count(n) > 0; });
  };
  if (any({"radar_yaw_offset", "tx_imbalance", "channel_phase_error", "carrier_scale"})) {
    return "put a corner reflector at a surveyed place, at several azimuths and ranges; use each transmitter alone";
  }
  if (any({"if_highpass", "if_lowpass", "excess_attenuation"})) {
    return "record the same places with another high-pass code, and a corner reflector from 0.5 m to the far wall";
  }
  if (any({"radar_position_offset", "scene_registration", "range_bias", "range_scale"})) {
    return "turn the radar by 90 and 180 degrees at one place, and measure a distance with a laser";
  }
  if (any({"radar_pitch_offset", "elevation_pattern", "floor_ceiling_multipath", "gain_drift"})) {
    return "raise the radar by 0.3 m at five places and record them again";
  }
  if (any({"material_reflectivity", "surface_roughness", "diffuse_scattering"})) {
    return "record the surface from oblique places, and with an absorber in front of it";
  }
  return "cover the object in question with an absorber, and record from places around it";
}

}  // namespace mmradartwin
