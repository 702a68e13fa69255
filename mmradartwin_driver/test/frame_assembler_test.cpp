#include "mmradartwin_driver/frame_assembler.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

#include "assembly_scenario.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "packet_stream.h"

namespace mmradartwin {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;

/// Frames handed out, with the epoch they were counted in.
struct Collected {
  std::vector<AdcCube> cubes;
  std::vector<std::uint64_t> epochs;
};

struct Bench {
  explicit Bench(const RadarConfig& radar, const FrameAssembler::Options& options = {})
      : radar_(radar),
        assembler(
            radar,
            [this](AdcCube&& cube) {
              collected.epochs.push_back(assembler.counters().epochs);
              collected.cubes.push_back(std::move(cube));
            },
            options) {}
  /// `count` packets of 1456 bytes from number `first` on, `interval_ns` apart.
  void feed(std::uint64_t epoch, std::uint64_t first, std::uint64_t count, std::int64_t interval_ns = kMillisecond) {
    for (std::uint64_t i = first; i < first + count; ++i) feedOne(epoch, i, interval_ns);
  }
  void feedOne(std::uint64_t epoch, std::uint64_t i, std::int64_t after_ns = 36000, std::size_t size = 1456) {
    now_ns += after_ns;
    ArrivingPacket packet{static_cast<std::uint32_t>(i + 1), i * 1456, std::vector<std::uint8_t>(size), now_ns};
    for (std::size_t k = 0; k < size; ++k) packet.payload[k] = streamByte(epoch, packet.offset + k);
    assembler.add(packet.view());
  }
  RadarConfig radar_;
  Collected collected;
  FrameAssembler assembler;
  std::int64_t now_ns = 1'000'000'000;
};

std::int16_t expectedWord(std::uint64_t epoch, std::uint64_t byte) {
  return static_cast<std::int16_t>(streamByte(epoch, byte) | streamByte(epoch, byte + 1) << 8);
}

/// Holds a cube against the bytes that arrived of its frame: each in its place, the rest zero and flagged.
void expectFrame(const RadarConfig& radar, const AdcCube& cube, std::uint64_t epoch, std::uint64_t frame,
                 const std::vector<bool>& arrived) {
  const std::size_t bytes = radar.bytes_per_frame();
  ASSERT_EQ(static_cast<std::uint32_t>(frame), cube.sequence);
  ASSERT_EQ(bytes / 2, cube.data.size());
  ASSERT_EQ(static_cast<std::size_t>(cube.chirps), cube.chirp_valid.size());
  std::size_t lost = 0;
  std::vector<std::uint8_t> valid(cube.chirps, 1);
  for (std::size_t byte = 0; byte < bytes; ++byte) {
    if (arrived[byte]) continue;
    ++lost;
    valid[byte * cube.chirps / bytes] = 0;
  }
  EXPECT_EQ(lost, cube.lost_bytes) << "frame " << frame;
  EXPECT_EQ(valid, cube.chirp_valid) << "frame " << frame;
  for (std::size_t word = 0; word < cube.data.size(); ++word) {
    const std::size_t at = byteOfWord(radar, word);
    const std::int16_t expected =
        arrived[at] && arrived[at + 1] ? expectedWord(epoch, frame * bytes + at) : std::int16_t{0};
    ASSERT_EQ(expected, cube.data[word]) << "frame " << frame << " byte " << at;
  }
}

std::vector<bool> all(const RadarConfig& radar) { return std::vector<bool>(radar.bytes_per_frame(), true); }

TEST(FrameAssembler, HandsOutEachFrameWhenItsLastByteIsThere) {
  Bench bench(paperRadar());
  const std::vector<std::size_t> frames_after = {0, 1, 2, 2, 3, 4};  // floor(1456 (i + 1) / 2048)
  for (std::size_t i = 0; i < frames_after.size(); ++i) {
    bench.feed(0, i, 1);
    EXPECT_EQ(frames_after[i], bench.collected.cubes.size()) << i;
  }
  for (std::size_t f = 0; f < 4; ++f) expectFrame(bench.radar_, bench.collected.cubes[f], 0, f, all(bench.radar_));
  EXPECT_EQ(0u, bench.assembler.counters().lost_bytes);
}

TEST(FrameAssembler, LossAcrossAFrameBorderShiftsNothing) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 1);
  bench.feed(0, 2, 8, 36 * kMillisecond);  // packet 1 spans the border at 2048
  const auto& cubes = bench.collected.cubes;
  ASSERT_GE(cubes.size(), 3u);
  std::vector<bool> first = all(bench.radar_), second = all(bench.radar_);
  std::fill(first.begin() + 1456, first.end(), false);
  std::fill(second.begin(), second.begin() + (2912 - 2048), false);
  expectFrame(bench.radar_, cubes[0], 0, 0, first);
  expectFrame(bench.radar_, cubes[1], 0, 1, second);
  expectFrame(bench.radar_, cubes[2], 0, 2, all(bench.radar_));
  EXPECT_EQ((std::vector<std::uint8_t>{1, 0}), cubes[0].chirp_valid);
  EXPECT_EQ((std::vector<std::uint8_t>{0, 1}), cubes[1].chirp_valid);
  EXPECT_EQ(1456u, bench.assembler.counters().lost_bytes);
  EXPECT_EQ(2u, bench.assembler.counters().incomplete_frames);
}

