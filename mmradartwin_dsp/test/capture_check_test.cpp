// Captures that are not what radar.yaml says: bytes are made here, by the formula of a point target and nothing of
// ours.
#include "mmradartwin_dsp/capture_check.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <functional>
#include <random>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/range_angle.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

using Words = std::vector<std::int16_t>;
using Misaligned = CaptureCheckOptions::Misaligned;

constexpr int kSamples = 64, kReceivers = 4, kSlots = 2;

struct Target {
  double range_m = 3, azimuth_deg = 20, amplitude = 3000, noise = 0;
};

/// Phase of sample n at virtual element k.
double phase(const Target& target, int k, int n) {
  return 2 * M_PI * 75e12 * (2 * target.range_m / 299792458.0) * n / 5e6 -
         1.012 * M_PI * k * std::sin(target.azimuth_deg * M_PI / 180);
}

enum class Order { kFourLane, kTwoLane, kReal, kRealTwoLane, kPairs };

/// Words of frames of two chirps each.
Words pointTargetWords(const Target& target, Order order, int frames, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Words words;
  const auto put = [&](double value) {
    words.push_back(static_cast<std::int16_t>(std::lround(value + target.noise * normal(random))));
  };
  const auto i = [&](int slot, int rx, int n) { put(target.amplitude * std::cos(phase(target, 4 * slot + rx, n))); };
  const auto q = [&](int slot, int rx, int n) { put(target.amplitude * std::sin(phase(target, 4 * slot + rx, n))); };
  for (int chirp = 0; chirp < kSlots * frames; ++chirp) {
    const int slot = chirp % kSlots;
    if (order == Order::kFourLane || order == Order::kReal) {
      for (int n = 0; n < kSamples; ++n) {
        for (int rx = 0; rx < kReceivers; ++rx) i(slot, rx, n);
        for (int rx = 0; rx < kReceivers && order == Order::kFourLane; ++rx) q(slot, rx, n);
      }
      continue;
    }
    for (int rx = 0; rx < kReceivers; ++rx) {
      for (int n = 0; n < kSamples; n += order == Order::kTwoLane ? 2 : 1) {
        i(slot, rx, n);
        if (order == Order::kTwoLane) i(slot, rx, n + 1);
        if (order != Order::kRealTwoLane) q(slot, rx, n);
        if (order == Order::kTwoLane) q(slot, rx, n + 1);
      }
    }
  }
  return words;
}

std::string bytesOf(const Words& words) { return {reinterpret_cast<const char*>(words.data()), 2 * words.size()}; }

std::string littleEndian(std::uint64_t value, int size) {
  std::string bytes;
  for (int i = 0; i < size; ++i) bytes += static_cast<char>(value >> (8 * i));
  return bytes;
}

std::string begunAt(const std::string& bytes, std::size_t offset) {
  return bytes.substr(offset) + bytes.substr(0, offset);
}

struct Peak {
  double range_m = 0, azimuth_deg = 0, power_db = -1000;
};

Peak peakOf(const Recording& recording) {
  const RangeAngleMap map = SignalChain(recording.radar).map(averagePose(recording, recording.poses.front()));
  Peak peak;
  for (Eigen::Index r = 0; r < map.power_db.rows(); ++r) {
    for (Eigen::Index a = 0; a < map.power_db.cols(); ++a) {
      if (!(map.power_db(r, a) > peak.power_db)) continue;
      peak = {map.axes.range_m[static_cast<std::size_t>(r)],
              map.axes.azimuth_rad[static_cast<std::size_t>(a)] * 180 / M_PI, map.power_db(r, a)};
    }
  }
  return peak;
}

