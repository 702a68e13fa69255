#include "mmradartwin_dsp/radar_config.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int kLanes = 4;
/// Share of the pitch by which an element may lie off the uniform line: 1 % of half a wavelength is 1.8 deg of phase.
constexpr double kPitchTolerance = 0.01;

/// More slots are not searched for those on a line: there would be too many sets.
constexpr int kMostSlotsSearched = 12;

/// Elements of some slots by their y, and the first of them that is off the uniform line; -1 where all are on it.
struct LineFit {
  VirtualLine line;
  int off = -1;
};

LineFit fitLine(const RadarConfig& radar, const std::vector<int>& slots) {
  LineFit fit;
  std::vector<int>& channels = fit.line.channels;
  for (const int slot : slots) {
    for (int rx = 0; rx < radar.receivers(); ++rx) channels.push_back(slot * radar.receivers() + rx);
  }
  std::stable_sort(channels.begin(), channels.end(),
                   [&radar](int a, int b) { return radar.virtual_element_m(a).y() < radar.virtual_element_m(b).y(); });
  const Eigen::Vector3d origin = radar.virtual_element_m(channels.front());
  const double length_m = (radar.virtual_element_m(channels.back()) - origin).y();
  fit.line.places.resize(channels.size());
  std::iota(fit.line.places.begin(), fit.line.places.end(), 0);
  const double pitch_m = fit.line.pitch_m = length_m / static_cast<double>(channels.size() - 1);
  for (std::size_t i = 1; i < channels.size(); ++i) {
    const Eigen::Vector3d off =
        radar.virtual_element_m(channels[i]) - origin - Eigen::Vector3d(0, static_cast<double>(i) * pitch_m, 0);
    if (pitch_m > 0 && off.norm() <= kPitchTolerance * pitch_m) continue;
    fit.off = channels[i];
    break;
  }
  return fit;
}

std::vector<int> allSlots(const RadarConfig& radar) {
  std::vector<int> slots(static_cast<std::size_t>(radar.slots()));
  std::iota(slots.begin(), slots.end(), 0);
  return slots;
}

std::string listOf(const std::vector<int>& values) {
  std::string text;
  for (const int value : values) text += (text.empty() ? "" : ", ") + std::to_string(value);
  return "[" + text + "]";
}

/// What is wrong with a slot that is not on the line of the others.
std::string describeOffLine(const RadarConfig& radar, int slot, const std::vector<int>& line) {
  const Eigen::Vector3d& at = radar.tx_position_m[static_cast<std::size_t>(slot)];
  const Eigen::Vector3d off = at - radar.tx_position_m[static_cast<std::size_t>(line.front())];
  std::ostringstream text;
  text << "slot " << slot << " at y = " << at.y() << " m ";
  const double least_m = kPitchTolerance * fitLine(radar, line).line.pitch_m;
  if (std::abs(off.z()) > least_m) {
    text << "lies " << std::abs(off.z()) << " m " << (off.z() > 0 ? "above" : "below") << " the line of slots ";
  } else if (std::abs(off.x()) > least_m) {
    text << "lies " << std::abs(off.x()) << " m " << (off.x() > 0 ? "before" : "behind") << " the line of slots ";
  } else {
    text << "does not continue the line of slots ";
  }
  text << listOf(line);
  return text.str();
}

/// The line of a radar of which receivers were left out: the whole one without their elements.
VirtualLine lineOfWhole(const RadarConfig& radar) {
  RadarConfig whole = radar;
  whole.rx_position_m = radar.whole_line_rx_m;
  whole.whole_line_rx_m.clear();
  const VirtualLine all = whole.virtualLine();
  VirtualLine line;
  line.pitch_m = all.pitch_m;
  for (std::size_t i = 0; i < all.channels.size(); ++i) {
    const Eigen::Vector3d& rx = whole.rx_position_m[static_cast<std::size_t>(all.channels[i] % whole.receivers())];
    const auto kept = std::find(radar.rx_position_m.begin(), radar.rx_position_m.end(), rx);
    if (kept == radar.rx_position_m.end()) continue;
    line.channels.push_back(all.channels[i] / whole.receivers() * radar.receivers() +
                            static_cast<int>(kept - radar.rx_position_m.begin()));
    line.places.push_back(all.places[i]);
  }
  return line;
}

