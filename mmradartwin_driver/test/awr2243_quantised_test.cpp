#include "awr2243/awr2243_quantised.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <ostream>
#include <string>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin {
namespace {

/// The paper's deployment, with what a device needs besides.
RadarConfig deployment() {
  RadarConfig radar = paperRadar();
  radar.idle_s = 7e-6;
  radar.ramp_end_s = 20e-6;
  radar.tx_enable = {{0}, {2}};
  radar.rx_enable = {0, 1, 2, 3};
  radar.rx_gain_db = 30 + 10;
  radar.tx_backoff_db = 0;
  radar.if_highpass_hz = {175e3, 350e3};
  return radar;
}

TEST(Awr2243Quantised, TheDeploymentInTheDevicesUnits) {
  const Awr2243Registers registers = quantiseAwr2243(deployment(), "radar.yaml");
  EXPECT_EQ(registers.start_frequency, 1435384036u);  // 77e9 * 2^26 / 3.6e9
  EXPECT_EQ(registers.slope, 1553);                   // 75e12 / 48.2798e9 = 1553.45
  EXPECT_EQ(registers.idle, 700u);
  EXPECT_EQ(registers.adc_start, 600u);
  EXPECT_EQ(registers.ramp_end, 2000u);
  EXPECT_EQ(registers.samples, 64);
  EXPECT_EQ(registers.sample_rate_ksps, 5000);
  EXPECT_EQ(registers.highpass1, 0);
  EXPECT_EQ(registers.highpass2, 0);
  EXPECT_EQ(registers.rx_gain_db, 40);
  EXPECT_EQ(registers.rx_mask, 0xF);
  EXPECT_EQ(registers.chirp_tx_mask, (std::vector<std::uint16_t>{1, 4}));
  EXPECT_EQ(registers.tx_mask(), 5);
  EXPECT_EQ(registers.loops, 1);
  EXPECT_EQ(registers.frame_period, 10000000u);
}

TEST(Awr2243Quantised, TheConfigurationSaysWhatTheDeviceDoes) {
  const RadarConfig radar = deployment();
  const RadarConfig quantised = withQuantisedValues(radar, quantiseAwr2243(radar, "radar.yaml"));
  EXPECT_NEAR(quantised.slope_hz_per_s, 74.9785e12, 0.0001e12);
  EXPECT_NEAR(quantised.carrier_hz, 77e9, 3.6e9 / 67108864 / 2);
  EXPECT_EQ(quantised.adc_start_s, 6e-6);
  EXPECT_EQ(quantised.idle_s, 7e-6);
  EXPECT_EQ(quantised.ramp_end_s, 20e-6);
  EXPECT_EQ(quantised.frame_period_s, 0.05);
  EXPECT_NEAR(quantised.bandwidth_hz(), 959.7e6, 0.05e6);
  EXPECT_NEAR(quantised.range_bin_m(), 0.1562, 0.00005);
  // What has been quantised is quantised to itself.
  const RadarConfig again = withQuantisedValues(quantised, quantiseAwr2243(quantised, "radar.yaml"));
  EXPECT_EQ(again.slope_hz_per_s, quantised.slope_hz_per_s);
  EXPECT_EQ(again.carrier_hz, quantised.carrier_hz);
}

struct Violation {
  const char* name;
  std::function<void(RadarConfig&)> make;
  std::vector<std::string> words;  ///< of the message, besides the file
};

void PrintTo(const Violation& violation, std::ostream* out) { *out << violation.name; }

class Awr2243Limit : public testing::TestWithParam<Violation> {};

TEST_P(Awr2243Limit, IsNamedWithKeyValueAndRange) {
  RadarConfig radar = deployment();
  GetParam().make(radar);
  try {
    quantiseAwr2243(radar, "some/radar.yaml");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_EQ(message.find("some/radar.yaml: key "), 0u) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const std::string& word : GetParam().words) EXPECT_NE(message.find(word), std::string::npos) << message;
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, Awr2243Limit,
    testing::Values(
        Violation{"device", [](RadarConfig& r) { r.device = "iwr1843"; }, {"device", "iwr1843", "awr2243"}},
        Violation{"layout", [](RadarConfig& r) { r.layout = CaptureLayout::kTwoLane; }, {"layout", "4lane"}},
        Violation{"missing_idle", [](RadarConfig& r) { r.idle_s = std::nan(""); }, {"idle_s", "missing"}},
        Violation{"missing_two",
                  [](RadarConfig& r) {
                    r.tx_enable.clear();
                    r.if_highpass_hz.clear();
                  },
                  {"tx_enable, if_highpass_hz", "missing"}},
        Violation{"carrier", [](RadarConfig& r) { r.carrier_hz = 60e9; }, {"carrier_hz", "6e+10", "7.6", "8.1"}},
        Violation{"slope", [](RadarConfig& r) { r.slope_hz_per_s = 300e12; }, {"slope_hz_per_s", "3e+14", "2.66"}},
        Violation{"sweep", [](RadarConfig& r) { r.carrier_hz = 80e9; }, {"ramp_end_s", "8.1e+10"}},
        Violation{"ramp_end", [](RadarConfig& r) { r.ramp_end_s = 18e-6; }, {"ramp_end_s", "1.8e-05", "1.88e-05"}},
        Violation{"adc_start", [](RadarConfig& r) { r.adc_start_s = 41e-6; }, {"adc_start_s", "4.1e-05", "4.095e-05"}},
        Violation{"cycle",
                  [](RadarConfig& r) {
                    r.samples_per_chirp = 16;
                    r.ramp_end_s = 10e-6;
                    r.idle_s = 2e-6;
                  },
                  {"idle_s", "12", "13 us", "3e-06"}},
        Violation{"samples",
                  [](RadarConfig& r) { r.samples_per_chirp = 1025; },
                  {"samples_per_chirp", "1025", "2 to 1024", "16 kB"}},
        Violation{
            "sample_rate", [](RadarConfig& r) { r.sample_rate_hz = 25e6; }, {"sample_rate_hz", "2.5e+07", "2.25e+07"}},
        Violation{"loops", [](RadarConfig& r) { r.loops_per_frame = 256; }, {"loops_per_frame", "256", "1 to 255"}},
        Violation{"long_frame", [](RadarConfig& r) { r.frame_period_s = 1.5; }, {"frame_period_s", "1.5", "1.342"}},
        Violation{"short_frame", [](RadarConfig& r) { r.frame_period_s = 299e-6; }, {"frame_period_s", "0.0003"}},
        Violation{
            "frame_idle", [](RadarConfig& r) { r.frame_period_s = 350e-6; }, {"frame_period_s", "300 us", "0.000354"}},
        Violation{"three_tx",
                  [](RadarConfig& r) {
                    r.tx_enable = {{0, 1, 2}, {1}};
                  },
                  {"tx_enable", "slot 0", "1 or 2"}},
        Violation{"tx_number",
                  [](RadarConfig& r) {
                    r.tx_enable = {{0}, {3}};
                  },
                  {"tx_enable", "3", "0, 1 and 2"}},
        Violation{"tx_twice",
                  [](RadarConfig& r) {
                    r.tx_enable = {{0}, {1, 1}};
                  },
                  {"tx_enable", "slot 1", "twice"}},
        Violation{"rx_number",
                  [](RadarConfig& r) {
                    r.rx_enable = {0, 1, 2, 4};
                  },
                  {"rx_enable", "4", "0, 1, 2 and 3"}},
        Violation{"rx_order",
                  [](RadarConfig& r) {
                    r.rx_enable = {3, 2, 1, 0};
                  },
                  {"rx_enable", "ascending"}},
        Violation{"rx_three",
                  [](RadarConfig& r) {
                    r.rx_enable = {0, 1, 2};
                    r.rx_position_m.pop_back();
                  },
                  {"rx_enable", "1, 2 or 4"}},
        Violation{"odd_gain", [](RadarConfig& r) { r.rx_gain_db = 41; }, {"rx_gain_db", "41", "32 to 52", "2"}},
        Violation{"backoff", [](RadarConfig& r) { r.tx_backoff_db = 21; }, {"tx_backoff_db", "21", "0 to 20"}},
        Violation{"highpass1",
                  [](RadarConfig& r) { r.if_highpass_hz[0] = 200e3; },
                  {"if_highpass_hz", "200000", "175000", "700000"}},
        Violation{
            "highpass2", [](RadarConfig& r) { r.if_highpass_hz[1] = 175e3; }, {"if_highpass_hz", "second", "2.8e+06"}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Awr2243Quantised, ValuesAtTheLimitsAreTaken) {
  RadarConfig radar = deployment();
  radar.samples_per_chirp = 1024;
  radar.sample_rate_hz = 22.5e6;
  radar.ramp_end_s = 55e-6;
  radar.idle_s = 0;
  radar.slope_hz_per_s = 70e12;
  radar.loops_per_frame = 255;
  radar.frame_period_s = 1.342;
  EXPECT_EQ(quantiseAwr2243(radar, "radar.yaml").frame_period, 268400000u);
  radar = deployment();
  radar.ramp_end_s = 18.8e-6;  // the last sample
  EXPECT_EQ(quantiseAwr2243(radar, "radar.yaml").ramp_end, 1880u);
  radar.frame_period_s = 2 * 25.8e-6 + 300e-6;
  EXPECT_EQ(quantiseAwr2243(radar, "radar.yaml").frame_period, 70320u);
  radar.rx_enable = {1, 3};
  radar.rx_position_m.resize(2);
  radar.samples_per_chirp = 2048;
  radar.sample_rate_hz = 20e6;
  radar.ramp_end_s = 110e-6;
  radar.slope_hz_per_s = 30e12;
  radar.frame_period_s = 0.05;
  EXPECT_EQ(quantiseAwr2243(radar, "radar.yaml").rx_mask, 10);
}

}  // namespace
}  // namespace mmradartwin