class CaptureCheck : public ::testing::Test {
 protected:
  void write(const std::string& bytes, const std::string& name = "a.bin") {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
  Recording open(const std::string& name = "a.bin") { return openCapture(folder_ / name, radar_); }
  std::string refusal(const std::string& bytes, Misaligned misaligned = Misaligned::kRefused) {
    write(bytes);
    return inputError([&] {
      Recording recording = open();
      checkCaptures(recording, {misaligned});
    });
  }
  /// The notes of a check that passes.
  std::vector<std::string> notes(Recording& recording, Misaligned misaligned = Misaligned::kRefused) {
    std::vector<std::string> all;
    EXPECT_EQ(inputError([&] { all = checkCaptures(recording, {misaligned}); }), "");
    return all;
  }
  /// The target is where the formula puts it: 3.0 m and 20 degrees, within half a bin.
  void expectTarget(const Recording& recording, const Target& target = {}) {
    const Peak peak = peakOf(recording);
    EXPECT_NEAR(peak.range_m, target.range_m, 0.08);
    EXPECT_NEAR(peak.azimuth_deg, target.azimuth_deg, 1.0);
  }

  TestFolder folder_;
  RadarConfig radar_ = paperRadar();
};

TEST_F(CaptureCheck, WhatRadarYamlSaysPassesWithoutAWord) {
  for (const double noise : {0.0, 30.0, 1000.0, 20000.0}) {
    for (const double range_m : {0.3, 1.0, 3.0, 4.97, 8.0}) {
      for (const int frames : {1, 2, 5, 20}) {
        Target target;
        target.range_m = range_m;
        target.noise = noise;
        write(bytesOf(pointTargetWords(target, Order::kFourLane, frames)));
        Recording recording = open();
        EXPECT_TRUE(notes(recording).empty()) << noise << " " << range_m << " " << frames;
        if (noise == 0) expectTarget(recording, target);
      }
    }
  }
}

TEST_F(CaptureCheck, NoiseAloneIsCalledNothing) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Target target;
    target.amplitude = 0;
    target.noise = seed % 2 ? 50 : 2;
    for (const Order order : {Order::kFourLane, Order::kTwoLane}) {
      radar_.layout = seed % 4 < 2 ? CaptureLayout::kFourLane : CaptureLayout::kTwoLane;
      EXPECT_EQ(refusal(bytesOf(pointTargetWords(target, order, 10, seed))), "") << seed;
    }
  }
}

TEST_F(CaptureCheck, AnotherLayoutIsNamed) {
  EXPECT_TRUE(saysInOneLine(refusal(bytesOf(pointTargetWords({}, Order::kTwoLane, 10))), "a.bin",
                            "bytes look like 2lane", "more concentrated", "set layout: 2lane"));
  radar_.layout = CaptureLayout::kTwoLane;
  EXPECT_TRUE(saysInOneLine(refusal(bytesOf(pointTargetWords({}, Order::kFourLane, 10))), "bytes look like 4lane",
                            "set layout: 4lane"));
  Target noisy;
  noisy.range_m = 1.3;
  noisy.noise = 100;
  EXPECT_TRUE(saysInOneLine(refusal(bytesOf(pointTargetWords(noisy, Order::kPairs, 10))), "pairs I Q, receiver by"));
}

TEST_F(CaptureCheck, RealSamplesAreNamedAndReadWithTheKey) {
  const std::string four = bytesOf(pointTargetWords({}, Order::kReal, 100));
  EXPECT_TRUE(saysInOneLine(refusal(four), "samples look real, not complex", "samples: real"));
  radar_ = parseRadarConfig(std::string(paperRadarYaml()) + "samples: real\n", "radar.yaml");
  EXPECT_EQ(radar_.samples_per_chirp, 32);
  EXPECT_NEAR(radar_.max_range_m(), 4.996, 0.001);  // half of the complex radar's 9.993 m
  EXPECT_NEAR(radar_.range_bin_m(), 0.1561, 1e-4);
  write(four);
  Recording recording = open();
  EXPECT_TRUE(notes(recording).empty());
  expectTarget(recording);
  // A point of amplitude 3000 counts stands 20.8 dB below full scale, up to the loss between bins.
  EXPECT_NEAR(peakOf(recording).power_db, -20.8, 0.5);
  EXPECT_TRUE(
      saysInOneLine(refusal(bytesOf(pointTargetWords({}, Order::kFourLane, 20))), "samples look complex, not real"));
  const Target other = {1.7, -25, 900, 5};
  radar_ = parseRadarConfig(std::string(paperRadarYaml()) + "samples: real\nlayout: 2lane\n", "radar.yaml");
  write(bytesOf(pointTargetWords(other, Order::kRealTwoLane, 31)));
  recording = open();
  EXPECT_TRUE(notes(recording).empty());
  expectTarget(recording, other);
  EXPECT_EQ(toYaml(parseRadarConfig(toYaml(radar_), "radar.yaml")), toYaml(radar_));
  EXPECT_TRUE(contains(toYaml(radar_), "samples_per_chirp: 64\n"));
}