TEST(FrameAssembler, WholeFramesLostAreAGapInTheSequence) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 3);
  bench.feed(0, 300, 10);
  bench.assembler.flush();
  const auto& cubes = bench.collected.cubes;
  EXPECT_EQ(0u, cubes[0].sequence);
  EXPECT_EQ(1u, cubes[1].sequence);
  EXPECT_EQ(2u, cubes[2].sequence);    // 272 bytes of it had come
  EXPECT_EQ(213u, cubes[3].sequence);  // 300 * 1456 / 2048 = 213.28
  EXPECT_EQ(210u, bench.assembler.counters().missing_frames);
  EXPECT_EQ((300u - 3u) * 1456u + (221 * 2048 - 310 * 1456), bench.assembler.counters().lost_bytes);
}

TEST(FrameAssembler, APacketMayBeTwoFramesLate) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 1);
  bench.feed(0, 2, 2);  // up to byte 5824, the late one belongs to frames 0 and 1
  EXPECT_TRUE(bench.collected.cubes.empty());
  bench.feed(0, 1, 1);
  ASSERT_EQ(2u, bench.collected.cubes.size());
  bench.feed(0, 4, 1);
  for (std::size_t f = 0; f < 3; ++f) expectFrame(bench.radar_, bench.collected.cubes[f], 0, f, all(bench.radar_));
  EXPECT_EQ(1u, bench.assembler.counters().reordered_packets);
}

TEST(FrameAssembler, DuplicatesChangeNothing) {
  Bench bench(paperRadar());
  for (int i = 0; i < 40; ++i) {
    bench.feed(0, i, 1);
    bench.feedOne(0, i, 1000);
    if (i >= 2) bench.feedOne(0, i - 2, 1000);
  }
  bench.assembler.flush();
  ASSERT_EQ(29u, bench.collected.cubes.size());  // 58240 bytes are 28.4 frames
  for (std::size_t f = 0; f < 28; ++f) expectFrame(bench.radar_, bench.collected.cubes[f], 0, f, all(bench.radar_));
  EXPECT_EQ(78u, bench.assembler.counters().duplicate_packets);
  EXPECT_EQ(1u, bench.assembler.counters().epochs);
  EXPECT_EQ(40u * 1456, bench.assembler.counters().bytes);
}

TEST(FrameAssembler, HeadLossKeepsTheGrid) {
  Bench bench(paperRadar());
  bench.feed(0, 5, 10);  // byte 7280 = frame 3 at 1136
  bench.assembler.flush();
  std::vector<bool> first = all(bench.radar_);
  std::fill(first.begin(), first.begin() + 1136, false);
  expectFrame(bench.radar_, bench.collected.cubes[0], 0, 3, first);
  expectFrame(bench.radar_, bench.collected.cubes[1], 0, 4, all(bench.radar_));
}