void writePositions(std::ostream& out, const std::string& key, const std::vector<Eigen::Vector3d>& positions) {
  out << key << ": [";
  for (std::size_t i = 0; i < positions.size(); ++i) {
    out << (i ? ", " : "") << "[" << yamlNumber(positions[i].x()) << ", " << yamlNumber(positions[i].y()) << ", "
        << yamlNumber(positions[i].z()) << "]";
  }
  out << "]\n";
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

double RadarConfig::frame_mb() const { return static_cast<double>(bytes_per_frame()) / (1 << 20); }

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

VirtualLine RadarConfig::virtualLine() const {
  if (!whole_line_rx_m.empty()) return lineOfWhole(*this);
  const std::vector<int> slots = angle_slots.empty() ? allSlots(*this) : angle_slots;
  if (static_cast<int>(slots.size()) * receivers() < 2) {
    throw InputError("tx_position_m, rx_position_m: the virtual array has " +
                     std::to_string(static_cast<int>(slots.size()) * receivers()) +
                     " element(s); the angle transform needs a uniform line of at least two along y");
  }
  const LineFit fit = fitLine(*this, slots);
  if (fit.off < 0) return fit.line;
  std::ostringstream message;
  const std::vector<int> line = slotsOnALine();
  if (angle_slots.empty() && !line.empty()) {
    message << "tx_position_m: ";
    for (const int slot : slots) {
      if (std::find(line.begin(), line.end(), slot) == line.end())
        message << describeOffLine(*this, slot, line) << ", ";
    }
    message
        << "so the virtual array is no uniform line along y, which the angle transform needs; correct the positions, "
           "or leave what is off the line out of the transform by angle_slots: "
        << listOf(line);
  } else {
    const Eigen::Vector3d at = virtual_element_m(fit.off);
    message
        << (angle_slots.empty() ? "" : "angle_slots, ")
        << "tx_position_m, rx_position_m: the virtual array (tx + rx, element " << fit.off << " = slot "
        << fit.off / receivers() << ", rx " << fit.off % receivers() << " at y = " << at.y() << " m, z = " << at.z()
        << " m) is no uniform line along y, which the angle transform needs; correct the positions (in any order of "
           "slots and receivers)";
  }
  throw InputError(message.str());
}

std::vector<int> RadarConfig::slotsOnALine() const {
  if (slots() > kMostSlotsSearched) return {};
  std::vector<int> best;
  for (unsigned set = 1; set < 1u << slots(); ++set) {
    std::vector<int> chosen;
    for (int slot = 0; slot < slots(); ++slot) {
      if (set >> slot & 1u) chosen.push_back(slot);
    }
    if (chosen.size() <= best.size() || static_cast<int>(chosen.size()) * receivers() < 2) continue;
    if (fitLine(*this, chosen).off < 0) best = chosen;
  }
  return best;
}

std::string toYaml(const RadarConfig& radar) {
  std::ostringstream out;
  out << "device: " << yamlText(radar.device) << "\n";
  out << "carrier_hz: " << yamlNumber(radar.carrier_hz) << "\n";
  out << "slope_hz_per_s: " << yamlNumber(radar.slope_hz_per_s) << "\n";
  const int halved = radar.real_samples ? 2 : 1;
  out << "samples_per_chirp: " << halved * radar.samples_per_chirp << "\n";
  out << "sample_rate_hz: " << yamlNumber(halved * radar.sample_rate_hz) << "\n";
  out << "adc_start_s: " << yamlNumber(radar.adc_start_s) << "\n";
  out << "loops_per_frame: " << radar.loops_per_frame << "\n";
  out << "frame_period_s: " << yamlNumber(radar.frame_period_s) << "\n";
  writePositions(out, "tx_position_m", radar.tx_position_m);
  writePositions(out, "rx_position_m", radar.rx_position_m);
  out << "layout: " << (radar.layout == CaptureLayout::kTwoLane ? "2lane" : "4lane") << "\n";
  out << "iq_order: " << (radar.iq_order == IqOrder::kQi ? "qi" : "iq") << "\n";
  if (radar.real_samples) out << "samples: real\n";
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
      out << (slot ? ", " : "") << listOf(radar.tx_enable[slot]);
    }
    out << "]\n";
  }
  if (!radar.rx_enable.empty()) out << "rx_enable: " << listOf(radar.rx_enable) << "\n";
  if (radar.max_frame_mb != kMaxFrame_mb) out << "max_frame_mb: " << yamlNumber(radar.max_frame_mb) << "\n";
  if (!radar.angle_slots.empty()) out << "angle_slots: " << listOf(radar.angle_slots) << "\n";
  return out.str();
}

}  // namespace mmradartwin