TEST_F(CaptureCheck, RealChirpsSurviveAWayBack) {
  radar_ = parseRadarConfig(std::string(paperRadarYaml()) + "samples: real\n", "radar.yaml");
  const Words words = pointTargetWords({}, Order::kReal, 1);
  const std::string bytes = bytesOf(words);
  ASSERT_EQ(bytes.size(), radar_.bytes_per_frame());
  Words samples;
  decodeFrame(radar_, reinterpret_cast<const std::uint8_t*>(bytes.data()), samples);
  const std::vector<std::uint8_t> back = encodeFrame(radar_, samples);
  ASSERT_EQ(back.size(), bytes.size());
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::int16_t value;
    std::memcpy(&value, back.data() + 2 * i, 2);
    // What was at the highest frequency exactly is lost, and the rest is rounded.
    EXPECT_NEAR(value, words[i], 60) << i;
  }
}

TEST_F(CaptureCheck, ACaptureThatBeginsWithinAFrameIsFoundAndAligned) {
  for (const std::size_t offset : {1096u, 16u, 8u, 6u, 512u, 1456u, 2040u}) {
    SCOPED_TRACE(offset);
    const std::string bytes = begunAt(bytesOf(pointTargetWords({}, Order::kFourLane, 100)), offset);
    EXPECT_TRUE(saysInOneLine(refusal(bytes), "begins " + std::to_string(offset) + " bytes into a frame",
                              "packet_misalignment", "--align"));
    Recording recording = open();
    EXPECT_EQ(notes(recording, Misaligned::kAligned).size(), 1u);
    expectTarget(recording);
    EXPECT_NEAR(peakOf(recording).power_db, -21.0, 0.3);
    EXPECT_TRUE(recording.aligned_by_user);
    EXPECT_EQ(recording.begins_within->at("a"), offset);
  }
}

TEST_F(CaptureCheck, ItIsAlsoFoundInNoiseInTwoLanesAndWithoutTheRest) {
  Target target = {2.2, -24, 2000, 40};
  const std::string bytes = bytesOf(pointTargetWords(target, Order::kFourLane, 40));
  EXPECT_TRUE(saysInOneLine(refusal(bytes.substr(700)), "begins 700 bytes into a frame"));
  Recording recording = open();
  notes(recording, Misaligned::kAligned);
  expectTarget(recording, target);
  radar_.layout = CaptureLayout::kTwoLane;
  EXPECT_TRUE(saysInOneLine(refusal(begunAt(bytesOf(pointTargetWords(target, Order::kTwoLane, 40)), 1096)),
                            "begins 1096 bytes into a frame"));
  recording = open();
  notes(recording, Misaligned::kAligned);
  expectTarget(recording, target);
}

TEST_F(CaptureCheck, ConstantReceiversAreLeftOut) {
  struct Dead {
    std::vector<std::size_t> words;
    std::int16_t value;
    std::vector<std::string> said;
  };
  const Dead all[] = {{{2, 6}, 0, {"receiver 2 delivers only zeros at all poses"}},
                      {{2, 3, 6, 7}, -1, {"receiver 2 delivers only a constant -1", "receiver 3 delivers only a"}},
                      {{0, 4}, 17, {"receiver 0 delivers only a constant 17"}},
                      {{5}, 0, {"receiver 1 delivers only zeros in Q"}}};
  for (const Dead& dead : all) {
    Words words = pointTargetWords({}, Order::kFourLane, 20);
    for (std::size_t i = 0; i < words.size(); ++i) {
      if (std::count(dead.words.begin(), dead.words.end(), i % 8)) words[i] = dead.value;
    }
    write(bytesOf(words));
    Recording recording = open();
    const std::vector<std::string> said = notes(recording);
    ASSERT_EQ(said.size(), dead.said.size());
    for (std::size_t i = 0; i < said.size(); ++i) EXPECT_TRUE(saysInOneLine(said[i], dead.said[i], "LVDS lane"));
    EXPECT_EQ(recording.radar.receivers(), 4 - static_cast<int>(said.size()));
    expectTarget(recording);
    EXPECT_NEAR(peakOf(recording).power_db, -21.0, 0.3);  // as strong as with all
  }
  Words words = pointTargetWords({}, Order::kFourLane, 20);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = i % 4 == 1 ? words[i] : std::int16_t{0};
  EXPECT_TRUE(saysInOneLine(refusal(bytesOf(words)), "fewer than two receivers"));
}

TEST_F(CaptureCheck, AReceiverThatComesToLifeIsNotDead) {
  Words words = pointTargetWords({}, Order::kFourLane, 100);
  for (std::size_t i = 0; i < words.size() / 2; ++i) words[i] = i % 4 == 2 ? std::int16_t{0} : words[i];
  EXPECT_EQ(refusal(bytesOf(words)), "");
}

