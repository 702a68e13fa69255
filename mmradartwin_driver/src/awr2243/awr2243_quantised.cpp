#include "awr2243/awr2243_quantised.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::array<double, 4> kHighpass1_hz = {175e3, 235e3, 350e3, 700e3};
constexpr std::array<double, 4> kHighpass2_hz = {350e3, 700e3, 1.4e6, 2.8e6};
constexpr long long kMinStartFrequency = 0x5471C71B;  // 76 GHz
constexpr long long kMaxStartFrequency = 0x5A000000;  // 81 GHz
constexpr double kMaxFrequency_hz = 81e9;
constexpr long long kMaxSlope = 5510;
constexpr long long kMinCycle = 1300;  // 13 us
constexpr int kAdcBufferBytes = 16384;
constexpr int kBytesPerSample = 4;  // complex, 16 bit
constexpr long long kMinSampleRate_ksps = 2000;
constexpr long long kMaxSampleRate_ksps = 22500;  // complex 1x, regular ADC mode
constexpr double kMinFramePeriod_s = 300e-6;
constexpr double kMaxFramePeriod_s = 1.342;
constexpr double kMinFrameIdle_s = 300e-6;
constexpr int kTransmitters = 3;
constexpr int kReceivers = 4;
constexpr double kLvds_bit_per_s = 4 * 600e6;  // four lanes
constexpr double kRounding_s = 1e-9;           // values are typed by hand

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

class Checker {
 public:
  explicit Checker(const std::string& file) : file_(file) {}

  [[noreturn]] void fail(const std::string& key, const std::string& why) const {
    throw InputError(file_ + ": key " + key + ": " + why);
  }

  /// `value` in steps of `step`, rounded to the nearest. min and max are in steps and inclusive.
  long long steps(const std::string& key, double value, double step, long long min, long long max) const {
    const double count = std::round(value / step);
    if (!(count >= static_cast<double>(min) && count <= static_cast<double>(max))) {
      fail(key, shown(value) + " is out of the AWR2243's range " + shown(static_cast<double>(min) * step) + " to " +
                    shown(static_cast<double>(max) * step));
    }
    return static_cast<long long>(count);
  }

  std::uint8_t corner(const std::string& what, double value_hz, const std::array<double, 4>& corners_hz) const {
    std::string allowed;
    for (std::size_t code = 0; code < corners_hz.size(); ++code) {
      if (std::abs(value_hz - corners_hz[code]) < 1) return static_cast<std::uint8_t>(code);
      allowed += (code ? ", " : "") + shown(corners_hz[code]);
    }
    fail("if_highpass_hz", what + " corner " + shown(value_hz) + " is none of the AWR2243's: " + allowed);
  }

 private:
  std::string file_;
};

void requireDeviceKeys(const RadarConfig& radar, const Checker& check) {
  std::string missing;
  const auto need = [&missing](const char* key, bool there) {
    if (!there) missing += (missing.empty() ? "" : ", ") + std::string(key);
  };
  need("idle_s", !std::isnan(radar.idle_s));
  need("ramp_end_s", !std::isnan(radar.ramp_end_s));
  need("tx_enable", !radar.tx_enable.empty());
  need("rx_enable", !radar.rx_enable.empty());
  need("rx_gain_db", !std::isnan(radar.rx_gain_db));
  need("tx_backoff_db", !std::isnan(radar.tx_backoff_db));
  need("if_highpass_hz", radar.if_highpass_hz.size() == 2);
  if (!missing.empty()) check.fail(missing, "missing; the device cannot be configured without it");
}

void quantiseEnables(const RadarConfig& radar, const Checker& check, Awr2243Registers& registers) {
  for (std::size_t slot = 0; slot < radar.tx_enable.size(); ++slot) {
    std::uint16_t mask = 0;
    for (const int tx : radar.tx_enable[slot]) {
      const std::string where = "slot " + std::to_string(slot) + " names transmitter " + std::to_string(tx);
      if (tx < 0 || tx >= kTransmitters) check.fail("tx_enable", where + "; the AWR2243 has 0, 1 and 2");
      const auto bit = static_cast<std::uint16_t>(1u << tx);
      if (mask & bit) check.fail("tx_enable", where + " twice");
      mask |= bit;
    }
    if (radar.tx_enable[slot].size() > 2) {
      check.fail("tx_enable", "slot " + std::to_string(slot) + " names " +
                                  std::to_string(radar.tx_enable[slot].size()) +
                                  " transmitters; the AWR2243 drives 1 or 2 in one chirp");
    }
    registers.chirp_tx_mask.push_back(mask);
  }
  int before = -1;
  for (const int rx : radar.rx_enable) {
    if (rx < 0 || rx >= kReceivers) {
      check.fail("rx_enable", "names receiver " + std::to_string(rx) + "; the AWR2243 has 0, 1, 2 and 3");
    }
    if (rx <= before) {
      check.fail("rx_enable",
                 "names receiver " + std::to_string(rx) + " after " + std::to_string(before) +
                     "; the lanes carry the receivers in ascending order: list them, and rx_position_m, so");
    }
    before = rx;
    registers.rx_mask |= static_cast<std::uint16_t>(1u << rx);
  }
  if (radar.rx_enable.size() == 3) {
    check.fail("rx_enable", "names 3 receivers, for which the order of samples is not documented; name 1, 2 or 4");
  }
}

