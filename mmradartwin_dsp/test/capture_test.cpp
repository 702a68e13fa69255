#include "mmradartwin_dsp/capture.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <random>

#include "test_radar.h"

namespace mmradartwin {
namespace {

std::vector<std::int16_t> halves(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::int16_t> values(bytes.size() / 2);
  std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

/// Cube [chirp][sample][rx][I, Q] whose values say where they belong.
std::vector<std::int16_t> labelled(const RadarConfig& radar) {
  std::vector<std::int16_t> cube;
  for (int c = 0; c < radar.chirps_per_frame(); ++c) {
    for (int n = 0; n < radar.samples_per_chirp; ++n) {
      for (int rx = 0; rx < radar.receivers(); ++rx) {
        for (int q = 0; q < 2; ++q) cube.push_back(static_cast<std::int16_t>(((c * 64 + n) * 8 + rx) * 2 + q));
      }
    }
  }
  return cube;
}

std::int16_t label(int c, int n, int rx, int q) { return static_cast<std::int16_t>(((c * 64 + n) * 8 + rx) * 2 + q); }

TEST(Capture, FourLaneByteOffsetsFollowTheTable) {
  // Reference: I(c, rx, n) at byte (c Ns + n) 16 + 2 rx, Q 8 bytes on.
  const RadarConfig radar = paperRadar();
  const std::vector<std::int16_t> words = halves(encodeFrame(radar, labelled(radar)));
  for (const auto& [c, n, rx] : {std::array<int, 3>{0, 0, 0}, {0, 0, 3}, {0, 1, 2}, {1, 63, 1}, {1, 5, 0}}) {
    const std::size_t at = static_cast<std::size_t>((c * 64 + n) * 16 + 2 * rx) / 2;
    EXPECT_EQ(words[at], label(c, n, rx, 0));
    EXPECT_EQ(words[at + 4], label(c, n, rx, 1));
  }
}

TEST(Capture, TwoLaneByteOffsetsFollowTheTable) {
  // Reference: per chirp RX-major, groups I[n] I[n+1] Q[n] Q[n+1].
  RadarConfig radar = paperRadar();
  radar.layout = CaptureLayout::kTwoLane;
  const std::vector<std::int16_t> words = halves(encodeFrame(radar, labelled(radar)));
  const std::size_t group = static_cast<std::size_t>(((1 * 4 + 2) * 64 + 10) * 2);  // chirp 1, rx 2, samples 10 and 11
  EXPECT_EQ(words[group], label(1, 10, 2, 0));
  EXPECT_EQ(words[group + 1], label(1, 11, 2, 0));
  EXPECT_EQ(words[group + 2], label(1, 10, 2, 1));
  EXPECT_EQ(words[group + 3], label(1, 11, 2, 1));
}

TEST(Capture, SwappedOrderPutsQFirst) {
  RadarConfig radar = paperRadar();
  radar.iq_order = IqOrder::kQi;
  EXPECT_EQ(halves(encodeFrame(radar, labelled(radar)))[0], label(0, 0, 0, 1));
  EXPECT_EQ(halves(encodeFrame(radar, labelled(radar)))[4], label(0, 0, 0, 0));
  radar.layout = CaptureLayout::kTwoLane;
  EXPECT_EQ(halves(encodeFrame(radar, labelled(radar)))[0], label(0, 0, 0, 1));
  EXPECT_EQ(halves(encodeFrame(radar, labelled(radar)))[2], label(0, 0, 0, 0));
}

TEST(Capture, UnusedLanesAreZero) {
  RadarConfig radar = paperRadar();
  radar.rx_position_m.resize(2);
  EXPECT_EQ(radar.bytes_per_frame(), 2u * 64 * 16);
  const std::vector<std::int16_t> words = halves(encodeFrame(radar, labelled(radar)));
  EXPECT_EQ(words[1], label(0, 0, 1, 0));
  EXPECT_EQ(words[2], 0);
  EXPECT_EQ(words[3], 0);
  EXPECT_EQ(words[4], label(0, 0, 0, 1));
}

TEST(Capture, DecodeInvertsEncodeInAllLayouts) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> value(-32768, 32767);
  for (const CaptureLayout layout : {CaptureLayout::kFourLane, CaptureLayout::kTwoLane}) {
    for (const IqOrder order : {IqOrder::kIq, IqOrder::kQi}) {
      for (const std::size_t receivers : {1u, 2u, 3u, 4u}) {
        RadarConfig radar = paperRadar();
        radar.layout = layout;
        radar.iq_order = order;
        radar.loops_per_frame = 3;
        radar.rx_position_m.resize(receivers);
        std::vector<std::int16_t> samples(3 * 2 * 64 * receivers * 2), back;
        for (std::int16_t& sample : samples) sample = static_cast<std::int16_t>(value(random));
        const std::vector<std::uint8_t> bytes = encodeFrame(radar, samples);
        ASSERT_EQ(bytes.size(), radar.bytes_per_frame());
        decodeFrame(radar, bytes.data(), back);
        EXPECT_EQ(back, samples);
      }
    }
  }
}

TEST(Capture, FilesGiveFramesWithStamps) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  std::vector<AdcCube> cubes(3);
  for (std::size_t i = 0; i < cubes.size(); ++i) {
    cubes[i].data = labelled(radar);
    cubes[i].data[0] = static_cast<std::int16_t>(1000 + i);
  }
  writeCapture(radar, cubes, folder / "a.bin");
  const CaptureReader reader(radar, folder / "a.bin");
  ASSERT_EQ(reader.frames(), 3);
  const AdcCube cube = reader.frame(2, 1700000000000000000);
  EXPECT_EQ(cube.stamp_ns, 1700000000100000000);
  EXPECT_EQ(cube.sequence, 2u);
  EXPECT_EQ(cube.data, cubes[2].data);
  EXPECT_EQ(cube.chirp_valid, std::vector<std::uint8_t>(2, 1));
}

TEST(Capture, TruncatedAndMissingFilesSayWhatIsThere) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  std::ofstream(folder / "short.bin") << std::string(2 * 2048 + 100, 'x');
  std::ofstream(folder / "empty.bin") << "";
  const auto open = [&](const std::string& name) { return inputError([&] { CaptureReader(radar, folder / name); }); };
  EXPECT_TRUE(saysInOneLine(open("short.bin"), "short.bin", "4196 bytes", "2 whole frames", "2048"));
  EXPECT_TRUE(saysInOneLine(open("empty.bin"), "empty.bin", "0 whole frames"));
  EXPECT_TRUE(saysInOneLine(open("none.bin"), "none.bin", "cannot be opened"));
  EXPECT_FALSE(inputError([&] { encodeFrame(radar, std::vector<std::int16_t>(5)); }).empty());
}

