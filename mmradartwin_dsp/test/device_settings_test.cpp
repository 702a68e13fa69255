// Settings of TI's tools, in the forms that people publish.
#include "mmradartwin_dsp/device_settings.h"

#include <gtest/gtest.h>

#include <fstream>

#include "test_radar.h"

namespace mmradartwin {
namespace {

void write(const std::string& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

/// A script of the form that mmWave Studio's users publish.
std::string script(const std::string& chirps =
                       "ar1.ChirpConfig(0, 0, 0, 0, 0, 0, 0, 1, 0, 0)\n"
                       "ar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 0, 1)\n") {
  return "-- ar1.FrameConfig(9, 9, 9, 9, 9, 0, 1) is a comment\n"
         "START_FREQ = 77 -- GHz\nRAMP_END_TIME = 20 -- us\nADC_SAMPLES = 64\nCHIRP_LOOPS = 2*8\n--[[ LOOPS = 3\n"
         "ar1.ProfileConfig(7) ]]\n"
         "ar1.Connect(COM_PORT,921600,1000)\n"
         "ar1.SelectChipVersion(\"AR1243\")\nar1.deviceVariantSelection(\"XWR2243\")\n"
         "if (0 == ar1.ChanNAdcConfig(1, 1, 1, 1, 1, 1, 1, 2, 1, 0)) then WriteToLog(\"ok (\\n\", \"green\") end\n"
         "ar1.DataPathConfig(513, 1216644097, 0)\nar1.LvdsClkConfig(1, 1)\n"
         "ar1.LVDSLaneConfig(0, 1, 1, 1, 1, 1, 0, 0)\n"
         "ar1.ProfileConfig(0, START_FREQ, 7, 6, RAMP_END_TIME, 0, 0, 0, 0, 0, 0, 75, 0, ADC_SAMPLES, 5000, 0, 0, "
         "48)\n" +
         chirps +
         "ar1.FrameConfig(0, 1, 200, CHIRP_LOOPS, 50, 0, 1)\n"
         "ar1.CaptureCardConfig_Mode(1, 1, 1, 2, 3, 30)\nar1.CaptureCardConfig_PacketDelay(25)\n";
}

std::string mmwaveJson(const std::string& lanes = "0x3", const std::string& tx_of_second = "0x4",
                       const std::string& waveform = "legacyFrameChirp") {
  return R"({"configGenerator": {"createdBy": "mmWaveStudio"}, "mmWaveDevices": [{"mmWaveDeviceId": 0, "rfConfig": {
    "waveformType": ")" +
         waveform + R"(", "MIMOScheme": "TDM",
    "rlChanCfg_t": {"rxChannelEn": "0xF", "txChannelEn": "0x5", "cascading": 0, "cascadingPinoutCfg": "0x0"},
    "rlAdcOutCfg_t": {"fmt": {"b2AdcBits": 2, "b8FullScaleReducFctr": 0, "b2AdcOutFmt": 1}},
    "rlProfiles": [{"rlProfileCfg_t": {"profileId": 0, "startFreqConst_GHz": 77.0, "idleTimeConst_usec": 100.0,
      "adcStartTimeConst_usec": 6.0, "rampEndTime_usec": 60.0, "txOutPowerBackoffCode": "0x0", "txPhaseShifter": "0x0",
      "freqSlopeConst_MHz_usec": 29.981998443603517, "txStartTime_usec": 0.0, "numAdcSamples": 256,
      "digOutSampleRate": 10000.0, "hpfCornerFreq1": 1, "hpfCornerFreq2": 2, "rxGain_dB": "0x1E"}}],
    "rlChirps": [
      {"rlChirpCfg_t": {"chirpStartIdx": 0, "chirpEndIdx": 0, "profileId": 0, "startFreqVar_MHz": 0.0,
        "freqSlopeVar_KHz_usec": 0.0, "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": "0x1"}},
      {"rlChirpCfg_t": {"chirpStartIdx": 1, "chirpEndIdx": 1, "profileId": 0, "startFreqVar_MHz": 0.0,
        "freqSlopeVar_KHz_usec": 0.0, "idleTimeVar_usec": 0.0, "adcStartTimeVar_usec": 0.0, "txEnable": ")" +
         tx_of_second + R"("}}],
    "rlFrameCfg_t": {"chirpStartIdx": 0, "chirpEndIdx": 1, "numLoops": 32, "numFrames": 8,
      "framePeriodicity_msec": 40.0, "triggerSelect": 1, "frameTriggerDelay": 0.0}},
    "rawDataCaptureConfig": {"rlDevDataFmtCfg_t": {"iqSwapSel": 1, "chInterleave": 1},
      "rlDevDataPathCfg_t": {"intfSel": 1, "transferFmtPkt0": "0x1", "transferFmtPkt1": "0x0"},
      "rlDevLaneEnable_t": {"laneEn": ")" +
         lanes + R"("},
      "rlDevLvdsLaneCfg_t": {"laneFormat": 0, "laneParamCfg": "0x1"}}}]})";
}

