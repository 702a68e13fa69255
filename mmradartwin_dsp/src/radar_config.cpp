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

std::vector<Eigen::Vector3d> positions(YamlMap& yaml, const std::string& key) {
  std::vector<Eigen::Vector3d> positions;
  for (const std::vector<double>& row : yaml.rows(key, 3, -10, 10)) positions.emplace_back(row[0], row[1], row[2]);
  if (positions.empty()) yaml.fail(key, "is empty; give at least one position [x, y, z] in metres");
  return positions;
}

RadarConfig read(YamlMap yaml) {
  RadarConfig radar;
  radar.device = yaml.text("device");
  radar.carrier_hz = yaml.number("carrier_hz", 1e9, 1e12);
  radar.slope_hz_per_s = yaml.number("slope_hz_per_s", 1e9, 1e16);
  radar.samples_per_chirp = static_cast<int>(yaml.integer("samples_per_chirp", 2, 16384));
  radar.sample_rate_hz = yaml.number("sample_rate_hz", 1e4, 1e9);
  radar.adc_start_s = yaml.number("adc_start_s", 0, 1e-2);
  radar.loops_per_frame = static_cast<int>(yaml.integer("loops_per_frame", 1, 32768));
  radar.frame_period_s = yaml.number("frame_period_s", 1e-5, 1000);
  radar.tx_position_m = positions(yaml, "tx_position_m");
  radar.rx_position_m = positions(yaml, "rx_position_m");
  radar.layout = captureLayoutOf(radar.device).value_or(CaptureLayout::kFourLane);
  if (yaml.has("layout")) {
    radar.layout =
        yaml.choice("layout", {"4lane", "2lane"}) == "2lane" ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  }
  if (yaml.has("iq_order")) {
    radar.iq_order = yaml.choice("iq_order", {"iq", "qi"}) == "qi" ? IqOrder::kQi : IqOrder::kIq;
  }
  if (yaml.has("idle_s")) radar.idle_s = yaml.number("idle_s", 0, 1);
  if (yaml.has("ramp_end_s")) radar.ramp_end_s = yaml.number("ramp_end_s", 1e-7, 1);
  if (yaml.has("rx_gain_db")) radar.rx_gain_db = yaml.number("rx_gain_db", 0, 120);
  if (yaml.has("tx_backoff_db")) radar.tx_backoff_db = yaml.number("tx_backoff_db", 0, 60);
  if (yaml.has("if_highpass_hz")) {
    radar.if_highpass_hz = yaml.numbers("if_highpass_hz", 1, 1e9);
    if (radar.if_highpass_hz.size() != 2) yaml.fail("if_highpass_hz", "needs two corners, [Hz, Hz]");
  }
  if (yaml.has("tx_enable")) {
    for (const std::vector<long long>& slot : yaml.integerLists("tx_enable", 0, 31)) {
      if (slot.empty()) yaml.fail("tx_enable", "has a slot without a transmitter");
      radar.tx_enable.emplace_back(slot.begin(), slot.end());
    }
    if (static_cast<int>(radar.tx_enable.size()) != radar.slots()) {
      yaml.fail("tx_enable", "has " + std::to_string(radar.tx_enable.size()) + " slots; tx_position_m has " +
                                 std::to_string(radar.slots()) + ": give one list per slot");
    }
  }
  if (yaml.has("rx_enable")) {
    for (const long long rx : yaml.integers("rx_enable", 0, 31)) radar.rx_enable.push_back(static_cast<int>(rx));
    if (static_cast<int>(radar.rx_enable.size()) != radar.receivers()) {
      yaml.fail("rx_enable", "names " + std::to_string(radar.rx_enable.size()) + " receivers; rx_position_m has " +
                                 std::to_string(radar.receivers()) + ": give one number per receiver");
    }
  }
  yaml.rejectUnknownKeys();

  if (radar.layout == CaptureLayout::kTwoLane && radar.samples_per_chirp % 2 != 0) {
    yaml.fail("samples_per_chirp", "'" + std::to_string(radar.samples_per_chirp) +
                                       "' is odd; layout 2lane stores samples in pairs, so it must be even");
  }
  const double adc_end_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  // Values are typed by hand: a nanosecond more or less is rounding.
  if (radar.ramp_end_s < adc_end_s - 1e-9) {
    yaml.fail("ramp_end_s", yamlNumber(radar.ramp_end_s) + " ends before the last sample; it must be at least " +
                                yamlNumber(adc_end_s) + " (adc_start_s + samples_per_chirp/sample_rate_hz)");
  }
  const double busy_s =
      radar.chirps_per_frame() * (std::isnan(radar.chirp_period_s()) ? adc_end_s : radar.chirp_period_s());
  if (busy_s > radar.frame_period_s + 1e-9) {
    yaml.fail("frame_period_s", yamlNumber(radar.frame_period_s) + " is shorter than the frame's " +
                                    std::to_string(radar.chirps_per_frame()) + " chirps; it must be at least " +
                                    yamlNumber(busy_s));
  }
  return radar;
}

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

RadarConfig loadRadarConfig(const std::string& file) { return read(YamlMap::load(file)); }

RadarConfig parseRadarConfig(const std::string& yaml_text, const std::string& name) {
  return read(YamlMap::parse(yaml_text, name));
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
