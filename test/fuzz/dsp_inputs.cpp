#include "hostile_input.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/device_settings.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"

namespace mmradartwin {
namespace {

const char kRadar[] =
    "device: awr2243\ncarrier_hz: 77.0e+9\nslope_hz_per_s: 75.0e+12\nsamples_per_chirp: 8\nsample_rate_hz: 5.0e+6\n"
    "adc_start_s: 6.0e-6\nloops_per_frame: 1\nframe_period_s: 0.05\n"
    "tx_position_m: [[0, 0, 0], [0, 0.0077867, 0]]\n"
    "rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]\n";
const char kOptional[] =
    "idle_s: 7.0e-6\nramp_end_s: 20.0e-6\nrx_gain_db: 48\ntx_backoff_db: 0\nif_highpass_hz: [175.0e+3, 350.0e+3]\n"
    "layout: 2lane\niq_order: qi\ntx_enable: [[0], [2]]\nrx_enable: [0, 1, 2, 3]\n";
const char kSession[] =
    "format: mmradartwin_session/1\nradar: radar.yaml\nscene: scene.yaml\nposes: poses.csv\n"
    "captures: captures/{pose}.bin\ngain_db: -6\n";
const char kPoses[] =
    "pose,location,stamp,x,y,z,qx,qy,qz,qw\n000,a,1700000000.25,1,2,1.1,0,0,0,1\n001,b,1700000001,1,2,1.1,0,0,1,0\n";

void readRadar(const std::string& bytes) {
  refusing([&] {
    const RadarConfig radar = parseRadarConfig(bytes, "radar.yaml");
    const std::string yaml = toYaml(radar);
    if (toYaml(parseRadarConfig(yaml, "again.yaml")) != yaml) throw std::logic_error("radar.yaml reads back different");
  });
}

/// session.yaml, then, behind a line of dashes, poses.csv.
void readSession(const std::string& bytes) {
  const std::size_t cut = bytes.find("\n-----\n");
  const std::string folder = inputFolder();
  writeInput(folder + "/radar.yaml", kRadar);
  writeInput(folder + "/session.yaml", bytes.substr(0, cut));
  writeInput(folder + "/poses.csv", cut == std::string::npos ? kPoses : bytes.substr(cut + 7));
  refusing([&] {
    SessionOptions options;
    options.need_captures = bytes.size() % 2 != 0;
    openSession(folder, options);
  });
  refusing([&] { gatherSessionFiles(folder); });
}

/// Three bytes of radar, the rest the capture.
void readCapture(const std::string& bytes) {
  if (bytes.size() < 3) return;
  RadarConfig radar = parseRadarConfig(kRadar, "radar.yaml");
  radar.layout = bytes[0] & 1 ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  radar.iq_order = bytes[0] & 2 ? IqOrder::kQi : IqOrder::kIq;
  radar.rx_position_m.resize(1 + (bytes[1] & 3));
  radar.tx_position_m.resize(1 + (bytes[1] >> 2 & 1));
  radar.samples_per_chirp = 2 * (1 + (bytes[2] & 15));
  const std::string file = inputFolder() + "/capture.bin";
  writeInput(file, bytes.substr(3));
  refusing([&] {
    const CaptureReader reader(radar, file);
    for (int i = 0; i < reader.frames(); ++i) {
      const AdcCube cube = reader.frame(i, 0);
      const bool all_lanes = radar.capture_receivers() == radar.receivers();
      if (all_lanes && encodeFrame(radar, cube.data) != reader.bytes(i)) {
        throw std::logic_error("a frame is not written as it was read");
      }
    }
  });
}

std::function<void(const std::string&)> settings(const std::string& extension) {
  return [extension](const std::string& bytes) {
    const std::string file = inputFolder() + "/settings" + extension;
    writeInput(file, bytes);
    refusing([&] { toYaml(importSettings({file}, bytes.size() % 2 ? "awr2243" : "iwr1843")); });
  };
}

std::string captureSeed(char layout, char antennas, char samples, std::size_t size) {
  std::string bytes = {layout, antennas, samples};
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(i * 7);
  return bytes;
}

const char kLua[] =
    "ar1.deviceVariantSelection(\"XWR2243\")\nADC = 64 -- samples\n"
    "if (0 == ar1.ChanNAdcConfig(1, 1, 1, 1, 1, 1, 1, 2, 1, 0)) then WriteToLog(\"ok\") end\n"
    "ar1.DataPathConfig(513, 1216644097, 0)\nar1.LVDSLaneConfig(0, 1, 1, 1, 1, 1, 0, 0)\n"
    "ar1.ProfileConfig(0, 77, 7, 6, 20, 0, 0, 0, 0, 0, 0, 75, 0, ADC, 5000, 0, 0, 48)\n"
    "ar1.ChirpConfig(0, 0, 0, 0, 0, 0, 0, 1, 0, 0)\nar1.ChirpConfig(1, 1, 0, 0, 0, 0, 0, 0, 0, 1)\n"
    "ar1.FrameConfig(0, 1, 200, 2*(8+1), 50, 0, 1)\nar1.CaptureCardConfig_Mode(1, 1, 1, 2, 3, 30)\n";
const char kLuaParts[] =
    "local _, fuses = ar1.ReadRegister(0xFFFFE214, 0, 31)\nlocal part = bit_rshift(fuses, 18) == 0x31 and 2243 or "
    "1843\n"
    "for i = 0, 1 do ar1.ChirpConfig(i, i, 0, 0, 0, 0, 0, 1 - i, 0, i) end\n"
    "local path = string.gsub(debug.getinfo(1, 'S').source, \"(.-)%.lua\", \"%1\") .. os.date()\n"
    "if ar1.partNumber ~= part then error(\"other\") end\nrepeat pcall(sleep, 1) until os.clock() > temperature()\n";
const char kSdk[] =
    "% Platform:xWR18xx\nsensorStop\nflushCfg\ndfeDataOutputMode 1\nchannelCfg 15 5 0\nadcCfg 2 1\n"
    "adcbufCfg -1 0 1 1 1\nprofileCfg 0 77 267 7 57.14 0 0 70 1 256 5209 0 0 30\nchirpCfg 0 0 0 0 0 0 0 1\n"
    "chirpCfg 1 1 0 0 0 0 0 4\nframeCfg 0 1 16 0 100 1 0\nbpmCfg -1 0 0 1\nlvdsStreamCfg -1 0 1 0\nsensorStart\n";
const char kJson[] = R"({"mmWaveDevices": [{"rfConfig": {"waveformType": "legacyFrameChirp",
 "rlChanCfg_t": {"rxChannelEn": "0xF"}, "rlAdcOutCfg_t": {"fmt": {"b2AdcBits": 2, "b2AdcOutFmt": 1}},
 "rlProfiles": [{"rlProfileCfg_t": {"profileId": 0, "startFreqConst_GHz": 77.0, "idleTimeConst_usec": 100.0,
  "adcStartTimeConst_usec": 6.0, "rampEndTime_usec": 60.0, "freqSlopeConst_MHz_usec": 29.98, "numAdcSamples": 256,
  "digOutSampleRate": 10000.0, "hpfCornerFreq1": 0, "hpfCornerFreq2": 0, "rxGain_dB": "0x1E"}}],
 "rlChirps": [{"rlChirpCfg_t": {"chirpStartIdx": 0, "chirpEndIdx": 0, "profileId": 0, "txEnable": "0x1"}}],
 "rlFrameCfg_t": {"chirpStartIdx": 0, "chirpEndIdx": 0, "numLoops": 32, "framePeriodicity_msec": 40.0}},
 "rawDataCaptureConfig": {"rlDevDataFmtCfg_t": {"iqSwapSel": 0, "chInterleave": 1},
  "rlDevDataPathCfg_t": {"intfSel": 1, "transferFmtPkt0": "0x1"}, "rlDevLaneEnable_t": {"laneEn": "0x3"}}}]})";
