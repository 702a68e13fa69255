#include "mmradartwin_dsp/radar_config.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kLanes = 4;
/// Share of the pitch by which an element may lie off the uniform line: 1 % of half a wavelength is 1.8 deg of phase.
constexpr double kPitchTolerance = 0.01;

void writePositions(std::ostream& out, const std::string& key, const std::vector<Eigen::Vector3d>& positions) {
  out << key << ": [";
  for (std::size_t i = 0; i < positions.size(); ++i) {
    out << (i ? ", " : "") << "[" << yamlNumber(positions[i].x()) << ", " << yamlNumber(positions[i].y()) << ", "
        << yamlNumber(positions[i].z()) << "]";
  }
  out << "]\n";
}

void writeIntegers(std::ostream& out, const std::vector<int>& values) {
  out << "[";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i ? ", " : "") << values[i];
  out << "]";
}

}  // namespace

std::optional<CaptureLayout> captureLayoutOf(const std::string& device) {
  const std::size_t digit = device.find_first_of("0123456789");
  const std::string family = digit == std::string::npos ? "" : device.substr(digit, 2);
  for (const char* four : {"12", "14", "22"}) {
    if (family == four) return CaptureLayout::kFourLane;
  }
  for (const char* two : {"16", "18", "64", "68"}) {
    if (family == two) return CaptureLayout::kTwoLane;
  }
  return std::nullopt;
}

RadarConfig::RadarConfig() : idle_s(kNaN), ramp_end_s(kNaN), rx_gain_db(kNaN), tx_backoff_db(kNaN) {}

Eigen::Vector3d RadarConfig::virtual_element_m(int k) const {
  const std::size_t slot = static_cast<std::size_t>(k / receivers());
  const std::size_t rx = static_cast<std::size_t>(k % receivers());
  return tx_position_m[slot] + rx_position_m[rx];
}

int RadarConfig::capture_receivers() const {
  return layout == CaptureLayout::kFourLane ? std::max(kLanes, receivers()) : receivers();
}

std::size_t RadarConfig::bytes_per_chirp() const {
  return static_cast<std::size_t>(samples_per_chirp) * static_cast<std::size_t>(capture_receivers()) * 4;
}

std::size_t RadarConfig::bytes_per_frame() const {
  return static_cast<std::size_t>(chirps_per_frame()) * bytes_per_chirp();
}

std::int64_t RadarConfig::frame_offset_ns(std::int64_t i) const {
  return std::llround(static_cast<long double>(i) * static_cast<long double>(frame_period_s) * 1e9L);
}

double RadarConfig::bandwidth_hz() const { return slope_hz_per_s * samples_per_chirp / sample_rate_hz; }
double RadarConfig::range_bin_m() const { return kSpeedOfLight_m_per_s / (2 * bandwidth_hz()); }
double RadarConfig::max_range_m() const { return samples_per_chirp * range_bin_m(); }
double RadarConfig::sample_time_s(int n) const { return adc_start_s + n / sample_rate_hz; }
double RadarConfig::chirp_period_s() const { return idle_s + ramp_end_s; }

double RadarConfig::window_center_s() const { return adc_start_s + samples_per_chirp / (2 * sample_rate_hz); }
double RadarConfig::center_frequency_hz() const { return carrier_hz + slope_hz_per_s * window_center_s(); }
double RadarConfig::wavelength_m() const { return kSpeedOfLight_m_per_s / center_frequency_hz(); }

double RadarConfig::virtual_pitch_m() const {
  const int last = channels() - 1;
  if (last < 1) {
    throw InputError("tx_position_m, rx_position_m: the virtual array has " + std::to_string(channels()) +
                     " element(s); the angle transform needs a uniform line of at least two along y");
  }
  const Eigen::Vector3d origin = virtual_element_m(0);
  const double pitch = (virtual_element_m(last) - origin).y() / last;
  for (int k = 1; k <= last; ++k) {
    const Eigen::Vector3d off = virtual_element_m(k) - origin - Eigen::Vector3d(0, k * pitch, 0);
    if (!(pitch > 0) || off.norm() > kPitchTolerance * pitch) {
      const Eigen::Vector3d at = virtual_element_m(k);
      std::ostringstream message;
      message << "tx_position_m, rx_position_m: the virtual array (tx + rx, element " << k << " = slot "
              << k / receivers() << ", rx " << k % receivers() << " at y = " << at.y()
              << " m) is no uniform line along y in ascending order; the angle transform needs one, so list slots and "
                 "receivers from right (-y) to left (+y) with equal spacing";
      throw InputError(message.str());
    }
  }
  return pitch;
}

std::string toYaml(const RadarConfig& radar) {
  std::ostringstream out;
  out << "device: " << yamlText(radar.device) << "\n";
  out << "carrier_hz: " << yamlNumber(radar.carrier_hz) << "\n";
  out << "slope_hz_per_s: " << yamlNumber(radar.slope_hz_per_s) << "\n";
  out << "samples_per_chirp: " << radar.samples_per_chirp << "\n";
  out << "sample_rate_hz: " << yamlNumber(radar.sample_rate_hz) << "\n";
  out << "adc_start_s: " << yamlNumber(radar.adc_start_s) << "\n";
  out << "loops_per_frame: " << radar.loops_per_frame << "\n";
  out << "frame_period_s: " << yamlNumber(radar.frame_period_s) << "\n";
  writePositions(out, "tx_position_m", radar.tx_position_m);
  writePositions(out, "rx_position_m", radar.rx_position_m);
  out << "layout: " << (radar.layout == CaptureLayout::kTwoLane ? "2lane" : "4lane") << "\n";
  out << "iq_order: " << (radar.iq_order == IqOrder::kQi ? "qi" : "iq") << "\n";
  const auto optional = [&out](const char* key, double value) {
    if (!std::isnan(value)) out << key << ": " << yamlNumber(value) << "\n";
  };
  optional("idle_s", radar.idle_s);
  optional("ramp_end_s", radar.ramp_end_s);
  optional("rx_gain_db", radar.rx_gain_db);
  optional("tx_backoff_db", radar.tx_backoff_db);
  if (radar.if_highpass_hz.size() == 2) {
    out << "if_highpass_hz: [" << yamlNumber(radar.if_highpass_hz[0]) << ", " << yamlNumber(radar.if_highpass_hz[1])
        << "]\n";
  }
  if (!radar.tx_enable.empty()) {
    out << "tx_enable: [";
    for (std::size_t slot = 0; slot < radar.tx_enable.size(); ++slot) {
      out << (slot ? ", " : "");
      writeIntegers(out, radar.tx_enable[slot]);
    }
    out << "]\n";
  }
  if (!radar.rx_enable.empty()) {
    out << "rx_enable: ";
    writeIntegers(out, radar.rx_enable);
    out << "\n";
  }
  return out.str();
}

}  // namespace mmradartwin
