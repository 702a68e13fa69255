// Settings of TI's tools, in the forms that people publish.
#include "mmradartwin_dsp/device_settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
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

TEST(ImportSettings, OtherAntennasAreRefused) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& device) {
    std::string lua = script();
    const std::string part = "ar1.SelectChipVersion(\"AR1243\")\nar1.deviceVariantSelection(\"XWR2243\")\n";
    write(folder / "a.lua", lua.erase(lua.find(part), part.size()));
    return inputError([&] { importSettings({folder / "a.lua"}, device); });
  };
  for (const char* device : {"iwr6843aop", "IWR6843AOPEVM", "awr6843-aop", "awr1843AOP", "iwr6843ods"}) {
    EXPECT_TRUE(saysInOneLine(refusal(device), "--device", "antennas", "give the positions", "tx_position_m"))
        << device;
  }
  for (const char* device : {"awr2243", "awr2243P", "awr2243boost", "AWR2243PBOOST"}) EXPECT_EQ(refusal(device), "");
}

TEST(ImportSettings, TheAdviceForOtherAntennasWorks) {
  const TestFolder folder;
  std::string setup = kSetup;
  write(folder / "a.mmwave.json", mmwaveJson());
  write(folder / "setup.json", setup.replace(setup.find("awr1843"), 7, "awr1843AOP"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "setup.json"}); }), "setup.json", "awr1843aop",
                            "--device awr1843,"));
  EXPECT_EQ(importSettings({folder / "setup.json"}, "awr1843").radar.device, "awr1843");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "setup.json"}, "awr6843"); }), "awr1843aop",
                            "--device says awr6843"));
}