TEST_F(CaptureCheck, ACaptureOfZerosIsSaid) {
  EXPECT_TRUE(saysInOneLine(refusal(std::string(20 * 2048, '\0')), "pose 'a'", "all its samples are zero"));
  EXPECT_TRUE(saysInOneLine(refusal(bytesOf(Words(20 * 1024, -1))), "all its samples are constant"));
}

/// One pose of zeros and one of a dead receiver among good ones: these go, the others stay as they are.
TEST_F(CaptureCheck, BadPosesOfASessionAreLeftOut) {
  SessionWriter writer(folder_.path.string(), radar_, {paperRadarYaml(), {}, {}, {}});
  for (int i = 0; i < 4; ++i) {
    Pose pose;
    pose.name = pose.location = "p" + std::to_string(i);
    pose.stamp_ns = 1700000000000000000 + i * 10000000000;
    pose.T_map_radar.translation().x() = i;
    writer.add(pose, {});
    Words words = pointTargetWords({}, Order::kFourLane, 10);
    for (std::size_t w = 0; w < words.size(); ++w) {
      if (i == 1 || (i == 2 && w % 4 == 3)) words[w] = 0;
    }
    write(bytesOf(words), "captures/" + pose.name + ".bin");
  }
  writer.finish();
  Recording recording = openSession(folder_.path.string());
  EXPECT_TRUE(notes(recording).empty());
  ASSERT_EQ(recording.poses.size(), 2u);
  EXPECT_EQ(recording.poses[1].name, "p3");
  ASSERT_EQ(recording.problems.size(), 2u);
  EXPECT_TRUE(saysInOneLine(recording.problems[0].message, "pose 'p1'", "all its samples are zero"));
  EXPECT_TRUE(saysInOneLine(recording.problems[1].message, "pose 'p2'", "receiver 3 delivers only zeros at this pose"));
  expectTarget(recording);
}

std::string withHeads(const std::string& bytes, std::size_t payload, bool with_size) {
  std::string result;
  for (std::size_t at = 0, number = 1; at < bytes.size(); at += payload, ++number) {
    const std::string part = bytes.substr(at, payload);
    result += littleEndian(number, 4) + (with_size ? littleEndian(part.size(), 4) : "") + littleEndian(at, 6) + part;
  }
  return result;
}

TEST_F(CaptureCheck, HeadsOfPacketsAreTakenOut) {
  const std::string bytes = bytesOf(pointTargetWords({}, Order::kFourLane, 100));
  write(bytes, "plain.bin");
  const CaptureReader plain(radar_, folder_ / "plain.bin");
  std::string lvds;
  for (std::size_t at = 0; at < bytes.size(); at += 1024) {
    lvds += littleEndian(0x0CDA0ADC0CDA0ADCull, 8) + std::string(56, '\x0f') + bytes.substr(at, 1024);
  }
  const std::pair<std::string, const char*> all[] = {{withHeads(bytes, 1456, true), "packet heads of 14 bytes"},
                                                     {withHeads(bytes, 1456, false), "packet heads of 10 bytes"},
                                                     {withHeads(bytes, 1024, false), "packet heads of 10 bytes"},
                                                     {lvds, "LVDS headers"}};
  for (const auto& [headed, said] : all) {
    write(headed);
    Recording recording = open();
    const std::vector<std::string> lines = notes(recording);
    ASSERT_EQ(lines.size(), 1u);
    EXPECT_TRUE(saysInOneLine(lines[0], "a.bin", said, "taken out"));
    const CaptureReader reader(radar_, folder_ / "a.bin");
    ASSERT_EQ(reader.frames(), 100);
    for (const int i : {0, 1, 50, 99}) EXPECT_EQ(reader.bytes(i), plain.bytes(i)) << said << " " << i;
    expectTarget(recording);
  }
}

TEST_F(CaptureCheck, LostPacketsBetweenHeadsAreNotValid) {
  const std::string bytes = bytesOf(pointTargetWords({}, Order::kFourLane, 100));
  const std::string headed = withHeads(bytes, 1456, false);
  write(headed.substr(0, 20 * 1466) + headed.substr(21 * 1466));
  const CaptureReader reader(radar_, folder_ / "a.bin");
  ASSERT_EQ(reader.frames(), 100);
  int lost = 0;
  for (int i = 0; i < 100; ++i) {
    const AdcCube cube = reader.frame(i, 0);
    lost += static_cast<int>(std::count(cube.chirp_valid.begin(), cube.chirp_valid.end(), 0));
  }
  EXPECT_EQ(lost, 2);  // bytes 29120 to 30576 touch chirps 28 and 29 of 1024 bytes
  Recording recording = open();
  EXPECT_TRUE(saysInOneLine(notes(recording).at(0), "1456 bytes were lost"));
  expectTarget(recording);
}