TEST(FrameAssembler, ARestartedCountBeginsANewEpoch) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 100);
  bench.now_ns += 300 * kMillisecond;
  bench.feed(1, 0, 20);
  bench.assembler.flush();
  const auto& [cubes, epochs] = bench.collected;
  ASSERT_EQ(2u, bench.assembler.counters().epochs);
  const auto second = std::find(epochs.begin(), epochs.end(), 2u) - epochs.begin();
  EXPECT_EQ(72, second);  // 145600 bytes are 71.1 frames; the piece is handed out, too
  for (std::size_t f = 0; f < 14; ++f) {
    expectFrame(bench.radar_, cubes[static_cast<std::size_t>(second) + f], 1, f, all(bench.radar_));
  }
}

TEST(FrameAssembler, ARestartWhileTheFirstFramesAreStillOpen) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 1);
  bench.feed(0, 2, 2);  // frame 0 waits for packet 1
  bench.now_ns += 300 * kMillisecond;
  bench.feed(1, 0, 20);  // packet 1 of the new recording would fit the hole
  bench.assembler.flush();
  EXPECT_EQ(2u, bench.assembler.counters().epochs);
  for (std::size_t i = 0; i < bench.collected.cubes.size(); ++i) {
    const AdcCube& cube = bench.collected.cubes[i];
    const std::uint64_t epoch = bench.collected.epochs[i] - 1;
    for (std::size_t word = 0; word < cube.data.size(); ++word) {
      if (cube.data[word] == 0) continue;
      ASSERT_EQ(expectedWord(epoch, cube.sequence * 2048 + byteOfWord(bench.radar_, word)), cube.data[word]);
    }
  }
  EXPECT_EQ(1456u, bench.collected.cubes[0].lost_bytes + bench.collected.cubes[1].lost_bytes);
}

TEST(FrameAssembler, ARestartOfFewPacketsIsFoundAtTheEnd) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 100);
  bench.now_ns += 300 * kMillisecond;
  bench.feed(1, 0, 2);
  bench.assembler.flush();
  EXPECT_EQ(2u, bench.assembler.counters().epochs);
  expectFrame(bench.radar_, bench.collected.cubes[72], 1, 0, all(bench.radar_));
}

TEST(FrameAssembler, ARestartWithLostPacketsOfUnknownLengthsIsFound) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 1);
  bench.now_ns += 300 * kMillisecond;
  // Packets 1 and 3 are lost, and packet 2 alone lies behind the old count.
  std::uint64_t next = 141;
  for (const auto& [sequence, size] :
       {std::pair<std::uint32_t, std::size_t>{2, 395}, {4, 897}, {5, 1118}, {6, 1064}, {7, 155}}) {
    if (sequence == 4) next += 1206;
    ArrivingPacket packet{sequence, next, std::vector<std::uint8_t>(size), bench.now_ns += 36'000};
    for (std::size_t k = 0; k < size; ++k) packet.payload[k] = streamByte(1, next + k);
    bench.assembler.add(packet.view());
    next += size;
  }
  bench.assembler.flush();
  EXPECT_EQ(2u, bench.assembler.counters().epochs);
  for (std::size_t i = 0; i < bench.collected.cubes.size(); ++i) {
    const AdcCube& cube = bench.collected.cubes[i];
    for (std::size_t word = 0; word < cube.data.size(); ++word) {
      if (cube.data[word] == 0) continue;
      ASSERT_EQ(expectedWord(bench.collected.epochs[i] - 1, cube.sequence * 2048 + byteOfWord(bench.radar_, word)),
                cube.data[word]);
    }
  }
}

TEST(FrameAssembler, SuspectsOfAnEarlierStartAreNoCopiesOfLaterPackets) {
  Bench bench(paperRadar());
  bench.feed(0, 1, 2);  // two packets do not confirm each other
  bench.now_ns += 300 * kMillisecond;
  bench.feed(1, 1, 20);
  bench.assembler.flush();
  EXPECT_EQ(20u * 1456, bench.assembler.counters().bytes);
  EXPECT_EQ(2u, bench.assembler.counters().rejected_packets);
  EXPECT_EQ(0u, bench.assembler.counters().duplicate_packets);
  for (const AdcCube& cube : bench.collected.cubes) {
    for (std::size_t word = 0; word < cube.data.size(); ++word) {
      if (cube.data[word] == 0) continue;
      ASSERT_EQ(expectedWord(1, cube.sequence * 2048 + byteOfWord(bench.radar_, word)), cube.data[word]);
    }
  }
}