TEST(ImportSettings, ARaisedTransmitterIsLeftOutOfTheAngleTransform) {
  const TestFolder folder;
  std::string lua = script(
      "ar1.ChirpConfig(0, 0, 0, 0, 0, 0, 0, 1, 0, 0)\n"
      "ar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 1, 0)\n"
      "ar1.ChirpConfig(2, 2, 0, 0, 0, 0, 0, 0, 0, 1)\n");
  const std::string frame = "ar1.FrameConfig(0, 1, 200";
  write(folder / "a.lua", lua.replace(lua.find(frame), frame.size(), "ar1.FrameConfig(0, 2, 200"));
  const ImportedSettings settings = importSettings({folder / "a.lua"});
  EXPECT_EQ(settings.radar.angle_slots, (std::vector<int>{0, 2}));
  EXPECT_NEAR(settings.radar.virtual_pitch_m(), 299792458.0 / 77e9 / 2, 1e-7);
  EXPECT_TRUE(contains(toYaml(settings), "# - angle_slots"));
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
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.lua"}); }), "a.lua:61", "whole number"));
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

/// A script in which the part decides, as TI's own do, and of which only a part is ever run.
std::string scriptOfParts(const std::string& part, const std::string& end = "") {
  return "--[==[ a comment ]] that goes on\nar1.ProfileConfig(0, 1) ]==]\n" + part +
         "function unused()\n  ar1.ProfileConfig(0, 76, 9, 9, 90, 0, 0, 0, 0, 0, 0, 9, 0, 128, 9000, 0, 0, 30)\n"
         "  ar1.FrameConfig(0, 2, 8, 99, 77, 0, 1)\nend\n"
         "local path = \"C:\\ti\\mmwave_studio\" .. RSTD.GetRstdPath() .. os.date(\"%Y\")\n"
         "if (0 ~= ar1.PowerOn(1, 1000, 0, 0)) then WriteToLog(\"failed\", \"red\") return end\n"
         "ar1.ChanNAdcConfig(1, 1, 1, 1, 1, 1, 1, 2, 1, 0)\nar1.DataPathConfig(513, 1216644097, 0)\n"
         "local four = part == 1243 or part == 1443 or part == 2243\n"
         "ar1.LVDSLaneConfig(0, 1, 1, four and 1 or 0, four and 1 or 0, 1, 0, 0)\n"
         "local rate = four and 10000 or 5000\n"
         "if part == 6843 then start = 60.25 else start = 77 end\n"
         "ar1.ProfileConfig(0, start, 100, 6, 60, 0, 0, 0, 0, 0, 0, 29.982, 0, 256, rate, 0, 0, 30)\n"
         "for chirp = 0, 1 do\n  local tx = {chirp == 0 and 1 or 0, 0, chirp}\n"
         "  ar1.ChirpConfig(chirp, chirp, 0, 0, 0, 0, 0, unpack(tx))\nend\n"
         "local begin = os.clock()\nrepeat RSTD.Sleep(1) until os.clock() - begin > 3\n"
         "ar1.FrameConfig(0, 1, 8, math.pow(2, 5), 40, 0, 1)\n" +
         end;
}

const char kFuses[] =
    "local _, fuses = ar1.ReadRegister(0xFFFFE214, 0, 31)\n"
    "local code = bit_rshift(bit_and(fuses, 0x03FC0000), 18)\n"
    "part = code == 0x20 and 1243 or code == 0xA0 and 1443 or code == 0x60 and 1642 or code == 0x70 and 1843\n"
    "  or code == 0xE1 and 6843 or (code == 0x31 or code == 0x32) and 2243 or 0\n";

TEST(ImportLua, PartDecidesTheBranch) {
  const TestFolder folder;
  const std::vector<std::string> questions = {
      kFuses,
      "local _, fuses = ar1.ReadRegister(0xFFFFE214, 18, 25)\n"
      "part = fuses == 0x30 and 2243 or (fuses == 0xE2 or fuses == 0xE4) and 6843 or 0\n",
      "part = ar1.partNumber\n",
      "part = ar1.GetPartNumber()\n",
      "part = tonumber(partId)\n",
      "local lanes = {awr2243 = 4, iwr6843 = 2}\n"
      "part = chip == nil and 0 or lanes[DEVICE_TYPE] == 4 and 2243 - 0 or 6840 + 3\n",
      "part = radarType == \"xWR22xx\" and 2200 + 43 or radarType == \"xWR68xx\" and 6800 + 43 or 0\n",
      "local name = ar1.getDeviceName()\npart = name == \"AWR2243\" and 2243 or name == \"IWR6843\" and 6843 or "
      "name == \"AWR1843\" and 1843 or 0\n"};
  for (const std::string& question : questions) {
    write(folder / "a.lua", scriptOfParts(question));
    SCOPED_TRACE(question);
    const RadarConfig four = importSettings({folder / "a.lua"}, "awr2243").radar;
    EXPECT_EQ(four.layout, CaptureLayout::kFourLane);
    EXPECT_EQ(four.sample_rate_hz, 10e6);
    EXPECT_EQ(four.carrier_hz, 77e9);
    EXPECT_EQ(four.loops_per_frame, 32);
    EXPECT_EQ(four.frame_period_s, 0.04);
    EXPECT_EQ(four.tx_enable, (std::vector<std::vector<int>>{{0}, {2}}));
    const RadarConfig sixty = importSettings({folder / "a.lua"}, "iwr6843").radar;
    EXPECT_EQ(sixty.layout, CaptureLayout::kTwoLane);
    EXPECT_EQ(sixty.carrier_hz, 60.25e9);
    EXPECT_EQ(sixty.sample_rate_hz, 5e6);
    EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.lua"}); }), "a.lua:", "--device"));
  }
  // What the script itself chooses later is known as well, and so is what another file says.
  write(folder / "a.lua", scriptOfParts(kFuses, "ar1.deviceVariantSelection(\"XWR1843\")\n"));
  EXPECT_EQ(importSettings({folder / "a.lua"}).radar.layout, CaptureLayout::kTwoLane);
  EXPECT_EQ(importSettings({folder / "a.lua"}, "iwr1843").radar.device, "iwr1843");
  write(folder / "a.lua", scriptOfParts(kFuses, "ar1.deviceVariantSelection(\"XWR6843AOP\")\n"));
  EXPECT_EQ(importSettings({folder / "a.lua"}, "iwr6843").radar.device, "iwr6843");
  write(folder / "a.lua", scriptOfParts(kFuses));
  write(folder / "other.json", R"({"mmWaveDevice": "awr1443", "DCA1000Config": {"lvdsMode": 1}})");
  EXPECT_EQ(importSettings({folder / "a.lua", folder / "other.json"}).radar.sample_rate_hz, 10e6);
  EXPECT_TRUE(saysInOneLine(inputError([&] {
                              importSettings({folder / "a.lua", folder / "other.json"}, "awr1843");
                            }),
                            "awr1443", "--device"));
}

TEST(ImportLua, NamesBothOfTwoCallsThatContradict) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& end) {
    write(folder / "a.lua", scriptOfParts("part = 2243\n", end));
    return inputError([&] { importSettings({folder / "a.lua"}, "awr2243"); });
  };
  const std::string profile = "ar1.ProfileConfig(0, 77, 100, 6, 60, 0, 0, 0, 0, 0, 0, 29.982, 0, ";
  EXPECT_EQ(refusal(profile + "256, 10000, 0, 0, 30)\nar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 0, 1)\n"), "");
  EXPECT_TRUE(saysInOneLine(refusal(profile + "128, 10000, 0, 0, 30)\n"), "a.lua:24", "number of samples is 128",
                            "a.lua:16 says 256"));
  EXPECT_TRUE(
      saysInOneLine(refusal("ar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 1, 0)\n"), "a.lua:24", "chirp 1", "a.lua:19"));
  EXPECT_TRUE(saysInOneLine(refusal("ar1.FrameConfig(0, 1, 8, 64, 40, 0, 1)\n"), "a.lua:24", "loops is 64",
                            "a.lua:23 says 32"));
  // Chirps that no frame has do no harm; a function's line is told with the line that called it.
  EXPECT_EQ(refusal("ar1.ChirpConfig(2, 2, 0, 0, 0, 0, 0, 0, 1, 0)\nar1.ChirpConfig(2, 2, 0, 0, 0, 0, 0, 1, 0, 0)\n"),
            "");
  EXPECT_TRUE(saysInOneLine(refusal("local function set(n)\n  ar1.FrameConfig(0, 1, 8, n, 40, 0, 1)\nend\nset(64)\n"),
                            "a.lua:25 (called from line 27)", "loops is 64"));
}

