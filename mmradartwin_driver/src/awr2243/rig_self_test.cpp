#include "awr2243/rig_self_test.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kPatternSamples = 1024;
constexpr std::size_t kLanes = 4;
constexpr std::uint16_t kTargetLevel = 120;  ///< -12 dBFS
constexpr double kAboveNoise_db = 20;
constexpr double kAzimuthTolerance_rad = 8 * kPi / 180;

/// Sample n of a ramp.
std::uint16_t rampValue(const awr2243::TestPattern::Ramp& ramp, int n) {
  return static_cast<std::uint16_t>(ramp.start + n * ramp.increment);
}

std::uint16_t swapped(std::uint16_t value) { return static_cast<std::uint16_t>(value << 8 | value >> 8); }

struct Source {
  std::size_t rx;
  bool q, bytes_swapped;
};

/// Ramp that this row of words carries, packet after packet.
template <class Word>
std::optional<Source> sourceOf(int packets, Word word) {
  const awr2243::TestPattern pattern = selfTestPattern();
  for (std::size_t rx = 0; rx < kLanes; ++rx) {
    for (const bool q : {false, true}) {
      const awr2243::TestPattern::Ramp& ramp = q ? pattern.rx[rx].q : pattern.rx[rx].i;
      for (const bool swap : {false, true}) {
        bool same = true;
        for (int n = 0; n < packets * kPatternSamples && same; ++n) {
          const std::uint16_t value = rampValue(ramp, n % kPatternSamples);
          same = word(n) == (swap ? swapped(value) : value);
        }
        if (same) return Source{rx, q, swap};
      }
    }
  }
  return std::nullopt;
}

std::string text(const char* format, double a, double b) {
  char line[160];
  std::snprintf(line, sizeof line, format, a, b);
  return line;
}

/// Level of the map's strongest cell within a bin of `range_m` and a beam of `azimuth_rad`, and its azimuth.
struct Peak {
  double power_db = -400, azimuth_rad = 0;
};
Peak peakNear(const RangeAngleMap& map, double range_m, double azimuth_rad) {
  const double bin_m = map.axes.range_m[1] - map.axes.range_m[0];
  Peak peak;
  for (std::size_t r = 0; r < map.axes.range_m.size(); ++r) {
    if (std::abs(map.axes.range_m[r] - range_m) > 1.01 * bin_m) continue;
    for (std::size_t a = 0; a < map.axes.azimuth_rad.size(); ++a) {
      const double azimuth = map.axes.azimuth_rad[a];
      if (!(std::abs(azimuth - azimuth_rad) <= kAzimuthTolerance_rad)) continue;
      const double power_db = map.power_db(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(a));
      if (power_db > peak.power_db) peak = {power_db, azimuth};
    }
  }
  return peak;
}

}  // namespace

RadarConfig selfTestRadar(const RadarConfig& radar) {
  RadarConfig test = radar;
  test.tx_position_m.resize(1);
  if (!test.tx_enable.empty()) test.tx_enable.resize(1);
  test.loops_per_frame = 1;
  return test;
}

awr2243::TestPattern selfTestPattern() {
  awr2243::TestPattern pattern;
  pattern.enable = 1;
  pattern.clocks = 200;  // a sample per microsecond
  pattern.samples = kPatternSamples;
  for (std::size_t rx = 0; rx < kLanes; ++rx) {
    const auto number = static_cast<std::uint16_t>(rx);
    pattern.rx[rx].i = {static_cast<std::uint16_t>(0x0100 + 0x1000 * number),
                        static_cast<std::uint16_t>(1 + 2 * number)};
    pattern.rx[rx].q = {static_cast<std::uint16_t>(0x8200 + 0x1000 * number),
                        static_cast<std::uint16_t>(2 + 2 * number)};
  }
  return pattern;
}

std::size_t selfTestPacketBytes() { return kPatternSamples * kLanes * 4; }

