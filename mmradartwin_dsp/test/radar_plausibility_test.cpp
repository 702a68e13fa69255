#include <map>

#include "test_radar.h"

namespace mmradartwin {
namespace {

/// The paper's radar.yaml with other values of some keys, or further keys.
std::string radarYaml(const std::map<std::string, std::string>& values) {
  std::string text = paperRadarYaml();
  for (const auto& [key, value] : values) {
    const std::size_t at = text.find(key + ": ");
    if (at == std::string::npos) {
      text += key + ": " + value + "\n";
    } else {
      text.replace(at, text.find('\n', at) - at, key + ": " + value);
    }
  }
  return text;
}

std::string refusal(const std::map<std::string, std::string>& values) {
  return inputError([&] { parseRadarConfig(radarYaml(values), "radar.yaml"); });
}

struct WrongUnit {
  std::string name;
  std::map<std::string, std::string> values;
  std::string key, unit, in_si;
};

class RadarYamlInOtherUnits : public ::testing::TestWithParam<WrongUnit> {};

TEST_P(RadarYamlInOtherUnits, IsAnErrorThatNamesTheUnit) {
  const WrongUnit& wrong = GetParam();
  EXPECT_TRUE(saysInOneLine(refusal(wrong.values), "radar.yaml: key " + wrong.key, "allowed",
                            "is it in " + wrong.unit + "?", "then write " + wrong.key + ": " + wrong.in_si));
}

INSTANTIATE_TEST_SUITE_P(
    Units, RadarYamlInOtherUnits,
    ::testing::Values(
        WrongUnit{"rate_ksps", {{"sample_rate_hz", "10000"}}, "sample_rate_hz", "ksps (kHz)", "1.0e+07"},
        WrongUnit{"rate_ksps_below_any", {{"sample_rate_hz", "5000"}}, "sample_rate_hz", "ksps (kHz)", "5.0e+06"},
        WrongUnit{"rate_msps", {{"sample_rate_hz", "12.5"}}, "sample_rate_hz", "Msps (MHz)", "12500000.0"},
        WrongUnit{"rate_ksps_of_longer_chirps",
                  {{"sample_rate_hz", "10000"}, {"samples_per_chirp", "256"}, {"slope_hz_per_s", "29.982e+12"}},
                  "sample_rate_hz",
                  "ksps (kHz)",
                  "1.0e+07"},
        WrongUnit{"slope_thousandth", {{"slope_hz_per_s", "75e9"}}, "slope_hz_per_s", "kHz/s", "7.5e+13 (75 MHz/us)"},
        WrongUnit{"slope_mhz_per_us", {{"slope_hz_per_s", "75"}}, "slope_hz_per_s", "MHz/us", "7.5e+13"},
        WrongUnit{"carrier_ghz", {{"carrier_hz", "77"}}, "carrier_hz", "GHz", "7.7e+10"},
        WrongUnit{"carrier_mhz", {{"carrier_hz", "60250"}}, "carrier_hz", "MHz", "6.025e+10"},
        WrongUnit{"frame_ms", {{"frame_period_s", "50"}}, "frame_period_s", "ms", "0.05"},
        WrongUnit{"frame_few_ms", {{"frame_period_s", "5"}}, "frame_period_s", "ms", "0.005"},
        WrongUnit{"frame_us", {{"frame_period_s", "40000"}}, "frame_period_s", "us", "0.04"},
        WrongUnit{"adc_start_us", {{"adc_start_s", "6"}}, "adc_start_s", "us", "6.0e-06"},
        WrongUnit{"adc_start_ms", {{"adc_start_s", "0.006"}}, "adc_start_s", "ms", "6.0e-06"},
        WrongUnit{"ramp_us", {{"ramp_end_s", "60"}, {"idle_s", "7e-6"}}, "ramp_end_s", "us", "6.0e-05"},
        WrongUnit{"ramp_ms", {{"ramp_end_s", "0.02"}, {"idle_s", "7e-6"}}, "ramp_end_s", "ms", "2.0e-05"},
        WrongUnit{"idle_us", {{"ramp_end_s", "60e-6"}, {"idle_s", "100"}}, "idle_s", "us", "1.0e-04"},
        WrongUnit{"idle_ms", {{"ramp_end_s", "20e-6"}, {"idle_s", "0.007"}}, "idle_s", "ms", "7.0e-06"},
        WrongUnit{"highpass_khz", {{"if_highpass_hz", "[175, 350]"}}, "if_highpass_hz", "kHz", "[175000.0, 350000.0]"},
        WrongUnit{"half_wavelengths",
                  {{"rx_position_m", "[[0,0,0],[0,1,0],[0,2,0],[0,3,0]]"}, {"tx_position_m", "[[0,0,0],[0,4,0]]"}},
                  "rx_position_m, tx_position_m",
                  "half wavelengths",
                  "[[0, 0, 0], [0, 0.001947, 0]"},
        WrongUnit{"wavelengths",
                  {{"rx_position_m", "[[0,0,0],[0,0.5,0],[0,1,0],[0,1.5,0]]"}, {"tx_position_m", "[[0,0,0],[0,2,0]]"}},
                  "rx_position_m, tx_position_m",
                  "wavelengths",
                  "[[0, 0, 0], [0, 0.001947, 0]"},
        WrongUnit{"millimetres",
                  {{"rx_position_m", "[[0,0,0],[0,1.9467,0],[0,3.8934,0],[0,5.8401,0]]"},
                   {"tx_position_m", "[[0,0,0],[0,7.7867,0]]"}},
                  "rx_position_m, tx_position_m",
                  "mm",
                  "[[0, 0, 0], [0, 0.001947, 0]"},
        WrongUnit{"transmitters_in_millimetres",
                  {{"tx_position_m", "[[0,0,0],[0,7.7867,0]]"}},
                  "tx_position_m",
                  "mm",
                  "[[0, 0, 0], [0, 0.007787, 0]]"},
        WrongUnit{"transmitters_far_out",
                  {{"tx_position_m", "[[0,0,0],[0,4,0],[0,8,0],[0,12,0]]"}},
                  "tx_position_m",
                  "half wavelengths",
                  "[[0, 0, 0], [0, 0.007787, 0]"},
        WrongUnit{"receivers_in_centimetres",
                  {{"rx_position_m", "[[0,0,0],[0,0.19467,0]]"}},
                  "rx_position_m",
                  "cm",
                  "[[0, 0, 0], [0, 0.001947, 0]]"}),
    [](const auto& info) { return info.param.name; });

TEST(RadarYamlInOtherUnits, OfALowerBandToo) {
  // 24 GHz in one slow ramp of 1.5 ms: what is plausible there is not at 77 GHz.
  const std::map<std::string, std::string> slow = {{"device", "bgt24"},
                                                   {"carrier_hz", "24.0e+9"},
                                                   {"slope_hz_per_s", "1.33e+11"},
                                                   {"samples_per_chirp", "64"},
                                                   {"sample_rate_hz", "42700"},
                                                   {"adc_start_s", "0"},
                                                   {"frame_period_s", "0.1"},
                                                   {"tx_position_m", "[[0, 0.03, 0]]"},
                                                   {"rx_position_m", "[[0, 0, 0], [0, 0.00625, 0]]"}};
  EXPECT_EQ(refusal(slow), "");
  const auto with = [&slow](const std::string& key, const std::string& value) {
    std::map<std::string, std::string> values = slow;
    values[key] = value;
    return refusal(values);
  };
  EXPECT_TRUE(saysInOneLine(with("rx_position_m", "[[0, 0, 0], [0, 6.25, 0]]"), "rx_position_m", "mm"));
  EXPECT_TRUE(saysInOneLine(with("frame_period_s", "100"), "frame_period_s", "in ms", "0.1"));
  EXPECT_TRUE(saysInOneLine(with("carrier_hz", "24000"), "carrier_hz", "in MHz", "2.4e+10"));
}

TEST(RadarYamlInOtherUnits, NamesTheBrokenRelationWhereNoUnitMendsIt) {
  // A carrier ten times too low makes elements of a twentieth of a wavelength.
  const std::string message = refusal({{"carrier_hz", "7.7e+9"}});
  EXPECT_TRUE(saysInOneLine(message, "rx_position_m", "wavelengths", "allowed"));
  EXPECT_FALSE(contains(message, "is it in")) << message;
  EXPECT_TRUE(saysInOneLine(refusal({{"sample_rate_hz", "10000"},
                                     {"slope_hz_per_s", "75e9"},
                                     {"frame_period_s", "50"},
                                     {"rx_position_m", "[[0,0,0],[0,1,0],[0,2,0],[0,3,0]]"},
                                     {"tx_position_m", "[[0,0,0],[0,4,0]]"}}),
                            "radar.yaml", "allowed", "is it in"))
      << "one after the other";
  EXPECT_TRUE(saysInOneLine(refusal({{"carrier_hz", "seven"}}), "'seven' is no number"));
  EXPECT_TRUE(saysInOneLine(refusal({{"slope_hz_per_s", "-75e12"}}), "slope_hz_per_s", "out of range"));
}

TEST(RadarYamlInOtherUnits, RadarsAsTheyAreBuiltAreLeftAlone) {
  const std::string four_rx = "[[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]";
  const std::map<std::string, std::map<std::string, std::string>> radars = {
      {"60 GHz",
       {{"device", "iwr6843"},
        {"carrier_hz", "60.25e+9"},
        {"slope_hz_per_s", "54.71e+12"},
        {"samples_per_chirp", "96"},
        {"sample_rate_hz", "2.4e+6"},
        {"idle_s", "30e-6"},
        {"ramp_end_s", "59.1e-6"},
        {"loops_per_frame", "96"},
        {"frame_period_s", "0.055"}}},
      {"4 GHz at 77 GHz",
       {{"samples_per_chirp", "256"}, {"sample_rate_hz", "5e6"}, {"idle_s", "7e-6"}, {"ramp_end_s", "60e-6"}}},
      {"far range of a car",
       {{"slope_hz_per_s", "5e12"},
        {"samples_per_chirp", "256"},
        {"sample_rate_hz", "20e6"},
        {"carrier_hz", "76e9"},
        {"if_highpass_hz", "[350e3, 2.8e6]"}}},
      {"short and steep", {{"slope_hz_per_s", "250e12"}, {"sample_rate_hz", "2e6"}, {"samples_per_chirp", "16"}}},
      {"longest idle", {{"idle_s", "5.24e-3"}, {"ramp_end_s", "20e-6"}, {"frame_period_s", "1.3"}}},
      {"slowest frames", {{"frame_period_s", "1.342"}, {"loops_per_frame", "1"}, {"tx_position_m", "[[0, 0, 0]]"}}},
      {"long frames",
       {{"loops_per_frame", "255"}, {"idle_s", "300e-6"}, {"ramp_end_s", "60e-6"}, {"frame_period_s", "0.5"}}},
      {"sparse: receivers of 4 wavelengths, transmitters of 16",
       {{"rx_position_m", "[[0,0,0],[0,0.0156,0],[0,0.0312,0],[0,0.0468,0]]"},
        {"tx_position_m", "[[0,0,0],[0,0.0624,0],[0,0.1248,0]]"}}},
      {"cascade", {{"tx_position_m", "[[0,0,0],[0,0.0077867,0],[0,0.0155734,0],[0,0.0155734,0.0019467]]"}}},
      {"bistatic on a board of half a metre", {{"tx_position_m", "[[0,0.5,0],[0,0.5077867,0]]"}}},
      {"one element", {{"tx_position_m", "[[0,0,0]]"}, {"rx_position_m", "[[0,0,0]]"}}},
      {"two slots of one transmitter", {{"tx_position_m", "[[0,0,0],[0,0,0]]"}, {"rx_position_m", four_rx}}},
      {"122 GHz",
       {{"device", "trx120"},
        {"carrier_hz", "119e9"},
        {"slope_hz_per_s", "5e12"},
        {"samples_per_chirp", "1024"},
        {"sample_rate_hz", "1e6"},
        {"tx_position_m", "[[0,0,0]]"},
        {"rx_position_m", "[[0,0.004,0]]"}}}};
  for (const auto& [name, values] : radars) EXPECT_EQ(refusal(values), "") << name;
}

TEST(RadarYamlInOtherUnits, TinyNumbersAreRefusedAsOthersAre) {
  // In other units it is smaller than any normal number.
  EXPECT_TRUE(saysInOneLine(refusal({{"adc_start_s", "5e-320"}, {"loops_per_frame", "32768"}}), "radar.yaml: key"));
}

TEST(FrameSize, IsBoundedUnlessAKeySaysSo) {
  // 32768 loops x 2 slots x 64 samples x 4 receivers x 4 bytes
  std::map<std::string, std::string> values = {{"loops_per_frame", "32768"}, {"frame_period_s", "2"}};
  EXPECT_EQ(refusal(values), "") << "64 MiB";
  values["samples_per_chirp"] = "66";
  EXPECT_TRUE(saysInOneLine(refusal(values), "radar.yaml: key max_frame_mb", "has 66 MiB", "set max_frame_mb higher"));
  values["max_frame_mb"] = "66";
  EXPECT_EQ(refusal(values), "");
  const RadarConfig radar = parseRadarConfig(radarYaml(values), "radar.yaml");
  EXPECT_EQ(toYaml(parseRadarConfig(toYaml(radar), "again")), toYaml(radar));
  EXPECT_TRUE(contains(toYaml(radar), "max_frame_mb: 66"));
  values["max_frame_mb"] = "5000";
  EXPECT_TRUE(saysInOneLine(refusal(values), "key max_frame_mb", "4096"));
}

TEST(FrameSize, AntennasAreBounded) {
  std::string many;
  for (int i = 0; i < 70000; ++i) many += (i ? ", [0, " : "[0, ") + std::to_string(i) + "e-3, 0]";
  EXPECT_TRUE(saysInOneLine(refusal({{"tx_position_m", "[" + many + "]"}}), "key tx_position_m", "70000", "1024"));
  EXPECT_TRUE(saysInOneLine(refusal({{"rx_position_m", "[" + many + "]"}}), "key rx_position_m", "70000", "1024"));
}

}  // namespace
}  // namespace mmradartwin