TEST(ImportLua, RefusesWhatOnlyStudioCanAnswer) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& end) {
    write(folder / "a.lua", scriptOfParts("part = 2243\n", end));
    return inputError([&] { importSettings({folder / "a.lua"}, "awr2243"); });
  };
  EXPECT_TRUE(saysInOneLine(refusal("ar1.ChirpConfig(1, 1, 0, io.read(\"*n\") + 1, 0, 0, 0, 0, 0, 1)\n"), "a.lua:24",
                            "argument 4", "read()"));
  EXPECT_TRUE(saysInOneLine(refusal("if temperature() > 50 then ar1.FrameConfig(0, 1, 8, 64, 40, 0, 1) end\n"),
                            "temperature()", "a.lua:24"));
  EXPECT_TRUE(saysInOneLine(refusal("if askUser() == 0 then ar1.FrameConfig(0, 0, 8, 32, 40, 0, 1) end\n"), "askUser()",
                            "a.lua:24"));
  EXPECT_TRUE(saysInOneLine(refusal("ar1.FrameConfig(0, 1, 8, \"many\", 40, 0, 1)\n"), "argument 4", "'many'"));
  EXPECT_TRUE(saysInOneLine(refusal("ar1.FrameConfig(0, 1, 8, LOOPS, 40, 0, 1)\n"), "argument 4", "'nil'"));
  EXPECT_TRUE(saysInOneLine(refusal("ar1.FrameConfig(0, 1, 8, LOOPS * 2, 40, 0, 1)\n"), "a.lua:24", "LOOPS"));
  EXPECT_TRUE(saysInOneLine(refusal("error(\"no card\")\n"), "a.lua:24", "no card"));
  EXPECT_TRUE(saysInOneLine(refusal("x = = 1\n"), "a.lua:24", "is no Lua"));
  // Names that are not there are asked for as Lua's own defaults; what is left after os.exit() is not run.
  EXPECT_EQ(refusal("LOOPS = LOOPS or 32\nar1.FrameConfig(0, 1, 8, LOOPS, 40, 0, 1)\n"), "");
  EXPECT_EQ(refusal("os.exit()\nar1.FrameConfig(0, 1, 8, 64, 40, 0, 1)\n"), "");
  EXPECT_EQ(refusal("local now = require\"socket\".gettime()\nos.execute(\"mkdir \" .. os.date(\"%Y\", now))\n"
                    "local f = assert(io.open(path .. now))\nf:write(now)\n"),
            "");
  EXPECT_EQ(refusal("local f = io.open(path, \"w\")\nfor line in f:lines() do print(#line) end\nf:close()\n"), "");
  write(folder / "a.lua", scriptOfParts("part = 2243\n", "dofile(\"C:\\\\more\\nlines.lua\")\n"));
  const ImportedSettings noted = importSettings({folder / "a.lua"}, "awr2243");
  EXPECT_TRUE(saysInOneLine(noted.assumed.back(), "a.lua:24", "lines.lua", "not run"));
  EXPECT_EQ(toYaml(parseRadarConfig(toYaml(noted), "a.yaml")), toYaml(noted.radar));
  write(folder / "a.lua", "function main()\n" + script() + "end\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "a.lua"}); }), "no ar1.* call"));
}