const char kSetup[] = R"({"createdByVersion": "2.1", "configUsed": "C:\\ti\\studio\\a.mmwave.json",
  "captureHardware": "DCA1000", "mmWaveDevice": "awr1843",
  "DCA1000Config": {"dataLoggingMode": "raw", "lvdsMode": 2, "dataFormatMode": 3, "packetDelay_us": 5}})";

TEST(ImportSettings, LuaScript) {
  const TestFolder folder;
  write(folder / "a.lua", script());
  const ImportedSettings settings = importSettings({folder / "a.lua"});
  const RadarConfig& radar = settings.radar;
  EXPECT_EQ(radar.device, "awr2243");
  EXPECT_EQ(radar.carrier_hz, 77e9);
  EXPECT_EQ(radar.slope_hz_per_s, 75e12);
  EXPECT_EQ(radar.samples_per_chirp, 64);
  EXPECT_EQ(radar.sample_rate_hz, 5e6);
  EXPECT_EQ(radar.adc_start_s, 6e-6);
  EXPECT_EQ(radar.idle_s, 7e-6);
  EXPECT_EQ(radar.ramp_end_s, 20e-6);
  EXPECT_EQ(radar.loops_per_frame, 16);
  EXPECT_EQ(radar.frame_period_s, 0.05);
  EXPECT_EQ(radar.rx_gain_db, 48);
  EXPECT_EQ(radar.if_highpass_hz, (std::vector<double>{175e3, 350e3}));
  EXPECT_EQ(radar.tx_enable, (std::vector<std::vector<int>>{{0}, {2}}));
  EXPECT_EQ(radar.rx_enable, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(radar.layout, CaptureLayout::kFourLane);
  EXPECT_EQ(radar.iq_order, IqOrder::kIq);
  EXPECT_NEAR(radar.virtual_pitch_m(), 299792458.0 / 77e9 / 2, 1e-7);
  // The file says what was assumed, and reads back as the same radar.
  const std::string yaml = toYaml(settings);
  EXPECT_TRUE(yaml.find("# - antenna positions") != std::string::npos) << yaml;
  EXPECT_TRUE(yaml.find("packet_delay_us:=") != std::string::npos) << yaml;
  EXPECT_EQ(toYaml(parseRadarConfig(yaml, "a.yaml")), toYaml(radar));
}

TEST(ImportSettings, ElevatedTransmitterOfThree) {
  const TestFolder folder;
  write(folder / "a.lua", script("ar1.ChirpConfig(0, 0, 0, 0, 0, 0, 0, 1, 0, 0)\n"
                                 "ar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 1, 0)\n"));
  const RadarConfig radar = importSettings({folder / "a.lua"}).radar;
  EXPECT_GT(radar.tx_position_m[1].z(), 0.0019);
  EXPECT_NEAR(radar.tx_position_m[1].y(), 2 * radar.tx_position_m[1].z(), 1e-12);
}

TEST(ImportSettings, StudioJsonWithItsSetup) {
  const TestFolder folder;
  write(folder / "a.mmwave.json", mmwaveJson());
  write(folder / "setup.json", kSetup);
  const RadarConfig radar = importSettings({folder / "setup.json"}).radar;
  EXPECT_EQ(radar.device, "awr1843");
  EXPECT_NEAR(radar.slope_hz_per_s, 29.982e12, 1e7);
  EXPECT_EQ(radar.samples_per_chirp, 256);
  EXPECT_EQ(radar.loops_per_frame, 32);
  EXPECT_EQ(radar.frame_period_s, 0.04);
  EXPECT_EQ(radar.rx_gain_db, 30);
  EXPECT_EQ(radar.if_highpass_hz, (std::vector<double>{235e3, 1.4e6}));
  EXPECT_EQ(radar.layout, CaptureLayout::kTwoLane);
  EXPECT_EQ(radar.iq_order, IqOrder::kQi);
  // Both given is the same, and so is a device by hand.
  EXPECT_EQ(toYaml(importSettings({folder / "setup.json", folder / "a.mmwave.json"}).radar), toYaml(radar));
  EXPECT_EQ(toYaml(importSettings({folder / "a.mmwave.json"}, "AWR1843").radar), toYaml(radar));
}

std::string section(const std::string& name, const std::vector<std::pair<std::string, std::string>>& values) {
  std::string text = "\t<apiname_" + name + "_cfg>\n";
  for (const auto& [key, value] : values) {
    text += "\t\t<param name=\"" + key + "\" value=\"" + value + "\" />\n";
  }
  return text + "\t</apiname_" + name + "_cfg>\n";
}

/// A file as mmWave Studio's Save() writes it, in the units of its windows.
std::string studioXml(const std::string& last_chirp = "0", const std::string& second_tx = "0",
                      const std::string& data_path = "1", const std::string& packet = "0") {
  return "\xEF\xBB\xBF<?xml version=\"1.0\" encoding=\"utf-8\" ?>\n<configuration>\n" +
         section("channel", {{"rx1En", "1"},
                             {"tx0En", "1"},
                             {"tx1En", "0"},
                             {"tx2En", "0"},
                             {"rx0En", "1"},
                             {"rx2En", "1"},
                             {"rx3En", "1"},
                             {"cascadeMode", "0"}}) +
         section("adc", {{"bitsVal", "2"}, {"formatVal", "1"}, {"IQSwap", "1"}}) +
         section("datapath", {{"dataPathCfgPath", data_path},
                              {"dataCfgFmt1", "0"},
                              {"pkt0VChannelNo", "0"},
                              {"pkt1VChannelNo", "0"},
                              {"dataCfgFmt0", packet}}) +
         section("lvdslane", {{"laneFormat", "0"},
                              {"lane1En", "1"},
                              {"lane2En", "1"},
                              {"lane3En", "1"},
                              {"lane4En", "1"},
                              {"lvdsMsbFirst", "1"}}) +
         section("profile", {{"pprofileId", "0"},
                             {"startFreqConst", "77.000000"},
                             {"idleTimeConst", "100.00"},
                             {"adcStartTimeConst", "6.00"},
                             {"rampEndTime", "60.00"},
                             {"tx1OutPowerBackoffCode", "3"},
                             {"tx2OutPowerBackoffCode", "0"},
                             {"tx1PhaseShifter", "0.000"},
                             {"freqSlopeConst", "29,982"},
                             {"txStartTime", "0.00"},
                             {"numAdcSamples", "256"},
                             {"digOutSampleRate", "10000"},
                             {"hpfCornerFreq1", "0"},
                             {"hpfCornerFreq2", "3"},
                             {"rxGain", "30"}}) +
         section("chirp", {{"chirpStartIdx", "0"},
                           {"chirpEndIdx", "0"},
                           {"cprofileId", "0"},
                           {"startFreqVar", "0.000"},
                           {"freqSlopeVar", "0.000"},
                           {"idleTimeVar", "0.00"},
                           {"adcStartTimeVar", "0.00"},
                           {"tx1Enable", "1"},
                           {"tx2Enable", second_tx},
                           {"tx3Enable", "0"}}) +
         section("frame", {{"fchirpStartIdx", "0"},
                           {"fchirpEndIdx", last_chirp},
                           {"frameCount", "8"},
                           {"loopCount", "128"},
                           {"periodicity", "40.000000"},
                           {"triggerDelay", "0"}}) +
         "</configuration>\n";
}

TEST(ImportSettings, StudioXml) {
  const TestFolder folder;
  write(folder / "a.xml", studioXml());
  const RadarConfig radar = importSettings({folder / "a.xml"}, "xwr1443").radar;
  EXPECT_EQ(radar.carrier_hz, 77e9);
  EXPECT_NEAR(radar.slope_hz_per_s, 29.982e12, 1);
  EXPECT_EQ(radar.idle_s, 100e-6);
  EXPECT_EQ(radar.adc_start_s, 6e-6);
  EXPECT_EQ(radar.ramp_end_s, 60e-6);
  EXPECT_EQ(radar.samples_per_chirp, 256);
  EXPECT_EQ(radar.sample_rate_hz, 10e6);
  EXPECT_EQ(radar.loops_per_frame, 128);
  EXPECT_EQ(radar.frame_period_s, 0.04);
  EXPECT_EQ(radar.rx_gain_db, 30);
  EXPECT_EQ(radar.tx_backoff_db, 3);
  EXPECT_EQ(radar.if_highpass_hz, (std::vector<double>{175e3, 2.8e6}));
  EXPECT_EQ(radar.tx_enable, (std::vector<std::vector<int>>{{0}}));
  EXPECT_EQ(radar.layout, CaptureLayout::kFourLane);
  EXPECT_EQ(radar.iq_order, IqOrder::kQi);
  for (const std::string& line : importSettings({folder / "a.xml"}, "xwr1443").assumed) {
    EXPECT_FALSE(contains(line, "ADC samples")) << line;  // the file says it
  }
  // The card's file may come beside it, and must not contradict it.
  write(folder / "cf.json", R"({"DCA1000Config": {"dataLoggingMode": "raw", "lvdsMode": 2, "dataFormatMode": 3}})");
  EXPECT_TRUE(saysInOneLine(inputError([&] {
                              importSettings({folder / "a.xml", folder / "cf.json"}, "xwr1443");
                            }),
                            "lanes is 2", "says 4"));
}

TEST(ImportSettings, StudioXmlKeepsTheLastChirpsOnly) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& text) {
    write(folder / "a.xml", text);
    return inputError([&] { importSettings({folder / "a.xml"}, "awr2243"); });
  };
  EXPECT_TRUE(saysInOneLine(refusal(studioXml("1")), "chirp 1", "not configured", "a.xml", "set last"));
  EXPECT_TRUE(saysInOneLine(refusal(studioXml("0", "1")), "mask 3"));
  EXPECT_TRUE(saysInOneLine(refusal("<configuration></configuration>"), "neither profile"));
  EXPECT_TRUE(saysInOneLine(refusal(studioXml("0", "0", "0")), "dataPathCfgPath is 0", "known is 1 (LVDS)", "JSON"));
  EXPECT_TRUE(saysInOneLine(refusal(studioXml("0", "0", "1", "3")), "dataCfgFmt0 is 3", "ADC samples only"));
  EXPECT_TRUE(saysInOneLine(refusal("<other/>"), "<configuration>"));
  EXPECT_TRUE(saysInOneLine(refusal("<configuration>"), "is no XML"));
}