TEST(FrameAssembler, ArmingLeavesNoDoubt) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 2);
  bench.assembler.restart();
  bench.feed(1, 5, 5);  // lies ahead of the old count: would pass as loss
  bench.assembler.flush();
  ASSERT_FALSE(bench.collected.epochs.empty());
  const auto first = std::find(bench.collected.epochs.begin(), bench.collected.epochs.end(), 2u);
  ASSERT_NE(bench.collected.epochs.end(), first);
  EXPECT_EQ(3u, bench.collected.cubes[first - bench.collected.epochs.begin()].sequence);
}

TEST(FrameAssembler, AStrayDatagramDoesNotThrowTheStreamOff) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 10);
  for (const std::uint64_t stray : {std::uint64_t{1} << 40, std::uint64_t{77} << 33}) {
    ArrivingPacket packet{12345, stray, std::vector<std::uint8_t>(1456, 0x55), bench.now_ns};
    bench.assembler.add(packet.view());
    bench.feed(0, stray >> 40 ? 10 : 20, 10);
  }
  bench.assembler.flush();
  EXPECT_EQ(2u, bench.assembler.counters().rejected_packets);
  EXPECT_EQ(0u, bench.assembler.counters().missing_frames);
  for (std::size_t f = 0; f < 21; ++f) expectFrame(bench.radar_, bench.collected.cubes[f], 0, f, all(bench.radar_));
}

// Found by fuzzing: such a packet was placed 2^48 bytes further on.
TEST(FrameAssembler, ACountThatComesTwiceBeyondAGapShiftsNothing) {
  RadarConfig radar = paperRadar();
  radar.samples_per_chirp = 60;  // 1920 bytes per frame: 2^48 is no whole number of frames
  Bench bench(radar);
  bench.feed(0, 0, 4);
  constexpr std::uint64_t kFar = 100000;  // packets, more than the plausible gap
  bench.feedOne(0, kFar);
  ArrivingPacket again{kFar + 2, kFar * 1456, std::vector<std::uint8_t>(1456), bench.now_ns};
  for (std::size_t k = 0; k < 1456; ++k) again.payload[k] = streamByte(0, again.offset + k);
  bench.assembler.add(again.view());
  bench.feed(0, kFar + 2, 20);
  bench.assembler.flush();
  std::size_t far_frames = 0;
  for (const AdcCube& cube : bench.collected.cubes) {
    if (cube.sequence < 4) continue;
    ++far_frames;
    std::vector<bool> arrived;
    for (std::uint64_t byte = cube.sequence * 1920ull; byte < (cube.sequence + 1ull) * 1920; ++byte) {
      const std::uint64_t packet = byte / 1456;
      arrived.push_back(packet >= kFar && packet != kFar + 1 && packet < kFar + 22);
    }
    expectFrame(radar, cube, 0, cube.sequence, arrived);
  }
  EXPECT_EQ((22 * 1456 + 640u + 1919) / 1920, far_frames);  // the first begins 640 bytes before
  EXPECT_LT(bench.assembler.counters().missing_frames, kFar);
}

TEST(FrameAssembler, StampIsTheFramesStart) {
  Bench bench(paperRadar());
  // The card's clockwork: frame f starts at f * 50 ms, its chirps are there 18.8 us and 37.6 us later, a packet leaves
  // when its last byte is there.
  const std::int64_t start_ns = 5'000'000'000, chirp_ns = 18'800;
  for (std::uint64_t i = 0; i < 100; ++i) {
    const std::uint64_t last = (i + 1) * 1456 - 1;
    bench.now_ns = 0;
    bench.feedOne(0, i,
                  start_ns + static_cast<std::int64_t>(last / 2048 * 50'000'000 + (last % 2048 / 1024 + 1) * chirp_ns));
  }
  ASSERT_EQ(71u, bench.collected.cubes.size());
  for (const AdcCube& cube : bench.collected.cubes) {
    EXPECT_NEAR(static_cast<double>(start_ns + cube.sequence * 50'000'000LL), static_cast<double>(cube.stamp_ns), 1.0);
  }
}