TEST(ImportLua, HostileScriptsEnd) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& text) {
    write(folder / "a.lua", text + "\nar1.FrameConfig(0, 1, 8, 64, 40, 0, 1)\n");
    return inputError([&] { importSettings({folder / "a.lua"}, "awr2243"); });
  };
  const std::string steps = "million steps", bytes = " MB";
  EXPECT_TRUE(saysInOneLine(refusal("while true do end"), "a.lua:1", steps));
  EXPECT_TRUE(saysInOneLine(refusal("function f() while true do pcall(f) end end\nwhile true do pcall(f) end"), steps));
  EXPECT_TRUE(saysInOneLine(refusal("local s = string.rep('a', 5000)\nstring.find(s, '.-.-.-.-.-.-b')"), steps));
  EXPECT_TRUE(saysInOneLine(refusal("for word in range(1, 3) do end"), steps));
  EXPECT_TRUE(saysInOneLine(refusal("local t = {}\nwhile true do t[#t + 1] = {} end"), bytes));
  EXPECT_TRUE(saysInOneLine(refusal("local s = string.rep('a', 1e9)"), bytes));
  EXPECT_TRUE(saysInOneLine(refusal("setmetatable({}, {__gc = function() while true do end end})"), "__gc"));
  EXPECT_TRUE(saysInOneLine(refusal("for i = 1, 1e6 do ar1.GetStatus() end"), "too many calls"));
  EXPECT_TRUE(saysInOneLine(refusal("local function f() return 1 + f() end f()"), bytes));
  EXPECT_TRUE(saysInOneLine(refusal("\x1bLua"), "a.lua"));
  // Nothing of the machine can be reached.
  EXPECT_TRUE(saysInOneLine(
      refusal("io.open('" + folder / "made" + "', 'w'):write('x')\nos.execute('touch " + folder / "made" + "')"),
      "chirp 0"));
  EXPECT_FALSE(std::filesystem::exists(folder / "made"));
}