void quantiseChirp(const RadarConfig& radar, const Checker& check, Awr2243Registers& registers) {
  registers.start_frequency = static_cast<std::uint32_t>(check.steps(
      "carrier_hz", radar.carrier_hz, kAwr2243StartFrequencyStep_hz, kMinStartFrequency, kMaxStartFrequency));
  registers.slope = static_cast<std::int16_t>(
      check.steps("slope_hz_per_s", radar.slope_hz_per_s, kAwr2243SlopeStep_hz_per_s, 1, kMaxSlope));
  registers.idle = static_cast<std::uint32_t>(check.steps("idle_s", radar.idle_s, kAwr2243TimeStep_s, 0, 524287));
  registers.adc_start =
      static_cast<std::uint32_t>(check.steps("adc_start_s", radar.adc_start_s, kAwr2243TimeStep_s, 0, 4095));
  registers.ramp_end =
      static_cast<std::uint32_t>(check.steps("ramp_end_s", radar.ramp_end_s, kAwr2243TimeStep_s, 1, 500000));
  registers.sample_rate_ksps = static_cast<std::uint16_t>(
      check.steps("sample_rate_hz", radar.sample_rate_hz, 1e3, kMinSampleRate_ksps, kMaxSampleRate_ksps));

  const int max_samples = kAdcBufferBytes / (kBytesPerSample * radar.receivers());
  if (radar.samples_per_chirp < 2 || radar.samples_per_chirp > max_samples) {
    check.fail("samples_per_chirp", std::to_string(radar.samples_per_chirp) + " is out of 2 to " +
                                        std::to_string(max_samples) + ", what the AWR2243's 16 kB buffer holds of " +
                                        std::to_string(radar.receivers()) + " receivers");
  }
  registers.samples = static_cast<std::uint16_t>(radar.samples_per_chirp);

  const double ramp_end_s = registers.ramp_end * kAwr2243TimeStep_s;
  const double sampled_s =
      registers.adc_start * kAwr2243TimeStep_s + registers.samples / (registers.sample_rate_ksps * 1e3);
  if (ramp_end_s < sampled_s - kRounding_s) {
    check.fail("ramp_end_s",
               shown(radar.ramp_end_s) + " ends before the last sample; it must be at least " + shown(sampled_s));
  }
  const double end_hz = registers.start_frequency * kAwr2243StartFrequencyStep_hz +
                        registers.slope * kAwr2243SlopeStep_hz_per_s * ramp_end_s;
  if (end_hz > kMaxFrequency_hz) {
    check.fail("ramp_end_s", shown(radar.ramp_end_s) + " lets the ramp end at " + shown(std::round(end_hz)) +
                                 " Hz; the AWR2243 sweeps up to " + shown(kMaxFrequency_hz) +
                                 " Hz: lower carrier_hz, slope_hz_per_s or ramp_end_s");
  }
  const long long cycle = static_cast<long long>(registers.idle) + registers.ramp_end;
  if (cycle < kMinCycle) {
    check.fail("idle_s", shown(radar.idle_s) + " makes a chirp cycle (idle_s + ramp_end_s) of " +
                             shown(static_cast<double>(cycle) / 100) +
                             " us; the AWR2243 needs at least 13 us: idle_s must be at least " +
                             shown(static_cast<double>(kMinCycle - registers.ramp_end) / 1e8));
  }
  const double transfer_s = radar.samples_per_chirp * kReceivers * kBytesPerSample * 8 / kLvds_bit_per_s;
  if (transfer_s > static_cast<double>(cycle) * kAwr2243TimeStep_s) {
    check.fail("idle_s", shown(radar.idle_s) + " makes a chirp cycle shorter than the " + shown(transfer_s) +
                             " s that four lanes at 600 Mbit/s take for a chirp's samples");
  }
}

