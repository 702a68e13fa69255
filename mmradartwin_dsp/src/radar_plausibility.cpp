#include "radar_plausibility.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <optional>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A unit that is easily taken for SI's.
struct Unit {
  std::string name;
  double factor;  ///< to SI
};

/// A number of radar.yaml, with what any radar has.
struct Quantity {
  std::string key;
  double RadarConfig::*member;
  double min, max;
  double typical;  ///< in the middle of what radars have: ranks units that are all possible
  std::vector<Unit> units;
};

const std::vector<Quantity>& quantities() {
  static const std::vector<Unit> kFrequencies = {{"kHz", 1e3}, {"MHz", 1e6}, {"GHz", 1e9}};
  static const std::vector<Unit> kRates = {{"ksps (kHz)", 1e3}, {"Msps (MHz)", 1e6}};
  static const std::vector<Unit> kTimes = {{"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
  static const std::vector<Unit> kSlopes = {
      {"kHz/s", 1e3}, {"MHz/s", 1e6}, {"GHz/s or kHz/us", 1e9}, {"MHz/us", 1e12}, {"GHz/us", 1e15}};
  static const std::vector<Quantity> kAll = {
      {"carrier_hz", &RadarConfig::carrier_hz, 1e9, 1e12, 70e9, kFrequencies},
      {"slope_hz_per_s", &RadarConfig::slope_hz_per_s, 1e9, 1e16, 40e12, kSlopes},
      {"sample_rate_hz", &RadarConfig::sample_rate_hz, 1e4, 1e9, 5e6, kRates},
      {"adc_start_s", &RadarConfig::adc_start_s, 0, 1e-2, 6e-6, kTimes},
      {"idle_s", &RadarConfig::idle_s, 0, 1, 30e-6, kTimes},
      {"ramp_end_s", &RadarConfig::ramp_end_s, 1e-7, 1, 50e-6, kTimes},
      {"frame_period_s", &RadarConfig::frame_period_s, 1e-5, 1000, 0.05, kTimes}};
  return kAll;
}

/// A list of positions of radar.yaml.
struct Antennas {
  const char* key;
  std::vector<Eigen::Vector3d> RadarConfig::*member;
};
const Antennas kReceivers{"rx_position_m", &RadarConfig::rx_position_m};
const Antennas kTransmitters{"tx_position_m", &RadarConfig::tx_position_m};

std::string said(double value) { return significantNumber(value, 4); }
/// A value in SI for radar.yaml, without the rounding of its conversion. std::stod() would throw where it is tiny.
std::string written(double value) { return yamlNumber(std::strtod(significantNumber(value, 12).c_str(), nullptr)); }

/// A range by its text; an end that is not there is left out.
struct Bounds {
  double least = 0, most = kInfinity;
  bool holds(double value) const { return value >= least && value <= most; }
  std::string text(const std::string& unit) const {
    const std::string behind = unit.empty() ? "" : " " + unit;
    if (std::isinf(most)) return "at least " + said(least) + behind;
    if (least <= 0) return "at most " + said(most) + behind;
    return said(least) + " to " + said(most) + behind;
  }
};

/// Something that the numbers of a radar have to do with each other, and do not.
struct Broken {
  std::string key;  ///< that is to blame where no other unit of any key mends it
  std::string why;
};

// What one radar has of derived quantities. The ends are those of what is built (24 GHz with slow ramps to 300 GHz,
// sensors of a metre to those of cars), each with a margin: a wrong unit is wrong by a factor of some hundreds.
constexpr double kMostSweepOfCarrier = 0.5;                    ///< share of the carrier that a ramp sweeps
constexpr Bounds kRangeBin_m{1e-3, 15};                        ///< from 150 GHz to 10 MHz of bandwidth
constexpr Bounds kFarthest_m{0.1, 2e4};                        ///< range of the last bin
constexpr double kMostStartOfWindow = 20;                      ///< adc_start over the time of all samples
constexpr double kMostRampOfWindow = 50;                       ///< ramp_end over the time of the last sample
constexpr double kMostIdleOfRamp = 100, kMostIdle_s = 6e-3;    ///< the larger one counts; TI's counters end at 5.24 ms
constexpr double kMostFrame_s = 10, kMostFrameOfChirps = 1e5;  ///< the smaller one counts
constexpr Bounds kHighPassOfRate{1e-4, 2};                     ///< corner over the sample rate
constexpr Bounds kNeighbour_wl{0.15, 100};                     ///< distance to the nearest other antenna
constexpr Bounds kNearestReceivers_wl{0.15, 20};               ///< the least of those distances among receivers
constexpr Bounds kFarthestPosition_m{0, 10};                   ///< along each axis
constexpr double kMostApart_wl = 1000;                         ///< from any transmitter to any receiver
constexpr double kSamePlace_wl = 1e-9;                         ///< antennas nearer than this are at one place
// TI's mmWave devices (captureLayoutOf() knows them) have less: 2 to 45 Msps, frames of up to 1.342 s of their own
// clock.
constexpr Bounds kTiSampleRate_hz{0.5e6, 1e8};
constexpr double kTiMostFrame_s = 4;
constexpr double kRounding_s = 1e-9;  ///< values are typed by hand: a nanosecond more or less is rounding

double samplesEnd_s(const RadarConfig& radar) {
  return radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
}

double busy_s(const RadarConfig& radar) {
  return radar.chirps_per_frame() * (std::isnan(radar.chirp_period_s()) ? samplesEnd_s(radar) : radar.chirp_period_s());
}

double wavelength_m(const RadarConfig& radar) { return kSpeedOfLight_m_per_s / radar.carrier_hz; }

/// Distance from each antenna to the nearest other one at another place, in wavelengths; empty for a single place.
std::vector<double> nearest_wl(const std::vector<Eigen::Vector3d>& antennas, double wavelength_m) {
  std::vector<double> all;
  for (const Eigen::Vector3d& a : antennas) {
    double nearest = kInfinity;
    for (const Eigen::Vector3d& b : antennas) {
      const double apart = (a - b).norm() / wavelength_m;
      if (apart > kSamePlace_wl) nearest = std::min(nearest, apart);
    }
    if (!std::isinf(nearest)) all.push_back(nearest);
  }
  return all;
}

void checkSweep(const RadarConfig& radar, std::vector<Broken>& broken) {
  const double swept_hz = radar.slope_hz_per_s * samplesEnd_s(radar);
  if (swept_hz > kMostSweepOfCarrier * radar.carrier_hz) {
    broken.push_back({"slope_hz_per_s", "the ramp sweeps " + said(swept_hz / 1e9) +
                                            " GHz until the last sample, of a " + "carrier of " +
                                            said(radar.carrier_hz / 1e9) + " GHz (allowed: at most " +
                                            said(kMostSweepOfCarrier * radar.carrier_hz / 1e9) + " GHz)"});
  }
  if (!kRangeBin_m.holds(radar.range_bin_m())) {
    broken.push_back({"slope_hz_per_s", "slope, rate and number of samples give range bins of " +
                                            said(radar.range_bin_m()) + " m (allowed: " + kRangeBin_m.text("m") + ")"});
  }
  if (!kFarthest_m.holds(radar.max_range_m())) {
    broken.push_back({"sample_rate_hz", "rate and slope give a range of " + said(radar.max_range_m()) +
                                            " m (allowed: " + kFarthest_m.text("m") + ")"});
  }
  const bool is_ti = captureLayoutOf(radar.device).has_value();
  if (is_ti && !kTiSampleRate_hz.holds(radar.sample_rate_hz)) {
    broken.push_back({"sample_rate_hz",
                      "no " + radar.device + " samples at such a rate (allowed: " + kTiSampleRate_hz.text("Hz") + ")"});
  }
}

void checkTimes(const RadarConfig& radar, std::vector<Broken>& broken) {
  const double window_s = radar.samples_per_chirp / radar.sample_rate_hz, end_s = samplesEnd_s(radar);
  if (radar.adc_start_s > kMostStartOfWindow * window_s) {
    broken.push_back({"adc_start_s", "the samples take " + said(window_s) + " s and begin far later (allowed: " +
                                         Bounds{0, kMostStartOfWindow * window_s}.text("s") + ")"});
  }
  if (radar.ramp_end_s < end_s - kRounding_s) {
    broken.push_back({"ramp_end_s", "ends before the last sample; it must be at least " + yamlNumber(end_s) +
                                        " (adc_start_s + samples_per_chirp/sample_rate_hz)"});
  }
  if (radar.ramp_end_s > kMostRampOfWindow * end_s) {
    broken.push_back({"ramp_end_s", "the last sample is taken at " + said(end_s) +
                                        " s, the ramp ends far later (allowed: " +
                                        Bounds{end_s, kMostRampOfWindow * end_s}.text("s") + ")"});
  }
  const double most_idle_s = std::max(kMostIdle_s, kMostIdleOfRamp * std::max(radar.ramp_end_s, end_s));
  if (radar.idle_s > most_idle_s) {
    broken.push_back(
        {"idle_s", "no radar idles so long between chirps (allowed: " + Bounds{0, most_idle_s}.text("s") + ")"});
  }
  const double busy = busy_s(radar);
  if (busy > radar.frame_period_s + kRounding_s) {
    broken.push_back({"frame_period_s", "is shorter than the frame's " + std::to_string(radar.chirps_per_frame()) +
                                            " chirps; it must be at least " + yamlNumber(busy)});
  }
  const double most_s =
      std::min(captureLayoutOf(radar.device) ? kTiMostFrame_s : kMostFrame_s, kMostFrameOfChirps * busy);
  if (radar.frame_period_s > std::max(most_s, busy)) {
    broken.push_back({"frame_period_s", "the frame's " + std::to_string(radar.chirps_per_frame()) + " chirps take " +
                                            said(busy) + " s (allowed: " + Bounds{busy, most_s}.text("s") + ")"});
  }
  for (const double corner_hz : radar.if_highpass_hz) {
    if (kHighPassOfRate.holds(corner_hz / radar.sample_rate_hz)) continue;
    const Bounds allowed{kHighPassOfRate.least * radar.sample_rate_hz, kHighPassOfRate.most * radar.sample_rate_hz};
    broken.push_back({"if_highpass_hz", "a corner at " + said(corner_hz) + " Hz does not belong to samples at " +
                                            said(radar.sample_rate_hz) + " Hz (allowed: " + allowed.text("Hz") + ")"});
  }
}

void checkAntennas(const RadarConfig& radar, std::vector<Broken>& broken) {
  const double wavelength = wavelength_m(radar);
  const auto allowed = [&](const Bounds& bounds) {
    return " (allowed: " + Bounds{bounds.least * wavelength, bounds.most * wavelength}.text("m") + ")";
  };
  const auto apart = [&](double wl) {
    return "antennas lie " + said(wl * wavelength) + " m apart, " + said(wl) + " wavelengths of " + said(wavelength) +
           " m";
  };
  for (const Antennas& list : {kReceivers, kTransmitters}) {
    const std::vector<Eigen::Vector3d>& antennas = radar.*list.member;
    for (const Eigen::Vector3d& p : antennas) {
      if (!kFarthestPosition_m.holds(p.cwiseAbs().maxCoeff())) {
        broken.push_back({list.key, "an antenna lies " + said(p.norm()) +
                                        " m from the radar (allowed: " + kFarthestPosition_m.text("m") + ")"});
        break;
      }
    }
    const std::vector<double> nearest = nearest_wl(antennas, wavelength);
    if (nearest.empty()) continue;
    const auto [least, most] = std::minmax_element(nearest.begin(), nearest.end());
    const Bounds& of_least = list.member == kReceivers.member ? kNearestReceivers_wl : kNeighbour_wl;
    if (!of_least.holds(*least)) {
      broken.push_back({list.key, apart(*least) + allowed(of_least)});
    } else if (!kNeighbour_wl.holds(*most)) {
      broken.push_back({list.key, apart(*most) + " from any other" + allowed(kNeighbour_wl)});
    }
  }
  double farthest_m = 0;
  for (const Eigen::Vector3d& tx : radar.tx_position_m) {
    for (const Eigen::Vector3d& rx : radar.rx_position_m) farthest_m = std::max(farthest_m, (tx - rx).norm());
  }
  if (farthest_m > kMostApart_wl * wavelength) {
    broken.push_back({"tx_position_m", "a transmitter lies " + said(farthest_m) + " m from a receiver (allowed: " +
                                           Bounds{0, kMostApart_wl * wavelength}.text("m") + ")"});
  }
}

std::vector<Broken> brokenRelations(const RadarConfig& radar) {
  std::vector<Broken> broken;
  checkSweep(radar, broken);
  checkTimes(radar, broken);
  checkAntennas(radar, broken);
  return broken;
}

/// How far the numbers are from those of most radars, in squared decades.
double strangeness(const RadarConfig& radar) {
  const auto decades2 = [](double value, double typical) {
    return value > 0 ? std::pow(std::log10(value / typical), 2) : 0.0;
  };
  double sum = decades2(radar.samples_per_chirp / radar.sample_rate_hz, 30e-6) + decades2(radar.range_bin_m(), 0.1);
  for (const Quantity& q : quantities()) sum += decades2(radar.*q.member, q.typical);
  for (const double corner_hz : radar.if_highpass_hz) sum += decades2(corner_hz, 300e3);
  const double wavelength = wavelength_m(radar);
  const std::vector<double> rx = nearest_wl(radar.rx_position_m, wavelength);
  const std::vector<double> tx = nearest_wl(radar.tx_position_m, wavelength);
  if (!rx.empty()) sum += decades2(*std::min_element(rx.begin(), rx.end()), 0.5);
  // Transmitters stand as far apart as all receivers together, to make one longer line with them.
  if (!tx.empty()) sum += decades2(*std::min_element(tx.begin(), tx.end()), 0.5 * radar.receivers());
  return sum;
}

/// A key whose number was meant in another unit.
struct OtherUnit {
  std::string key, unit, value;  ///< value: in SI, as radar.yaml would write it
  RadarConfig radar;             ///< with that value
};

std::string text(const std::vector<Eigen::Vector3d>& positions) {
  std::string all;
  for (const Eigen::Vector3d& p : positions) {
    all += (all.empty() ? "[" : ", [") + said(p.x()) + ", " + said(p.y()) + ", " + said(p.z()) + "]";
  }
  return "[" + all + "]";
}

/// All radars that another unit of one key makes of a radar.
std::vector<OtherUnit> otherUnits(const RadarConfig& radar) {
  std::vector<OtherUnit> all;
  for (const Quantity& q : quantities()) {
    if (std::isnan(radar.*q.member)) continue;
    for (const Unit& unit : q.units) {
      OtherUnit other{q.key, unit.name, "", radar};
      double& value = other.radar.*q.member;
      value *= unit.factor;
      if (value < q.min || value > q.max) continue;
      other.value = written(value);
      if (q.member == &RadarConfig::slope_hz_per_s) other.value += " (" + said(value / 1e12) + " MHz/us)";
      all.push_back(std::move(other));
    }
  }
  if (!radar.if_highpass_hz.empty()) {
    for (const Unit& unit : {Unit{"kHz", 1e3}, Unit{"MHz", 1e6}}) {
      OtherUnit other{"if_highpass_hz", unit.name, "", radar};
      for (double& corner_hz : other.radar.if_highpass_hz) {
        corner_hz *= unit.factor;
        other.value += (other.value.empty() ? "[" : ", ") + written(corner_hz);
      }
      other.value += "]";
      all.push_back(std::move(other));
    }
  }
  const double wavelength = wavelength_m(radar);
  const std::vector<Unit> lengths = {
      {"half wavelengths", wavelength / 2}, {"wavelengths", wavelength}, {"mm", 1e-3}, {"cm", 1e-2}, {"um", 1e-6}};
  const std::vector<std::vector<Antennas>> lists = {{kReceivers}, {kTransmitters}, {kReceivers, kTransmitters}};
  for (const std::vector<Antennas>& together : lists) {
    for (const Unit& unit : lengths) {
      OtherUnit other{"", unit.name, "", radar};
      for (const Antennas& antennas : together) {
        for (Eigen::Vector3d& p : other.radar.*antennas.member) p *= unit.factor;
        other.key += (other.key.empty() ? "" : ", ") + std::string(antennas.key);
        other.value += (other.value.empty() ? "" : ", ") + text(other.radar.*antennas.member);
      }
      all.push_back(std::move(other));
    }
  }
  return all;
}

/// The unit that mends most of what is broken and breaks nothing new; of those alike, that of the commonest radar.
std::optional<OtherUnit> likelyUnit(const RadarConfig& radar, const std::vector<Broken>& broken) {
  std::optional<OtherUnit> best;
  std::size_t left_of_best = broken.size();
  double strange_of_best = kInfinity;
  for (OtherUnit& other : otherUnits(radar)) {
    const std::vector<Broken> left = brokenRelations(other.radar);
    if (left.size() >= broken.size() || left.size() > left_of_best) continue;
    // Two wrong numbers may hide a third: what is broken after the change has to be of the keys that were.
    const bool is_new = std::any_of(left.begin(), left.end(), [&](const Broken& b) {
      return std::none_of(broken.begin(), broken.end(), [&](const Broken& before) { return before.key == b.key; });
    });
    const double strange = strangeness(other.radar);
    if (is_new || (left.size() == left_of_best && strange >= strange_of_best)) continue;
    left_of_best = left.size();
    strange_of_best = strange;
    best = std::move(other);
  }
  return best;
}

/// The value of a key as it would stand in radar.yaml.
std::string valueOf(const RadarConfig& radar, const std::string& key) {
  if (key == kReceivers.key) return text(radar.rx_position_m);
  if (key == kTransmitters.key) return text(radar.tx_position_m);
  if (key == "if_highpass_hz") {
    return "[" + yamlNumber(radar.if_highpass_hz[0]) + ", " + yamlNumber(radar.if_highpass_hz[1]) + "]";
  }
  for (const Quantity& q : quantities()) {
    if (q.key == key) return yamlNumber(radar.*q.member);
  }
  return text(radar.rx_position_m) + ", " + text(radar.tx_position_m);
}

/// The end of an error that knows a likely unit.
std::string question(const std::string& keys, const std::string& unit, const std::string& in_si) {
  return "; is it in " + unit + "? then write " + keys + ": " + in_si;
}

}  // namespace

double readRadarNumber(YamlMap& yaml, const std::string& key) {
  const auto q =
      std::find_if(quantities().begin(), quantities().end(), [&](const Quantity& each) { return each.key == key; });
  try {
    return yaml.number(key, q->min, q->max);
  } catch (const InputError& error) {
    if (!yaml.has(key)) throw;
    double value = 0;
    try {
      value = yaml.number(key, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max());
    } catch (const InputError&) {
      throw error;  // it is no number at all
    }
    const Unit* likely = nullptr;
    double decades = kInfinity;
    for (const Unit& unit : q->units) {
      const double meant = value * unit.factor;
      if (!(meant > 0) || meant < q->min || meant > q->max) continue;
      const double off = std::abs(std::log10(meant / q->typical));
      if (off >= decades) continue;
      decades = off;
      likely = &unit;
    }
    if (likely == nullptr) throw;
    throw InputError(error.what() + question(key, likely->name, written(value * likely->factor)));
  }
}

void checkPlausibility(const RadarConfig& radar, const YamlMap& yaml) {
  const std::vector<Broken> broken = brokenRelations(radar);
  if (broken.empty()) return;
  const std::optional<OtherUnit> likely = likelyUnit(radar, broken);
  if (!likely) yaml.fail(broken.front().key, valueOf(radar, broken.front().key) + ": " + broken.front().why);
  // What the change mends says why, first of all what is said of the key itself.
  const std::vector<Broken> left = brokenRelations(likely->radar);
  const auto isMended = [&](const Broken& b) {
    return std::none_of(left.begin(), left.end(), [&](const Broken& l) { return l.key == b.key; });
  };
  auto mended = std::find_if(broken.begin(), broken.end(), [&](const Broken& b) {
    return isMended(b) && likely->key.compare(0, b.key.size(), b.key) == 0;
  });
  if (mended == broken.end()) mended = std::find_if(broken.begin(), broken.end(), isMended);
  const Broken& reason = mended == broken.end() ? broken.front() : *mended;
  const std::string of = likely->key.compare(0, reason.key.size(), reason.key) == 0
                             ? ""
                             : reason.key + " " + valueOf(radar, reason.key) + ": ";
  yaml.fail(likely->key,
            valueOf(radar, likely->key) + ": " + of + reason.why + question(likely->key, likely->unit, likely->value));
}

}  // namespace mmradartwin