/// Files that would once have kept the reader busy for ever, or used up its stack.
TEST(ImportSettings, ComesToAnEndWithHostileFiles) {
  const TestFolder folder;
  std::string names = "N0 = 1\n";
  for (int i = 1; i < 60; ++i) {
    const std::string before = "N" + std::to_string(i - 1);
    names += "N" + std::to_string(i) + " = " + before + " + " + before + " + " + before + "\n";
  }
  write(folder / "a.lua", names + "ar1.FrameConfig(0, 0, 8, N59, 40, 0, 1)\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.lua"}); }), "is no number"));
  write(folder / "b.lua", "ar1.FrameConfig(0, 0, 8, " + std::string(100000, '(') + "1, 40, 0, 1)\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "b.lua"}); }), "b.lua"));
  write(folder / "c.lua", "ar1.ChirpConfig(-2147483648, 4294967295, 0, 0, 0, 0, 0, 1, 0, 0)\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "c.lua"}); }), "0 to 511"));
  write(folder / "a.json", std::string(100000, '[') + std::string(100000, ']'));
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.json"}); }), "nested"));
  // Three files that name each other in a ring.
  for (const char* name : {"x", "y", "z"}) {
    const std::string next = name == std::string("x") ? "y" : name == std::string("y") ? "z" : "x";
    write(folder / (name + std::string(".json")), "{\"configUsed\": \"" + next + ".json\"}");
  }
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "x.json"}); }), "device"));
  EXPECT_TRUE(saysInOneLine(inputError([&] {
                              write(folder / "d.json", mmwaveJson("\\u001b[31m"));
                              importSettings({folder / "d.json"}, "awr1843");
                            }),
                            "laneEn"));
}