CheckResult judgeTestPattern(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes) {
  CheckResult result;
  result.subject = "lane pattern";
  RadarConfig pattern_radar = selfTestRadar(radar);
  pattern_radar.samples_per_chirp = kPatternSamples;
  const int packets = static_cast<int>(bytes.size() / pattern_radar.bytes_per_frame());
  const auto receivers = static_cast<std::size_t>(radar.receivers());
  std::vector<std::int16_t> words, packet;
  for (int p = 0; p < packets; ++p) {
    decodeFrame(pattern_radar, bytes.data() + static_cast<std::size_t>(p) * pattern_radar.bytes_per_frame(), packet);
    words.insert(words.end(), packet.begin(), packet.end());
  }
  std::string order;
  bool reordered = false, swapped_iq = false, swapped_bytes = false, unknown = false;
  for (std::size_t rx = 0; rx < receivers; ++rx) {
    std::array<std::optional<Source>, 2> parts;
    for (std::size_t q = 0; q < 2; ++q) {
      parts[q] = sourceOf(packets, [&](int n) {
        return static_cast<std::uint16_t>(words[(static_cast<std::size_t>(n) * receivers + rx) * 2 + q]);
      });
    }
    const std::size_t device_rx = rx < radar.rx_enable.size() ? static_cast<std::size_t>(radar.rx_enable[rx]) : rx;
    if (!parts[0] || !parts[1] || parts[0]->rx != parts[1]->rx || parts[0]->q == parts[1]->q) {
      unknown = true;
      order += " ?";
      continue;
    }
    order += " " + std::to_string(parts[0]->rx);
    reordered = reordered || parts[0]->rx != device_rx;
    swapped_iq = swapped_iq || parts[0]->q;
    swapped_bytes = swapped_bytes || parts[0]->bytes_swapped || parts[1]->bytes_swapped;
  }
  const auto add = [&result](const std::string& found, const std::string& next) {
    result.level = CheckResult::Level::kProblem;
    result.found += (result.found.empty() ? "" : "; ") + found;
    result.next += (result.next.empty() ? "" : "; ") + next;
  };
  if (packets == 0 || unknown) {
    add("lanes that carry no ramp of the chip's (receivers found:" + order + ")",
        "seat the LVDS ribbon; check that the layout in radar.yaml is the radar's");
  }
  if (reordered) {
    add("the lanes carry the receivers in the order" + order,
        "give radar.yaml's rx_position_m in that order, or check the LVDS ribbon");
  }
  if (swapped_iq) add("Q comes where I should", "set iq_order in radar.yaml to the other order");
  if (swapped_bytes) add("the bytes of each word are swapped", "the card must be configured for 16 bit samples");
  if (result.level == CheckResult::Level::kFine) {
    result.found = "receivers in order" + order + ", I and Q as radar.yaml says, no bit wrong in " +
                   std::to_string(words.size()) + " words";
  }
  return result;
}

std::vector<SelfTestTarget> selfTestTargets(const RadarConfig& radar) {
  // Whole bins, so that the mirrored places are whole bins too.
  const int n = radar.samples_per_chirp;
  const double bin_m = radar.range_bin_m();
  return {{bin_m * std::max(1, 3 * n / 10), 35 * kPi / 180}, {bin_m * std::max(2, 6 * n / 10), -20 * kPi / 180}};
}

awr2243::TestSource selfTestSource(const RadarConfig& radar) {
  awr2243::TestSource source;
  const auto targets = selfTestTargets(radar);
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const double across_m = targets[i].range_m * std::sin(targets[i].azimuth_rad);
    const double ahead_m = targets[i].range_m * std::cos(targets[i].azimuth_rad);
    if (ahead_m > 300)
      throw InputError("the self-test's targets would be further out than the chip can be told: 300 m");
    source.targets[i].position_cm[0] = static_cast<std::int16_t>(std::lround(across_m * 100));
    source.targets[i].position_cm[1] = static_cast<std::int16_t>(std::lround(ahead_m * 100));
    source.targets[i].level = kTargetLevel;
    for (int axis = 0; axis < 3; ++axis) {
      source.targets[i].min_cm[axis] = axis == 1 ? 0 : -32767;
      source.targets[i].max_cm[axis] = 32767;
    }
  }
  const double eighth_m = kSpeedOfLight_m_per_s / radar.carrier_hz / 8;
  for (std::size_t rx = 0; rx < static_cast<std::size_t>(radar.receivers()); ++rx) {
    const std::size_t device_rx = rx < radar.rx_enable.size() ? static_cast<std::size_t>(radar.rx_enable[rx]) : rx;
    source.rx_position[device_rx][0] = static_cast<std::int8_t>(std::lround(radar.rx_position_m[rx].y() / eighth_m));
    source.rx_position[device_rx][1] = static_cast<std::int8_t>(std::lround(radar.rx_position_m[rx].z() / eighth_m));
  }
  source.dither_off = 1;
  return source;
}