void quantiseFrame(const RadarConfig& radar, const Checker& check, Awr2243Registers& registers) {
  if (radar.loops_per_frame < 1 || radar.loops_per_frame > 255) {
    check.fail("loops_per_frame", std::to_string(radar.loops_per_frame) + " is out of the AWR2243's range 1 to 255");
  }
  registers.loops = static_cast<std::uint16_t>(radar.loops_per_frame);
  registers.frame_period = static_cast<std::uint32_t>(check.steps(
      "frame_period_s", radar.frame_period_s, kAwr2243PeriodStep_s,
      std::llround(kMinFramePeriod_s / kAwr2243PeriodStep_s), std::llround(kMaxFramePeriod_s / kAwr2243PeriodStep_s)));
  const double busy_s = radar.chirps_per_frame() * (registers.idle + registers.ramp_end) * kAwr2243TimeStep_s;
  if (radar.frame_period_s < busy_s + kMinFrameIdle_s - kRounding_s) {
    check.fail("frame_period_s", shown(radar.frame_period_s) + " leaves less than 300 us after the frame's " +
                                     std::to_string(radar.chirps_per_frame()) + " chirps; it must be at least " +
                                     shown(busy_s + kMinFrameIdle_s) + " and at most " + shown(kMaxFramePeriod_s));
  }
}

int wholeDecibels(const Checker& check, const std::string& key, double value, int min, int max, int step) {
  const int rounded = static_cast<int>(std::lround(value));
  if (std::abs(value - rounded) > 1e-9 || rounded < min || rounded > max || (rounded - min) % step != 0) {
    check.fail(key, shown(value) + " is none of the AWR2243's: " + std::to_string(min) + " to " + std::to_string(max) +
                        " in steps of " + std::to_string(step));
  }
  return rounded;
}

}  // namespace

std::uint16_t Awr2243Registers::tx_mask() const {
  std::uint16_t mask = 0;
  for (const std::uint16_t chirp : chirp_tx_mask) mask |= chirp;
  return mask;
}

Awr2243Registers quantiseAwr2243(const RadarConfig& radar, const std::string& file) {
  const Checker check(file);
  if (radar.device != "awr2243")
    check.fail("device", "'" + radar.device + "' is not awr2243: it is not configured here");
  if (radar.layout != CaptureLayout::kFourLane) {
    check.fail("layout", "2lane is not what an AWR2243 sends; it must be 4lane");
  }
  requireDeviceKeys(radar, check);
  Awr2243Registers registers;
  quantiseEnables(radar, check, registers);
  quantiseChirp(radar, check, registers);
  quantiseFrame(radar, check, registers);
  registers.highpass1 = check.corner("first", radar.if_highpass_hz[0], kHighpass1_hz);
  registers.highpass2 = check.corner("second", radar.if_highpass_hz[1], kHighpass2_hz);
  registers.rx_gain_db = static_cast<std::uint16_t>(wholeDecibels(check, "rx_gain_db", radar.rx_gain_db, 32, 52, 2));
  registers.tx_backoff_db =
      static_cast<std::uint8_t>(wholeDecibels(check, "tx_backoff_db", radar.tx_backoff_db, 0, 20, 1));
  registers.q_first = radar.iq_order == IqOrder::kQi;
  return registers;
}

RadarConfig withQuantisedValues(const RadarConfig& radar, const Awr2243Registers& registers) {
  RadarConfig quantised = radar;
  quantised.carrier_hz = registers.start_frequency * kAwr2243StartFrequencyStep_hz;
  quantised.slope_hz_per_s = registers.slope * kAwr2243SlopeStep_hz_per_s;
  // Divided rather than multiplied, so that 600 steps give exactly 6e-06.
  quantised.idle_s = registers.idle / 1e8;
  quantised.adc_start_s = registers.adc_start / 1e8;
  quantised.ramp_end_s = registers.ramp_end / 1e8;
  quantised.sample_rate_hz = registers.sample_rate_ksps * 1e3;
  quantised.frame_period_s = registers.frame_period / 2e8;
  quantised.if_highpass_hz = {kHighpass1_hz.at(registers.highpass1), kHighpass2_hz.at(registers.highpass2)};
  quantised.rx_gain_db = registers.rx_gain_db;
  quantised.tx_backoff_db = registers.tx_backoff_db;
  return quantised;
}

}  // namespace mmradartwin
