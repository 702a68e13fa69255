// The emulator, as its own program, over real UDP into receiver and assembler.
#include <gtest/gtest.h>

#include <set>

#include "emulated_rig.h"
#include "mmradartwin_driver/dca1000_control.h"
#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/capture.h"
#include "real_data.h"

namespace mmradartwin {
namespace {

using Clock = std::chrono::steady_clock;

struct Recorded {
  std::vector<AdcCube> cubes;
  FrameAssembler::Counters frames;
  PacketReceiver::Counters packets;
  std::int64_t first_frame_ns = 0;
  std::int64_t own_late_ns = 0;  ///< what this machine made the worst packet late
  bool completed = false;
};

/// Arms the emulated card and records until it says that the recording is complete.
Recorded record(const RadarConfig& radar, std::vector<std::string> arguments) {
  const std::string host = loopbackIp(1), card = loopbackIp(2);
  for (const char* more : {"--start-delay-s", "0.1", "--flush-s", "0.3", "--deaf-s", "0.1"}) arguments.push_back(more);
  EmulatorProcess emulator(host, card, arguments);
  Recorded recorded;
  PacketReceiver receiver(host, kDca1000DataPort, card);
  Dca1000Control control(host, card, kDca1000ConfigPort);
  FrameAssembler assembler(radar, [&](AdcCube&& cube) { recorded.cubes.push_back(std::move(cube)); });
  control.connect();
  control.resetFpga();
  control.configureFpga(radar.layout == CaptureLayout::kTwoLane ? 2 : 4);
  control.configurePackets(25);
  control.startRecord();
  recorded.first_frame_ns = emulator.firstFrame_ns();
  const auto until = Clock::now() + std::chrono::seconds(60);
  while (!recorded.completed && Clock::now() < until) {
    receiver.receive(20, [&](const DataPacket& packet) { assembler.add(packet); });
    const auto status = control.takeStatus(std::chrono::milliseconds(0));
    recorded.completed = status && (*status & kRecordCompleted);
  }
  while (receiver.receive(50, [&](const DataPacket& packet) { assembler.add(packet); })) {
  }
  assembler.flush();
  control.stopRecord();
  if (const auto completed = emulator.waitFor("completed"))
    recorded.own_late_ns = EmulatorProcess::ownLate_ns(*completed);
  recorded.frames = assembler.counters();
  recorded.packets = receiver.counters();
  return recorded;
}

TEST(EmulatorLoopback, RealCaptureInBothLayoutsBitForBit) {
  const std::string four = realData("openradar_indoor/xwr22xx_4lane_adc_data.bin");
  const std::string two = realData("openradar_indoor/xwr18xx_2lane_adc_data.bin");
  SKIP_WITHOUT(four);
  SKIP_WITHOUT(two);
  // 128 loops of 2 TX, 128 samples, 4 receivers; 92 us per chirp (data/README).
  const std::string yaml =
      "device: xwr1843\ncarrier_hz: 77.4201e+9\nslope_hz_per_s: 60.0e+12\nsamples_per_chirp: 128\nsample_rate_hz: "
      "2.5e+6\n"
      "adc_start_s: 7.0e-6\nloops_per_frame: 128\nframe_period_s: 0.05\nidle_s: 30.0e-6\nramp_end_s: 62.0e-6\n"
      "tx_position_m: [[0, 0, 0], [0, 0.0077446, 0]]\n"
      "rx_position_m: [[0, 0, 0], [0, 0.0019361, 0], [0, 0.0038723, 0], [0, 0.0058084, 0]]\nlayout: ";
  TestFolder folder;
  std::vector<std::vector<std::int16_t>> samples;
  for (const auto& [layout, capture] : {std::pair<std::string, std::string>{"4lane", four}, {"2lane", two}}) {
    SCOPED_TRACE(layout);
    const std::string radar_file = folder.file(layout + ".yaml");
    writeText(radar_file, yaml + layout + "\n");
    const RadarConfig radar = loadRadarConfig(radar_file);
    const Recorded recorded = record(radar, {capture, "--radar", radar_file});
    EXPECT_TRUE(recorded.completed);
    ASSERT_EQ(1u, recorded.cubes.size());
    const AdcCube& cube = recorded.cubes.front();
    const AdcCube expected = CaptureReader(radar, capture).frame(0, 0);
    EXPECT_EQ(0u, cube.lost_bytes);
    EXPECT_TRUE(expected.data == cube.data);
    EXPECT_EQ(expected.chirp_valid, cube.chirp_valid);
    EXPECT_EQ(361u, recorded.packets.packets);  // 524288 = 360 * 1456 + 128
    // Late by what the host takes to send and deliver, never early.
    EXPECT_GE(cube.stamp_ns, recorded.first_frame_ns);
    EXPECT_LT(cube.stamp_ns, recorded.first_frame_ns + 40'000'000);  // below the frame period
    samples.push_back(cube.data);
  }
  EXPECT_TRUE(samples[0] == samples[1]);  // the two files hold the same measurement
}

TEST(EmulatorLoopback, SessionArrivesWholeWithItsStamps) {
  TestFolder folder;
  writeSession(folder, 0.02, {5, 8, 3});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const Recorded recorded = record(radar, {folder.file("")});
  ASSERT_EQ(16u, recorded.cubes.size());
  EXPECT_EQ(0u, recorded.frames.lost_bytes);
  std::vector<std::uint8_t> all;
  for (const char* pose : {"a", "b", "c"}) {
    const auto bytes = readBytes(folder.file(std::string("captures/") + pose + ".bin"));
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  for (std::size_t f = 0; f < 16; ++f) {
    const AdcCube& cube = recorded.cubes[f];
    EXPECT_EQ(f, cube.sequence);
    std::vector<std::int16_t> expected;
    decodeFrame(radar, all.data() + f * 2048, expected);
    EXPECT_EQ(expected, cube.data) << f;
    const auto late_ns = cube.stamp_ns - (recorded.first_frame_ns + static_cast<std::int64_t>(f) * 20'000'000);
    EXPECT_GE(late_ns, 0) << f;
    EXPECT_LT(late_ns, 5'000'000 + recorded.own_late_ns) << f;  // a quarter of the period: the pose holds
  }
}

TEST(EmulatorLoopback, WhatIsImpairedOnTheWayIsFlaggedAndNothingElse) {
  TestFolder folder;
  writeSession(folder, 0.005, {200});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const Recorded recorded = record(radar, {folder.file(""), "--loss", "0.05", "--duplicate", "0.05", "--reorder",
                                           "0.05", "--truncate", "0.03", "--seed", "4"});
  const auto sent = readBytes(folder.file("captures/a.bin"));
  EXPECT_EQ(1u, recorded.frames.epochs);
  EXPECT_GT(recorded.frames.incomplete_frames, 10u);
  EXPECT_GT(recorded.frames.duplicate_packets, 3u);
  EXPECT_GT(recorded.frames.reordered_packets, 3u);
  std::size_t valid = 0;
  for (const AdcCube& cube : recorded.cubes) {
    std::vector<std::int16_t> expected;
    decodeFrame(radar, sent.data() + cube.sequence * 2048, expected);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const bool good = cube.chirp_valid[i / 512] != 0;
      valid += good;
      if (!good && cube.data[i] == 0) continue;
      ASSERT_EQ(expected[i], cube.data[i]) << cube.sequence;
    }
  }
  EXPECT_GT(valid, 200u * 1024 * 7 / 10);
  EXPECT_EQ(sent.size(), recorded.frames.bytes + recorded.frames.lost_bytes);
}

TEST(EmulatorLoopback, CountsThatBeginAnewAndSilenceMisplaceNothing) {
  TestFolder folder;
  writeSession(folder, 0.01, {60});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const Recorded recorded = record(radar, {folder.file(""), "--restart-at", "20", "--silence-at", "40:5"});
  const auto sent = readBytes(folder.file("captures/a.bin"));
  EXPECT_EQ(2u, recorded.frames.epochs);
  std::set<std::size_t> whole;
  std::size_t first = 0;
  std::int64_t last = -1;
  for (const AdcCube& cube : recorded.cubes) {
    if (static_cast<std::int64_t>(cube.sequence) <= last) first = 20;
    last = cube.sequence;
    const std::size_t frame = first + cube.sequence;
    ASSERT_LT(frame, 60u);
    std::vector<std::int16_t> expected;
    decodeFrame(radar, sent.data() + frame * 2048, expected);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (cube.chirp_valid[i / 512] == 0) continue;
      ASSERT_EQ(expected[i], cube.data[i]) << frame;
    }
    if (cube.lost_bytes == 0) whole.insert(frame);
  }
  for (const std::size_t frame : {41u, 42u, 43u}) EXPECT_EQ(0u, whole.count(frame));
  // A packet holds bytes of two frames: those beside what was lost may be cut.
  EXPECT_GE(whole.size(), 60u - 5 - 4);
  EXPECT_EQ(1u, whole.count(59));
}

TEST(EmulatorLoopback, PlaysTheChosenPosesOnly) {
  TestFolder folder;
  writeSession(folder, 0.01, {1, 2, 3, 4, 5});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const Recorded recorded = record(radar, {folder.file(""), "--first", "1", "--every", "2", "--count", "2"});
  ASSERT_EQ(6u, recorded.cubes.size());  // b with 2 frames, d with 4
  std::vector<std::int16_t> expected;
  decodeFrame(radar, readBytes(folder.file("captures/d.bin")).data(), expected);
  EXPECT_EQ(expected, recorded.cubes[2].data);
}

TEST(EmulatorLoopback, CardIsDeafAfterItsConfiguration) {
  TestFolder folder;
  writeSession(folder, 0.01, {1});
  const std::string host = loopbackIp(1), card = loopbackIp(2);
  EmulatorProcess emulator(host, card, {folder.file(""), "--deaf-s", "0.7"});
  Dca1000Control control(host, card, kDca1000ConfigPort);
  control.connect();
  const FpgaVersion version = control.readVersion();
  EXPECT_EQ(2, version.major);
  EXPECT_EQ(8, version.minor);
  const auto before = Clock::now();
  control.configureFpga(4);
  EXPECT_GE(Clock::now() - before, std::chrono::milliseconds(650));
  EXPECT_TRUE(control.answers());

  Dca1000Control::Options impatient;
  impatient.deaf_limit = std::chrono::milliseconds(100);
  impatient.reply_timeout = std::chrono::milliseconds(50);
  Dca1000Control other(loopbackIp(3), card, kDca1000ConfigPort, impatient);
  EXPECT_THROW(other.configureFpga(4), RigError);
}

}  // namespace
}  // namespace mmradartwin