TEST(ImportSettings, WaveformsBeyondTdmAreNamed) {
  const TestFolder folder;
  const auto json = [&](const std::string& from, const std::string& to) {
    std::string text = mmwaveJson();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write(folder / "a.json", text.replace(at, from.size(), to));
    return inputError([&] { importSettings({folder / "a.json"}, "awr1843"); });
  };
  const std::string frame = "\"rlFrameCfg_t\"";
  const auto with = [&](const std::string& entry) { return json(frame, entry + ", " + frame); };
  // As Studio writes them where nothing of this is used.
  EXPECT_EQ(with(R"("rlBpmChirps": [], "rlRfPhaseShiftCfgs": [], "rlDynPerChirpPhShftCfgs": [], "rlDynChirpCfgs": [],
      "rlLoopbackBursts": [], "rlRfMiscConf_t": {"miscCtl": "1"})"),
            "");
  EXPECT_EQ(with(R"("rlRfPhaseShiftCfgs": [{"rlRfPhaseShiftCfg_t": {"chirpStartIdx": 1, "chirpEndIdx": 1,
      "tx0PhaseShift": 0, "tx1PhaseShift": 0, "tx2PhaseShift": 0}}])"),
            "");
  EXPECT_TRUE(saysInOneLine(with(R"("rlBpmChirps": [{"rlBpmChirpCfg_t": {"chirpStartIdx": 1, "chirpEndIdx": 1,
      "constBpmVal": "0xC"}}])"),
                            "rlBpmChirps", "BPM", "TDM"));
  EXPECT_TRUE(saysInOneLine(with(R"("rlRfPhaseShiftCfgs": [{"rlRfPhaseShiftCfg_t": {"chirpStartIdx": 0,
      "chirpEndIdx": 1, "tx0PhaseShift": 0, "tx1PhaseShift": 0, "tx2PhaseShift": 16}}])"),
                            "rlRfPhaseShiftCfgs", "phases are shifted by chirp", "DDMA"));
  EXPECT_TRUE(saysInOneLine(with(R"("rlDynPerChirpPhShftCfgs": [{"rlDynPerChirpPhShftCfg_t": {"chirpSegSel": 0,
      "phShiftPerTx": [{"tx0PhaseShift": [0, 0, 3]}]}}])"),
                            "rlDynPerChirpPhShftCfgs"));
  EXPECT_TRUE(saysInOneLine(with(R"("rlDynChirpCfgs": [{"rlDynChirpCfg_t": {"chirpSegSel": 0}}])"), "rlDynChirpCfgs"));
  EXPECT_TRUE(saysInOneLine(json("\"TDM\"", "\"DDMA\""), "MIMOScheme", "DDMA"));
  EXPECT_TRUE(saysInOneLine(json("\"TDM\"", "\"BPM\""), "MIMOScheme", "BPM"));
  EXPECT_TRUE(saysInOneLine(json("\"transferFmtPkt1\": \"0x0\"", "\"transferFmtPkt1\": \"0xE\""), "transferFmtPkt1",
                            "second packet"));
  EXPECT_TRUE(saysInOneLine(json("\"transferFmtPkt0\": \"0x1\"", "\"transferFmtPkt0\": \"0x6\""), "transferFmtPkt0"));
  EXPECT_EQ(json("\"b2AdcOutFmt\": 1", "\"b2AdcOutFmt\": 2"), "");
  const ImportedSettings twice = importSettings({folder / "a.json"}, "awr1843");
  EXPECT_TRUE(std::any_of(twice.assumed.begin(), twice.assumed.end(), [](const std::string& line) {
    return contains(line, "complex 2x") && contains(line, "beyond N/2 hold no echo");
  }));
  // The same in a script.
  const auto lua = [&](const std::string& call) {
    write(folder / "a.lua", script() + call + "\n");
    return inputError([&] { importSettings({folder / "a.lua"}); });
  };
  EXPECT_EQ(lua("ar1.BpmChirpConfig(0, 1, 0, 0, 0, 0, 0, 0)\nar1.SetPerChirpPhaseShifterConfig(0, 1, 0, 0, nil)"), "");
  EXPECT_TRUE(saysInOneLine(lua("ar1.BpmChirpConfig(1, 1, 0, 0, 1, 1, 0, 0)"), "a.lua:21", "BpmChirpConfig", "BPM"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.SetPerChirpPhaseShifterConfig(0, 0, 0, 32, 0)"), "SetPerChirpPhaseShifterConfig"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.AdvChirpConfig(0, 0, 0, 0, 0, 0, 0, 0, 4, 1, 0, 4, 0, 0, 0, 0, 0)"), "AdvChirp"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.AdvanceFrameConfig(4, 1536, 0, 0)"), "AdvanceFrameConfig"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.ContStrConfig(77, 9000, 94, 0)"), "ContStrConfig"));
  EXPECT_TRUE(saysInOneLine(lua("ar1.ProfileConfig_mult(1, 0, 77)"), "ProfileConfig_mult", "several devices"));
}