TEST(FrameAssembler, StampWithoutTheFirstPacketComesFromThePeriod) {
  Bench bench(paperRadar());
  const std::int64_t start_ns = 5'000'000'000, chirp_ns = 18'800;
  for (std::uint64_t i = 0; i < 60; ++i) {
    const std::uint64_t last = (i + 1) * 1456 - 1;
    if (i % 7 == 3) continue;
    bench.now_ns = 0;
    const bool flush = i == 59;  // short, 2 s late, and holds the start of frame 41 (byte 83968 of 85904..)
    const std::int64_t sent_ns =
        start_ns + static_cast<std::int64_t>(last / 2048 * 50'000'000 + (last % 2048 / 1024 + 1) * chirp_ns);
    bench.feedOne(0, i, sent_ns + (flush ? 2'000'000'000 : 0), flush ? 300 : 1456);
  }
  bench.assembler.flush();
  EXPECT_GT(bench.assembler.counters().incomplete_frames, 5u);
  for (const AdcCube& cube : bench.collected.cubes) {
    EXPECT_NEAR(static_cast<double>(start_ns + cube.sequence * 50'000'000LL), static_cast<double>(cube.stamp_ns), 2.0)
        << cube.sequence;
  }
}

TEST(FrameClock, LateArrivalsAreNotBelievedPausesAre) {
  FrameClock clock(paperRadar());
  const std::int64_t period = 50 * kMillisecond;
  EXPECT_FALSE(clock.predict(0));
  EXPECT_EQ(0, clock.observe(0, 0));
  for (int f = 1; f < 10; ++f) {
    const std::int64_t late = f * period + 8 * kMillisecond;  // a busy host
    EXPECT_NEAR(f * period, clock.observe(f, late), 10 * 5000.0 + 1);
  }
  EXPECT_EQ(10 * period - 3000, clock.observe(10, 10 * period - 3000));
  EXPECT_EQ(12 * period - 3000, *clock.predict(12));
  EXPECT_EQ(11 * period + 40 * kMillisecond, clock.observe(11, 11 * period + 40 * kMillisecond));
}

/// What a card sends: packets of 1456 bytes, or as many as `longest` says, one after the other.
std::vector<ArrivingPacket> recording(std::mt19937_64& random, std::uint64_t epoch, std::size_t packets, bool equal) {
  std::vector<ArrivingPacket> sent;
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < packets; ++i) {
    const std::size_t size = equal ? 1456 : std::uniform_int_distribution<std::size_t>(1, 1462)(random);
    ArrivingPacket packet{static_cast<std::uint32_t>(i + 1), at, std::vector<std::uint8_t>(size), 0};
    for (std::size_t k = 0; k < size; ++k) packet.payload[k] = streamByte(epoch, at + k);
    sent.push_back(std::move(packet));
    at += size;
  }
  return sent;
}

/// Chirps that are said to be whole and hold another byte than the recording at their place.
std::size_t wrongChirps(const RadarConfig& radar, const std::vector<AdcCube>& cubes, std::uint64_t epoch) {
  std::size_t wrong = 0;
  const std::size_t words_per_chirp = radar.bytes_per_frame() / 2 / static_cast<std::size_t>(radar.chirps_per_frame());
  for (const AdcCube& cube : cubes) {
    for (std::size_t chirp = 0; chirp < cube.chirp_valid.size(); ++chirp) {
      bool right = true;
      for (std::size_t word = chirp * words_per_chirp; word < (chirp + 1) * words_per_chirp && right; ++word) {
        right =
            cube.data[word] == expectedWord(epoch, cube.sequence * radar.bytes_per_frame() + byteOfWord(radar, word));
      }
      wrong += cube.chirp_valid[chirp] && !right;
    }
  }
  return wrong;
}

std::size_t invalidChirps(const std::vector<AdcCube>& cubes) {
  std::size_t invalid = 0;
  for (const AdcCube& cube : cubes) {
    invalid += static_cast<std::size_t>(std::count(cube.chirp_valid.begin(), cube.chirp_valid.end(), 0));
  }
  return invalid;
}

TEST(FrameAssembler, APacketOfTheRecordingBeforeIsNotBelievedRightAfterArming) {
  for (const std::int64_t interval_ns : {40'000LL, 36'000'000LL}) {
    for (const std::uint64_t stale : {720u, 721u, 60u, 3u}) {
      Bench bench(paperRadar());
      bench.assembler.restart();
      bench.feedOne(5, stale, interval_ns);
      bench.feed(0, 0, 1000, interval_ns);
      bench.assembler.flush();
      EXPECT_EQ(0u, wrongChirps(bench.radar_, bench.collected.cubes, 0)) << stale;
      EXPECT_EQ(1u, bench.assembler.counters().rejected_packets) << stale;
      ASSERT_EQ(711u, bench.collected.cubes.size()) << stale;
      EXPECT_EQ(1u, invalidChirps(bench.collected.cubes)) << "of the last frame, which has not ended";
    }
  }
}

TEST(FrameAssembler, APacketOfTheRecordingBeforeIsNotBelievedWhereTheFirstOnesAreLost) {
  Bench bench(paperRadar());
  bench.assembler.restart();
  bench.feedOne(5, 720);
  bench.feed(0, 100, 900);
  bench.assembler.flush();
  EXPECT_EQ(0u, wrongChirps(bench.radar_, bench.collected.cubes, 0));
  EXPECT_EQ(900u * 1456, bench.assembler.counters().bytes);
}

/// Flips `share` of the headers: any one of their ten bytes becomes any other. Between two of them at least `apart`
/// packets lie. Returns how many.
std::size_t flipHeaders(std::mt19937_64& random, double share, std::size_t apart,
                        std::vector<ArrivingPacket>& packets) {
  std::size_t flipped = 0, since = apart;
  for (ArrivingPacket& packet : packets) {
    if (++since <= apart || std::uniform_real_distribution<double>()(random) >= share) continue;
    since = 0;
    const unsigned byte = static_cast<unsigned>(random() % 10);
    const std::uint64_t change = (1 + random() % 255) << 8 * (byte < 4 ? byte : byte - 4);
    if (byte < 4) {
      packet.sequence ^= static_cast<std::uint32_t>(change);
    } else {
      packet.offset ^= change;
    }
    ++flipped;
  }
  return flipped;
}

struct FlipCase {
  const char* name;
  bool equal;
  double loss, duplicate, reorder, truncate, flipped;
  int depth;
  std::int64_t interval_ns;
};

TEST(FrameAssembler, AWrongHeaderPutsNoByteWhereItDoesNotBelong) {
  const std::vector<FlipCase> cases = {
      {"one in a hundred, as the card sends", true, 0, 0, 0, 0, 0.01, 1, 36'000},
      {"the same at 20 frames a second", true, 0, 0, 0, 0, 0.01, 1, 36'000'000},
      {"one in five", true, 0, 0, 0, 0, 0.2, 1, 36'000},
      {"with all that may befall packets", true, 0.1, 0.1, 0.1, 0.02, 0.02, 20, 36'000},
      {"of varying lengths", false, 0, 0, 0, 0, 0.01, 1, 36'000},
      {"of varying lengths at 20 frames a second", false, 0, 0, 0, 0, 0.01, 1, 36'000'000},
  };
  std::mt19937_64 random(20261129);
  for (const FlipCase& c : cases) {
    SCOPED_TRACE(c.name);
    std::size_t packets = 0, flipped = 0, wrong = 0, invalid = 0, chirps = 0;
    const int runs = std::getenv("MMRADARTWIN_LONG") ? 1000 : 20;
    for (int run = 0; run < runs; ++run) {
      Bench bench(paperRadar());
      Impairment how;
      how.loss = c.loss, how.duplicate = c.duplicate, how.reorder = c.reorder, how.truncate = c.truncate;
      how.depth = c.depth;
      std::vector<ArrivingPacket> arriving = impair(random, recording(random, 0, 1500, c.equal), how);
      flipped += flipHeaders(random, c.flipped, c.equal ? 0 : 8, arriving);
      for (ArrivingPacket& packet : arriving) {
        packet.stamp_ns = bench.now_ns += c.interval_ns;
        bench.assembler.add(packet.view());
      }
      bench.assembler.flush();
      packets += arriving.size();
      wrong += wrongChirps(bench.radar_, bench.collected.cubes, 0);
      invalid += invalidChirps(bench.collected.cubes);
      chirps += bench.collected.cubes.size() * 2;
    }
    EXPECT_EQ(0u, wrong) << "of " << chirps << " in " << packets << " packets, " << flipped << " with a wrong header";
    std::printf("%s: %zu packets, %zu wrong headers, %zu of %zu chirps flagged\n", c.name, packets, flipped, invalid,
                chirps);
    if (c.loss > 0) continue;
    // A packet touches three chirps at most, and its wrong header costs no others.
    EXPECT_LE(invalid, 3 * flipped + static_cast<std::size_t>(runs));
  }
}

TEST(FrameAssembler, PacketsDisplacedBySixtyFourLoseNothing) {
  std::mt19937_64 random(64);
  for (const int depth : {8, 32, 64}) {
    Bench bench(paperRadar());
    std::vector<ArrivingPacket> sent = recording(random, 0, 20000, true);
    Impairment how;
    how.reorder = 0.1;
    how.depth = depth - 1;  // the half that is added rounds up
    how.spared = 1;
    for (ArrivingPacket& packet : impair(random, sent, how)) {
      packet.stamp_ns = bench.now_ns += 40'000;
      bench.assembler.add(packet.view());
    }
    EXPECT_GT(bench.assembler.counters().reordered_packets, 1000u);
    EXPECT_EQ(0u, bench.assembler.counters().incomplete_frames) << depth;
    EXPECT_EQ(0u, bench.assembler.counters().late_packets) << depth;
    EXPECT_EQ(20000u * 1456, bench.assembler.counters().bytes);
    EXPECT_EQ(0u, wrongChirps(bench.radar_, bench.collected.cubes, 0));
  }
}

TEST(FrameAssembler, AFrameWithAHoleWaitsNoLongerThanPacketsMayBeLate) {
  Bench bench(paperRadar());
  bench.feed(0, 0, 20, 36 * kMillisecond);
  const std::size_t before = bench.collected.cubes.size();
  bench.feed(0, 21, 5, 36 * kMillisecond);  // up to byte 37856: more than 5888 beyond the end of the torn frame, 14
  EXPECT_GE(bench.collected.cubes.size(), before + 3);
}

/// Recordings that follow each other unannounced; the first packets of the later one are lost.
TEST(FrameAssembler, RestartsThatLandAheadOfTheCountAreSeenWhereTheSequenceGoesBack) {
  for (const std::uint64_t seed : {5795, 10211, 11399, 14426, 28052, 38726}) {
    const AssemblyScenario scenario = runAssemblyScenario(seed);
    EXPECT_EQ(0u, scenario.misplaced) << "seed " << seed;
    EXPECT_EQ(0u, scenario.unflagged) << "seed " << seed;
    EXPECT_EQ("", scenario.problem) << "seed " << seed;
  }
}

TEST(FrameAssembler, ASequenceThatGoesBackBehindSuspectsIsALaterRecording) {
  std::mt19937_64 random(7);
  Bench bench(paperRadar());
  const auto give = [&](std::vector<ArrivingPacket>& packets, std::size_t from, std::size_t count) {
    for (std::size_t i = from; i < from + count; ++i) {
      packets[i].stamp_ns = bench.now_ns += 40'000;
      bench.assembler.add(packets[i].view());
    }
    bench.now_ns += 100 * kMillisecond;
  };
  std::vector<ArrivingPacket> first = recording(random, 0, 10, true), second = recording(random, 1, 40, true);
  for (ArrivingPacket& packet : first) {
    if (packet.sequence > 1) packet.offset += 16;  // what the first packet says fits none of the others
  }
  give(first, 0, 1);
  give(first, 5, 3);
  // Its sequence number and count go on where the first recording's first packet ended.
  give(second, 1, 39);
  bench.assembler.flush();
  EXPECT_EQ(2u, bench.assembler.counters().epochs);
}

/// 900 scenarios; `benchmark_scenarios` runs as many as one likes.
class AssemblyScenarios : public testing::TestWithParam<int> {};

TEST_P(AssemblyScenarios, EveryByteIsInItsPlaceOrFlaggedLost) {
  for (int seed = GetParam() * 50; seed < (GetParam() + 1) * 50; ++seed) {
    const AssemblyScenario scenario = runAssemblyScenario(static_cast<std::uint64_t>(seed));
    EXPECT_EQ(0u, scenario.misplaced) << "seed " << seed;
    EXPECT_EQ(0u, scenario.unflagged) << "seed " << seed;
    EXPECT_EQ("", scenario.problem) << "seed " << seed;
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AssemblyScenarios, testing::Range(0, 18));

}  // namespace
}  // namespace mmradartwin