TEST(RealCapture, BothLayoutsOfOneRecordingGiveTheSameCube) {
  const auto four = dataFolder() / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  const auto two = dataFolder() / "openradar_indoor" / "xwr18xx_2lane_adc_data.bin";
  SKIP_WITHOUT(four);
  SKIP_WITHOUT(two);
  RadarConfig radar = loadRadarConfig(MMRADARTWIN_DSP_SOURCE "/test/data/openradar_indoor.yaml");
  const CaptureReader four_lane(radar, four.string());
  radar.layout = CaptureLayout::kTwoLane;
  const CaptureReader two_lane(radar, two.string());
  ASSERT_EQ(four_lane.frames(), 1);
  ASSERT_EQ(two_lane.frames(), 1);
  EXPECT_NE(four_lane.bytes(0), two_lane.bytes(0));
  EXPECT_EQ(four_lane.frame(0, 0).data, two_lane.frame(0, 0).data);
  EXPECT_EQ(four_lane.frame(0, 0).data.size(), 256u * 128 * 4 * 2);
}

/// Parts cut within a frame and within a sample, as TI's tools cut them.
TEST(Capture, PartsAreReadAsOne) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  std::mt19937 random(5);
  std::string bytes(5 * radar.bytes_per_frame(), '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  std::ofstream(folder / "whole.bin", std::ios::binary) << bytes;
  std::ofstream(folder / "a_Raw_0.bin", std::ios::binary) << bytes.substr(0, 3001);
  std::ofstream(folder / "a_Raw_1.bin", std::ios::binary) << bytes.substr(3001, 1000);
  std::ofstream(folder / "a_Raw_2.bin", std::ios::binary) << bytes.substr(4001);
  std::ofstream(folder / "a_Raw_0_LogFile.csv") << "not a part";
  std::ofstream(folder / "b_Raw_7.bin") << "another capture's";
  EXPECT_EQ(captureParts(folder / "a_Raw_0.bin").size(), 3u);
  EXPECT_EQ(captureParts(folder / "whole.bin").size(), 1u);
  const CaptureReader parts(radar, folder / "a_Raw_0.bin"), whole(radar, folder / "whole.bin");
  ASSERT_EQ(parts.frames(), 5);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(parts.bytes(i), whole.bytes(i)) << i;
}

/// Part 10 follows part 9, not part 1.
TEST(Capture, ManyPartsKeepTheirOrder) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  std::string bytes(13 * radar.bytes_per_frame(), '\0');
  std::mt19937 random(6);
  for (char& byte : bytes) byte = static_cast<char>(random());
  std::ofstream(folder / "whole.bin", std::ios::binary) << bytes;
  for (std::size_t part = 0; part < 13; ++part) {
    std::ofstream(folder / ("adc_data_Raw_" + std::to_string(part) + ".bin"), std::ios::binary)
        << bytes.substr(part * 2000, part == 12 ? std::string::npos : 2000);
  }
  EXPECT_EQ(captureParts(folder / "adc_data_Raw_0.bin").size(), 13u);
  const CaptureReader parts(radar, folder / "adc_data_Raw_0.bin"), whole(radar, folder / "whole.bin");
  ASSERT_EQ(parts.frames(), 13);
  for (int i = 0; i < 13; ++i) EXPECT_EQ(parts.bytes(i), whole.bytes(i)) << i;
}

TEST(Capture, MissingPartIsNamed) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  for (const char* name : {"a_RAW_0.bin", "a_RAW_2.bin"}) {
    std::ofstream(folder / name, std::ios::binary) << std::string(2048, 'x');
  }
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { CaptureReader(radar, folder / "a_RAW_0.bin"); }), "a_RAW_1.bin is missing"));
}

}  // namespace
}  // namespace mmradartwin