/// As TI's visualizer saves it.
std::string profileCfg(const std::string& platform = "% Platform:xWR18xx\n") {
  return "% *****************************************\r\n% Created for SDK ver:03.05\n" + platform +
         "% Frequency:77\nsensorStop\nflushCfg\ndfeDataOutputMode 1\nchannelCfg 15 5 0\nadcCfg 2 1\n"
         "adcbufCfg -1 0 1 1 1\nprofileCfg 0 77 267 7 57.14 0 0 70 1 256 5209 0 0 158\n"
         "chirpCfg 0 0 0 0 0 0 0 1\nchirpCfg 1 1 0 0 0 0 0 4   % the third transmitter\n"
         "frameCfg 0 1 16 0 33.333 1 0\nlowPower 0 0\nguiMonitor -1 1 1 0 0 0 1\ncfarCfg -1 0 2 8 4 3 0 15 1\n"
         "bpmCfg -1 0 0 1\nlvdsStreamCfg -1 0 1 0\nsensorStart\n";
}

TEST(ImportSdk, ProfileCfg) {
  const TestFolder folder;
  write(folder / "best_range.txt", profileCfg());
  const ImportedSettings settings = importSettings({folder / "best_range.txt"}, "iwr1843");
  const RadarConfig& radar = settings.radar;
  EXPECT_EQ(radar.device, "iwr1843");
  EXPECT_EQ(radar.carrier_hz, 77e9);
  EXPECT_EQ(radar.slope_hz_per_s, 70e12);
  EXPECT_EQ(radar.samples_per_chirp, 256);
  EXPECT_EQ(radar.sample_rate_hz, 5.209e6);
  EXPECT_EQ(radar.adc_start_s, 7e-6);
  EXPECT_EQ(radar.idle_s, 267e-6);
  EXPECT_NEAR(radar.ramp_end_s, 57.14e-6, 1e-12);
  EXPECT_EQ(radar.loops_per_frame, 16);
  EXPECT_NEAR(radar.frame_period_s, 33.333e-3, 1e-9);
  EXPECT_EQ(radar.rx_gain_db, 30);
  EXPECT_EQ(radar.tx_enable, (std::vector<std::vector<int>>{{0}, {2}}));
  EXPECT_EQ(radar.rx_enable, (std::vector<int>{0, 1, 2, 3}));
  EXPECT_EQ(radar.layout, CaptureLayout::kTwoLane);
  EXPECT_EQ(radar.iq_order, IqOrder::kQi);
  // The comment names the family where nothing else names the device.
  EXPECT_EQ(importSettings({folder / "best_range.txt"}).radar.device, "xwr1843");
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "best_range.txt"}, "iwr6843"); }), "xwr1843",
                            "--device says iwr6843"));
  write(folder / "best_range.txt", profileCfg(""));
  EXPECT_TRUE(saysInOneLine(inputError([&] { importSettings({folder / "best_range.txt"}); }), "which device"));
  // What stands before a later flushCfg does not hold.
  write(folder / "two.cfg", profileCfg() +
                                "flushCfg\nprofileCfg 0 78 267 7 57.14 0 0 60 1 128 5209 0 0 30\n"
                                "chirpCfg 0 0 0 0 0 0 0 2\nframeCfg 0 0 32 0 50 1 0\n");
  EXPECT_EQ(importSettings({folder / "two.cfg"}).radar.carrier_hz, 78e9);
  EXPECT_EQ(importSettings({folder / "two.cfg"}).radar.tx_enable, (std::vector<std::vector<int>>{{1}}));
  // Four lanes, interleaved, and the older form of adcbufCfg.
  std::string older = profileCfg("% Platform:xWR14xx\n");
  older.replace(older.find("adcbufCfg -1 0 1 1 1"), 20, "adcbufCfg 0 0 0 1");
  older.replace(older.find("lvdsStreamCfg -1 0 1 0\n"), 23, "");
  write(folder / "older.cfg", older);
  const RadarConfig four = importSettings({folder / "older.cfg"}).radar;
  EXPECT_EQ(four.layout, CaptureLayout::kFourLane);
  EXPECT_EQ(four.iq_order, IqOrder::kIq);
}

