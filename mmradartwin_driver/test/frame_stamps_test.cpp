// Stamps of frames from a card whose packets leave late, through kernel, receiver, assembler and clock, against when
// the frames truly began.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "emulated_rig.h"
#include "mmradartwin_driver/frame_clock.h"
#include "mmradartwin_driver/pcap_reader.h"
#include "mmradartwin_driver/rig.h"

namespace mmradartwin {
namespace {

constexpr double kPeriod_s = 0.05;
constexpr int kFrames = 260;
constexpr std::uint64_t kSettled = 80;  // the clock's line rests on 60 frames

struct Jitter {
  double stamps_us = 0, arrivals_us = 0;  ///< RMS against the true starts
  double own_late_us = 0;                 ///< what this machine itself made the worst packet late
};

/// Packets leave late by 150 us on average, one in twenty by up to 9 ms more.
Jitter measure(unsigned seed) {
  TestFolder folder;
  writeSession(folder, kPeriod_s, {kFrames});
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EmulatorProcess emulator(loopbackIp(1), loopbackIp(2),
                           {folder.file(""), "--start-delay-s", "0.3", "--deaf-s", "0.1", "--flush-s", "0.3",
                            "--jitter-us", "150", "--stall-us", "9000", "--seed", std::to_string(seed)});
  RigOptions options;
  options.host_ip = loopbackIp(1);
  options.card_ip = loopbackIp(2);
  options.record_pcap = folder.file("packets.pcap");
  std::mutex mutex;
  std::vector<std::pair<std::uint64_t, std::int64_t>> stamps;
  std::int64_t first_ns = 0;
  double own_late_us = 1e9;
  {
    const Rig rig(
        radar, options,
        [&](AdcCube&& cube) {
          const std::lock_guard<std::mutex> lock(mutex);
          stamps.emplace_back(cube.sequence, cube.stamp_ns);
        },
        [](Rig::Level, const std::string&) {});
    first_ns = emulator.firstFrame_ns();
    EXPECT_NE(first_ns, 0);
    const std::optional<std::string> completed = emulator.waitFor("completed");
    EXPECT_TRUE(completed);
    if (completed) own_late_us = 1e-3 * static_cast<double>(EmulatorProcess::ownLate_ns(*completed));
  }
  const auto rms_us = [](const std::vector<double>& errors_us) {
    double sum = 0;
    for (const double error : errors_us) sum += error * error;
    return std::sqrt(sum / static_cast<double>(errors_us.size()));
  };
  const auto start_ns = [&](std::uint64_t frame) {
    return first_ns + std::llround(static_cast<double>(frame) * kPeriod_s * 1e9);
  };
  std::vector<double> stamp_errors_us, arrival_errors_us;
  for (const auto& [frame, stamp_ns] : stamps) {
    if (frame >= kSettled && frame < kFrames) {
      stamp_errors_us.push_back(static_cast<double>(stamp_ns - start_ns(frame)) * 1e-3);
    }
  }
  const FrameClock clock(radar);
  const std::uint64_t frame_bytes = radar.bytes_per_frame();
  PcapVisitor visitor;
  visitor.data = [&](const DataPacket& packet) {
    const std::uint64_t frame = (packet.byte_count + frame_bytes - 1) / frame_bytes;
    const std::uint64_t last = packet.byte_count + packet.size - 1;
    if (frame * frame_bytes > last || frame < kSettled || frame >= kFrames) return;  // no frame begins in it
    arrival_errors_us.push_back(
        static_cast<double>(clock.startFromPacket(frame, last, packet.stamp_ns) - start_ns(frame)) * 1e-3);
  };
  readPcap(folder.file("packets.pcap"), visitor);
  EXPECT_GT(stamp_errors_us.size(), 150u);
  EXPECT_GT(arrival_errors_us.size(), 150u);
  return {rms_us(stamp_errors_us), rms_us(arrival_errors_us), own_late_us};
}

// What is asked of the clock's stamps: on a machine that plays the card as it was told to, 100 us; on one that is late
// by itself, so that the packets' noise is not the one asked for, a fourth of the noise of the arrivals that it made.
TEST(FrameStamps, JitterBelow100usWhileArrivalsAreMillisecondsLate) {
  constexpr double kQuiet_us = 1e3;  // an eighth of the longest delay asked for
  constexpr int kTries = 6;
  double best_share = 1e9;
  for (unsigned seed = 1; seed <= kTries; ++seed) {
    const Jitter jitter = measure(seed);
    std::printf("seed %u: stamps %.1f us RMS, arrivals %.1f us RMS, this machine's own delay at most %.0f us\n", seed,
                jitter.stamps_us, jitter.arrivals_us, jitter.own_late_us);
    EXPECT_GT(jitter.arrivals_us, 500) << "the card's pacing was not disturbed";
    const double allowed_us = jitter.own_late_us <= kQuiet_us ? 100 : std::max(100., jitter.arrivals_us / 4);
    best_share = std::min(best_share, jitter.stamps_us / allowed_us);
    if (best_share < 1) break;
  }
  RecordProperty("share_of_allowed_jitter", std::to_string(best_share));
  EXPECT_LT(best_share, 1);
}

}  // namespace
}  // namespace mmradartwin