const char kCard[] =
    R"({"DCA1000Config": {"dataLoggingMode": "raw", "lvdsMode": 1, "dataFormatMode": 3, "packetDelay_us": 25}})";
const char kXml[] = R"(<?xml version="1.0" encoding="utf-8" ?><configuration>
<apiname_channel_cfg><param name="rx0En" value="1" /><param name="rx1En" value="1" /><param name="rx2En" value="1" />
<param name="rx3En" value="1" /></apiname_channel_cfg><apiname_adc_cfg><param name="bitsVal" value="2" />
<param name="formatVal" value="1" /><param name="IQSwap" value="0" /></apiname_adc_cfg>
<apiname_lvdslane_cfg><param name="laneFormat" value="0" /><param name="lane1En" value="1" />
<param name="lane2En" value="1" /><param name="lane3En" value="1" /><param name="lane4En" value="1" />
</apiname_lvdslane_cfg><apiname_profile_cfg><param name="pprofileId" value="0" />
<param name="startFreqConst" value="77.0" /><param name="idleTimeConst" value="100.00" />
<param name="adcStartTimeConst" value="6.00" /><param name="rampEndTime" value="60.00" />
<param name="freqSlopeConst" value="29.982" /><param name="numAdcSamples" value="256" />
<param name="digOutSampleRate" value="10000" /><param name="hpfCornerFreq1" value="0" />
<param name="hpfCornerFreq2" value="0" /><param name="rxGain" value="30" /></apiname_profile_cfg>
<apiname_chirp_cfg><param name="chirpStartIdx" value="0" /><param name="chirpEndIdx" value="0" />
<param name="cprofileId" value="0" /><param name="tx1Enable" value="1" /><param name="tx2Enable" value="0" />
<param name="tx3Enable" value="0" /></apiname_chirp_cfg><apiname_frame_cfg>
<param name="fchirpStartIdx" value="0" /><param name="fchirpEndIdx" value="0" /><param name="loopCount" value="128" />
<param name="periodicity" value="40.0" /></apiname_frame_cfg></configuration>)";

}  // namespace

std::vector<HostileInput> hostileInputs() {
  const std::string session = kSession, separator = "\n-----\n";
  return {
      {"radar_yaml", readRadar, {kRadar, std::string(kRadar) + kOptional, ", a: 1", "a: 1\n]\n,", "a: &x [*x]"}},
      {"session", readSession, {session, session + separator + kPoses, "format: [", session + separator + "\xff"}},
      {"capture",
       readCapture,
       {captureSeed(0, 7, 3, 1024), captureSeed(1, 7, 3, 1024), captureSeed(2, 4, 1, 256), captureSeed(3, 0, 15, 300)}},
      {"settings_lua", settings(".lua"), {kLua, kLuaParts, "A = B + B\nB = A + A\nar1.FrameConfig(0, A, 8, 1, 40, 0)"}},
      {"settings_json", settings(".json"), {kJson, kCard, R"({"configUsed": "settings.json"})", "[[[[[["}},
      {"settings_sdk", settings(".cfg"), {kSdk, "chirpCfg 0 511 0 0 0 0 0 7\nframeCfg 0 0 1 0 1 1 0"}},
      {"settings_xml", settings(".xml"), {kXml, "<configuration><configuration>"}},
  };
}

}  // namespace mmradartwin