TEST(ImportSdk, RefusesWhatIsNotTdm) {
  const TestFolder folder;
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = profileCfg();
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    write(folder / "profile.cfg", text.replace(at, from.size(), to));
    return inputError([&] { importSettings({folder / "profile.cfg"}); });
  };
  EXPECT_TRUE(saysInOneLine(refusal("bpmCfg -1 0", "bpmCfg -1 1"), "profile.cfg:18", "bpmCfg", "BPM", "TDM"));
  EXPECT_TRUE(saysInOneLine(refusal("dfeDataOutputMode 1", "dfeDataOutputMode 3"), "advanced frames"));
  EXPECT_TRUE(saysInOneLine(refusal("frameCfg 0 1 16 0 33.333 1 0", "advFrameCfg 2 0 0 1 0"), "advFrameCfg"));
  EXPECT_TRUE(saysInOneLine(refusal("adcCfg 2 1", "adcCfg 2 0"), "profile.cfg:9", "complex"));
  EXPECT_TRUE(saysInOneLine(refusal("adcCfg 2 1", "adcCfg 1 1"), "16 bits"));
  EXPECT_TRUE(saysInOneLine(refusal("adcbufCfg -1 0", "adcbufCfg -1 1"), "adcbufCfg", "real"));
  EXPECT_TRUE(saysInOneLine(refusal("1 256 5209 0 0 158", "1 256 5209 0 0"), "profileCfg has 13 arguments"));
  EXPECT_TRUE(saysInOneLine(refusal("57.14 0 0 70", "57.14 0 4 70"), "profileCfg", "phases"));
  EXPECT_TRUE(saysInOneLine(refusal("chirpCfg 1 1 0 0 0 0 0 4", "chirpCfg 1 1 0 0 0 2 0 4"), "chirpCfg", "differs"));
  EXPECT_TRUE(
      saysInOneLine(refusal("chirpCfg 1 1 0 0 0 0 0 4", "chirpCfg 1 1 0 0 0 0 0 5"), "profile.cfg:13", "mask 5"));
  EXPECT_TRUE(saysInOneLine(refusal("chirpCfg 1 1 0 0 0 0 0 4", "chirpCfg 0 1 0 0 0 0 0 4"), "profile.cfg:13",
                            "profile.cfg:12"));
  EXPECT_TRUE(saysInOneLine(refusal("lvdsStreamCfg -1 0 1 0", "lvdsStreamCfg -1 0 4 0"), "lvdsStreamCfg"));
  EXPECT_TRUE(saysInOneLine(refusal("lvdsStreamCfg -1 0 1 0", "lvdsStreamCfg -1 0 1 1"), "lvdsStreamCfg"));
  EXPECT_TRUE(saysInOneLine(refusal("channelCfg 15 5 0", "channelCfg 15 5 1"), "cascade"));
  EXPECT_TRUE(saysInOneLine(refusal("frameCfg 0 1 16", "frameCfg 0 1 many"), "'many'"));
  EXPECT_TRUE(saysInOneLine(refusal("adcCfg 2 1", "chirpComnCfg 8 0 0 256 4 28 0"), "chirpComnCfg", "xWRL6432"));
  EXPECT_EQ(refusal("lvdsStreamCfg -1 0 1 0", "lvdsStreamCfg -1 0 0 0"), "");
  EXPECT_TRUE(contains(importSettings({folder / "profile.cfg"}).assumed.back(), "no ADC samples"));
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
  EXPECT_TRUE(saysInOneLine(lua("77 -- GHz", "readFrequency()"), "a.lua:15", "argument 2", "readFrequency()"));
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
  EXPECT_TRUE(saysInOneLine(refusal("b.ini", "[a]"), ".xml", "profile.cfg"));
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
