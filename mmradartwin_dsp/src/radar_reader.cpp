// Reads radar.yaml (loadRadarConfig() and parseRadarConfig() of radar_config.h).
#include <algorithm>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"
#include "radar_plausibility.h"

namespace mmradartwin {
namespace {

/// More transmitters or receivers than any radar has: products of sizes stay in range.
constexpr std::size_t kMostAntennas = 1024;

std::vector<Eigen::Vector3d> positions(YamlMap& yaml, const std::string& key) {
  std::vector<Eigen::Vector3d> positions;
  for (const std::vector<double>& row : yaml.rows(key, 3, -1e6, 1e6)) positions.emplace_back(row[0], row[1], row[2]);
  if (positions.empty()) yaml.fail(key, "is empty; give at least one position [x, y, z] in metres");
  if (positions.size() > kMostAntennas) {
    yaml.fail(key, "has " + std::to_string(positions.size()) + " positions; allowed: " + std::to_string(kMostAntennas));
  }
  return positions;
}

void checkFrameSize(const RadarConfig& radar, const YamlMap& yaml) {
  if (radar.frame_mb() <= radar.max_frame_mb) return;
  yaml.fail("max_frame_mb",
            "allows frames of " + significantNumber(radar.max_frame_mb, 4) + " MiB, and one of " +
                std::to_string(radar.chirps_per_frame()) + " chirps (loops_per_frame x tx_position_m) of " +
                std::to_string(radar.samples_per_chirp) + " complex samples from " +
                std::to_string(radar.capture_receivers()) + " receivers has " + significantNumber(radar.frame_mb(), 4) +
                " MiB; correct those numbers, or set max_frame_mb higher (of captures: messages and bags have " +
                significantNumber(kMaxFrame_mb, 4) + " MiB at most)");
}

RadarConfig read(YamlMap yaml) {
  RadarConfig radar;
  radar.device = yaml.text("device");
  radar.carrier_hz = readRadarNumber(yaml, "carrier_hz");
  radar.slope_hz_per_s = readRadarNumber(yaml, "slope_hz_per_s");
  radar.samples_per_chirp = static_cast<int>(yaml.integer("samples_per_chirp", 2, 16384));
  radar.sample_rate_hz = readRadarNumber(yaml, "sample_rate_hz");
  radar.adc_start_s = readRadarNumber(yaml, "adc_start_s");
  radar.loops_per_frame = static_cast<int>(yaml.integer("loops_per_frame", 1, 32768));
  radar.frame_period_s = readRadarNumber(yaml, "frame_period_s");
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
  if (yaml.has("samples")) radar.real_samples = yaml.choice("samples", {"complex", "real"}) == "real";
  if (yaml.has("idle_s")) radar.idle_s = readRadarNumber(yaml, "idle_s");
  if (yaml.has("ramp_end_s")) radar.ramp_end_s = readRadarNumber(yaml, "ramp_end_s");
  if (yaml.has("rx_gain_db")) radar.rx_gain_db = yaml.number("rx_gain_db", 0, 120);
  if (yaml.has("tx_backoff_db")) radar.tx_backoff_db = yaml.number("tx_backoff_db", 0, 60);
  if (yaml.has("max_frame_mb")) radar.max_frame_mb = yaml.number("max_frame_mb", 0.001, 4096);
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
  if (yaml.has("angle_slots")) {
    for (const long long slot : yaml.integers("angle_slots", 0, radar.slots() - 1)) {
      if (std::find(radar.angle_slots.begin(), radar.angle_slots.end(), slot) != radar.angle_slots.end()) {
        yaml.fail("angle_slots", "names slot " + std::to_string(slot) + " twice; name each once");
      }
      radar.angle_slots.push_back(static_cast<int>(slot));
    }
    if (radar.angle_slots.empty()) yaml.fail("angle_slots", "is empty; name slots, or leave the key out for all");
  }
  yaml.rejectUnknownKeys();

  if (radar.real_samples && (radar.samples_per_chirp % 2 != 0 || radar.samples_per_chirp < 4)) {
    yaml.fail("samples_per_chirp",
              "'" + std::to_string(radar.samples_per_chirp) +
                  "' real samples do not pair up; with samples: real it must be even and at least 4");
  }
  if (!radar.real_samples && radar.layout == CaptureLayout::kTwoLane && radar.samples_per_chirp % 2 != 0) {
    yaml.fail("samples_per_chirp", "'" + std::to_string(radar.samples_per_chirp) +
                                       "' is odd; layout 2lane stores samples in pairs, so it must be even");
  }
  checkPlausibility(radar, yaml);
  if (radar.real_samples) {
    radar.samples_per_chirp /= 2;
    radar.sample_rate_hz /= 2;
  }
  checkFrameSize(radar, yaml);
  return radar;
}

}  // namespace

RadarConfig loadRadarConfig(const std::string& file) { return read(YamlMap::load(file)); }

RadarConfig parseRadarConfig(const std::string& yaml_text, const std::string& name) {
  return read(YamlMap::parse(yaml_text, name));
}

}  // namespace mmradartwin