TEST(ImportSettings, RefusesWhatItDoesNotKnow) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& text) {
    write(folder / name, text);
    return inputError([&] { importSettings({folder / name}, name.back() == 'n' ? "awr1843" : ""); });
  };
  const auto lua = [&](const std::string& from, const std::string& to) {
    std::string text = script();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return refusal("a.lua", text.replace(at, from.size(), to));
  };
  EXPECT_TRUE(saysInOneLine(lua("77 -- GHz", "readFrequency()"), "a.lua:", "argument 2", "START_FREQ"));
  EXPECT_TRUE(saysInOneLine(lua("ADC_SAMPLES = 64", "ADC_SAMPLES = 64\nADC_SAMPLES = 128"), "several values"));
  EXPECT_TRUE(saysInOneLine(lua("0, 48)", "0)"), "17 arguments", "18"));
  EXPECT_TRUE(
      saysInOneLine(lua("ar1.ChirpConfig(1, 1, 0, 0", "ar1.ChirpConfig(1, 1, 0, 5"), "differs from its profile"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.ChirpConfig(1, 1, 0", "ar1.ChirpConfig(1, 1, 1"), "several profiles"));
  EXPECT_TRUE(saysInOneLine(lua("0, 0, 0, 1)\nar1.FrameConfig(0, 1", "0, 0, 1, 1)\nar1.FrameConfig(0, 1"), "mask 6"));
  EXPECT_TRUE(saysInOneLine(lua("FrameConfig(0, 1", "FrameConfig(0, 2"), "chirp 2", "not configured"));
  EXPECT_TRUE(saysInOneLine(lua("2, 1, 0)) then", "1, 1, 0)) then"), "16 bits"));
  EXPECT_TRUE(saysInOneLine(lua("2, 1, 0)) then", "2, 0, 0)) then"), "complex"));
  EXPECT_TRUE(saysInOneLine(lua("Mode(1, 1, 1", "Mode(1, 2, 1"), "lanes is 2", "says 4"));
  EXPECT_TRUE(saysInOneLine(lua("XWR2243", "XWR2944"), "xwr2944", "not known"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.FrameConfig(0, 1", "ar1.AdvancedFrameConfig(0, 1"), "AdvancedFrameConfig"));
  EXPECT_TRUE(saysInOneLine(refusal("b.json", mmwaveJson("0xF")), "4 LVDS lanes", "awr1843"));
  EXPECT_TRUE(saysInOneLine(refusal("b.json", mmwaveJson("0x3", "0x4", "advancedFrameChirp")), "advancedFrameChirp"));
  EXPECT_TRUE(saysInOneLine(refusal("b.json", "{\"other\": 1}"), "none of the known JSON files"));
  EXPECT_TRUE(saysInOneLine(refusal("b.json", "no json"), "is no JSON"));
  EXPECT_TRUE(saysInOneLine(refusal("b.ini", "[a]"), ".xml"));
  write(folder / "a.mmwave.json", mmwaveJson());
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.mmwave.json"}); }), "which device"));
  write(folder / "cf.json", R"({"DCA1000Config": {"dataLoggingMode": "raw", "lvdsMode": 1, "dataFormatMode": 3}})");
  EXPECT_TRUE(saysInOneLine(inputError([&] {
                              importSettings({folder / "a.mmwave.json", folder / "cf.json"}, "awr1843");
                            }),
                            "lanes is 4", "says 2"));
}

}  // namespace
}  // namespace mmradartwin