TEST_F(CaptureCheck, FilesOfAnotherKindAreSaid) {
  const std::string frames(4 * 2048, '\x81');
  const std::pair<std::string, const char*> all[] = {
      {"", "empty file"},
      {"\x93NUMPY\x01" + frames, "NumPy"},
      {std::string("PK\x03\x04", 4) + frames.substr(4), "zip"},
      {std::string("\xd4\xc3\xb2\xa1", 4) + frames.substr(4), "pcap"},
      {"\x1f\x8b\x08" + frames, "gzip"},
      {"#ROSBAG V2.0\n" + frames, "rosbag"},
      {"sample,I,Q\n0,12,-7\n1,15,-3\n2,9,11\n", "is a text"},
  };
  for (const auto& [bytes, said] : all) EXPECT_TRUE(saysInOneLine(refusal(bytes), "a.bin: is", said));
  // One level all over is no text.
  EXPECT_FALSE(contains(refusal(std::string(4 * 2048, 'x')), "text"));
}

TEST_F(CaptureCheck, NumberedPartsAreJoinedUnlessTheyAreOtherPoses) {
  const std::string bytes = bytesOf(pointTargetWords({}, Order::kFourLane, 20));
  write(bytes.substr(0, 15000), "adc_data_0.bin");
  write(bytes.substr(15000, 3001), "adc_data_1.bin");
  write(bytes.substr(18001), "adc_data_2.bin");
  Recording recording = open("adc_data_0.bin");
  const std::vector<std::string> lines = notes(recording);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_TRUE(saysInOneLine(lines[0], "adc_data_0.bin", "adc_data_1.bin, adc_data_2.bin", "as one"));
  int frames = 0;
  recording.forEachFrame(recording.poses.front(), [&](const AdcCube&) { ++frames; });
  EXPECT_EQ(frames, 20);
  expectTarget(recording);
  std::filesystem::remove(folder_ / "adc_data_1.bin");
  EXPECT_TRUE(saysInOneLine(inputError([&] { open("adc_data_0.bin"); }), "adc_data_1.bin is missing"));

  SessionWriter writer(folder_ / "session", radar_, {paperRadarYaml(), {}, {}, {}});
  for (int i = 0; i < 2; ++i) {
    Pose pose;
    pose.name = pose.location = "spot_" + std::to_string(i);
    pose.stamp_ns = 1700000000000000000 + i * 10000000000;
    pose.T_map_radar.translation().x() = i;
    writer.add(pose, {});
    write(bytes, "session/captures/" + pose.name + ".bin");
  }
  writer.finish();
  Recording session = openSession(folder_ / "session");
  EXPECT_TRUE(notes(session).empty());
  frames = 0;
  session.forEachFrame(session.poses.front(), [&](const AdcCube&) { ++frames; });
  EXPECT_EQ(frames, 20);
}

/// The real capture under the disguises, and as it is.
TEST_F(CaptureCheck, TheRealCaptureIsRecognised) {
  const auto four = dataFolder() / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  const auto two = dataFolder() / "openradar_indoor" / "xwr18xx_2lane_adc_data.bin";
  SKIP_WITHOUT(four);
  radar_ = loadRadarConfig(MMRADARTWIN_DSP_SOURCE "/test/data/openradar_indoor.yaml");
  const auto load = [](const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const std::string right = load(four), other = load(two);
  EXPECT_EQ(refusal(right), "");
  Recording recording = open();
  const Peak peak = peakOf(recording);
  EXPECT_TRUE(saysInOneLine(refusal(other), "bytes look like 2lane", "set layout: 2lane"));
  EXPECT_TRUE(saysInOneLine(refusal(begunAt(right, 1096)), "begins 1096 bytes into a frame"));
  recording = open();
  notes(recording, Misaligned::kAligned);
  EXPECT_NEAR(peakOf(recording).range_m, peak.range_m, 1e-9);
  EXPECT_NEAR(peakOf(recording).azimuth_deg, peak.azimuth_deg, 2);
  EXPECT_NEAR(peakOf(recording).power_db, peak.power_db, 0.5);
  radar_.layout = CaptureLayout::kTwoLane;
  EXPECT_EQ(refusal(other), "");
  EXPECT_TRUE(saysInOneLine(refusal(right), "bytes look like 4lane", "set layout: 4lane"));
  EXPECT_TRUE(saysInOneLine(refusal(begunAt(other, 1096)), "begins 1096 bytes into a frame"));
}

}  // namespace
}  // namespace mmradartwin