CheckResult judgeTestSource(const RadarConfig& radar, const std::vector<std::uint8_t>& bytes) {
  const RadarConfig test = selfTestRadar(radar);
  const SignalChain chain(test);
  CoherentAverage average(test, 0);
  const std::size_t frames = bytes.size() / test.bytes_per_frame();
  for (std::size_t i = 0; i < frames; ++i) {
    AdcCube cube;
    cube.chirps = 1;
    cube.samples = test.samples_per_chirp;
    cube.receivers = test.receivers();
    decodeFrame(test, bytes.data() + i * test.bytes_per_frame(), cube.data);
    cube.chirp_valid.assign(1, 1);
    average.add(cube);
  }
  CheckResult result;
  result.subject = "test source";
  if (frames == 0) {
    result.level = CheckResult::Level::kProblem;
    result.found = "no whole frame";
    result.next = "see to the samples first";
    return result;
  }
  const RangeAngleMap map = chain.map(average.grid());
  std::vector<double> levels_db;
  for (Eigen::Index i = 0; i < map.power_db.size(); ++i) {
    if (std::isfinite(map.power_db.data()[i])) levels_db.push_back(map.power_db.data()[i]);
  }
  const auto middle = levels_db.begin() + static_cast<std::ptrdiff_t>(levels_db.size() / 2);
  std::nth_element(levels_db.begin(), middle, levels_db.end());
  const double median_db = *middle, strongest_db = *std::max_element(levels_db.begin(), levels_db.end());
  // Swapped I and Q conjugate the samples, which mirrors ranges and angles. Reversed lanes mirror only the angles.
  struct Place {
    bool far, other_side;
    double level_db = 0;
  };
  std::array<Place, 4> places{{{false, false}, {false, true}, {true, true}, {true, false}}};
  std::string seen;
  for (Place& place : places) {
    std::string here;
    place.level_db = 400;
    for (const SelfTestTarget& target : selfTestTargets(radar)) {
      const Peak peak = peakNear(map, place.far ? test.max_range_m() - target.range_m : target.range_m,
                                 place.other_side ? -target.azimuth_rad : target.azimuth_rad);
      place.level_db = std::min(place.level_db, peak.power_db);
      here += (here.empty() ? "" : ", ") + text("%.2f m at %.0f deg", target.range_m, peak.azimuth_rad * 180 / kPi);
    }
    if (&place == &places.front()) seen = here;
  }
  const Place& best = *std::max_element(places.begin(), places.end(),
                                        [](const Place& a, const Place& b) { return a.level_db < b.level_db; });
  result.level = CheckResult::Level::kProblem;
  // Two equal targets are as high as the strongest cell and far above the rest; the strongest noise is not.
  if (best.level_db < strongest_db - 6 || best.level_db < median_db + kAboveNoise_db) {
    result.found =
        text("the chip's two targets are not in the samples (%.0f dB where they should be, strongest %.0f dB)",
             places.front().level_db, strongest_db);
    result.next = "check slope, sample rate and rx_position_m in radar.yaml, and the lane pattern above";
  } else if (!best.far && !best.other_side) {
    result.level = CheckResult::Level::kFine;
    result.found = "both targets are where they were put: " + seen;
  } else if (!best.far) {
    result.found = "the angles have the wrong sign";
    result.next = "rx_position_m in radar.yaml does not have the receivers in the order of the lanes";
  } else if (best.other_side) {
    result.found = "I and Q are swapped: the targets stand at mirrored ranges and angles";
    result.next = "set iq_order in radar.yaml to the other order";
  } else {
    result.found = "I and Q are swapped and the receivers reversed: the targets stand at mirrored ranges";
    result.next = "set iq_order in radar.yaml to the other order, and see to the order of rx_position_m";
  }
  return result;
}

}  // namespace mmradartwin
