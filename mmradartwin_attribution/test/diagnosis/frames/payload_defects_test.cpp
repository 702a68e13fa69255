#include "diagnosis/frames/payload_defects.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>

#include "diagnosis/frames/drawn_frames.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr std::size_t kPacketValues = 728;  // 1456 bytes of int16

/// Echoes that stand, on the paper's radar: 1024 values a frame, so that packets lie anyhow in frames.
class PayloadDefectsTest : public ::testing::Test {
 protected:
  Payload draw(int frames, double amplitude = 2000, double noise_rms = 5) {
    DrawnFrames drawn(radar_);
    return toPayload(drawn.cubes(frames, noise_rms,
                                 [&](const SamplePlace& at) {
                                   return echoSample(radar_, amplitude, 2.3, 0.4, at) +
                                          echoSample(radar_, 0.6 * amplitude, 4.1, -0.3, at);
                                 }),
                     order_);
  }
  static void zero(Payload& p, std::size_t packet) {
    const std::size_t begin = packet * kPacketValues, end = std::min(begin + kPacketValues, p.value.size());
    std::fill(p.value.begin() + static_cast<long>(begin), p.value.begin() + static_cast<long>(end), std::int16_t{0});
  }
  /// The stream as the card would have sent it without some packets, as far as it makes whole frames.
  static void loseUnfilled(Payload& p, std::size_t packet, std::size_t packets) {
    const auto from = p.value.begin() + static_cast<long>(packet * kPacketValues);
    p.value.erase(from, from + static_cast<long>(packets * kPacketValues));
    p.frames = static_cast<int>(p.value.size() / p.frame_values);
    p.value.resize(static_cast<std::size_t>(p.frames) * p.frame_values);
    p.use.resize(p.value.size());
    p.sequence.resize(static_cast<std::size_t>(p.frames));
  }
  RadarConfig radar_ = paperRadar();
  std::vector<int> order_ = payloadOrder(radar_);
};

// SWRA581B: per sample four lanes' I, then four lanes' Q.
TEST(PayloadOrder, IsThatOfFourLanes) {
  const RadarConfig radar = paperRadar();
  const std::vector<int> order = payloadOrder(radar);
  ASSERT_EQ(order.size(), 2u * 64 * 4 * 2);
  for (int chirp = 0; chirp < 2; ++chirp) {
    for (int n = 0; n < 64; ++n) {
      for (int iq = 0; iq < 2; ++iq) {
        for (int r = 0; r < 4; ++r) {
          const int place = ((chirp * 64 + n) * 2 + iq) * 4 + r;
          EXPECT_EQ(order[static_cast<std::size_t>(place)], ((chirp * 64 + n) * 4 + r) * 2 + iq);
        }
      }
    }
  }
}

TEST(PayloadOrder, MarksLanesThatAreNotInUse) {
  RadarConfig radar = paperRadar();
  radar.rx_position_m.pop_back();
  const std::vector<int> order = payloadOrder(radar);
  ASSERT_EQ(order.size(), 2u * 64 * 4 * 2) << "four lanes are always sent";
  std::set<int> places;
  for (std::size_t i = 0; i < order.size(); ++i) {
    EXPECT_EQ(order[i] < 0, i % 4 == 3) << i;
    if (order[i] >= 0) places.insert(order[i]);
  }
  EXPECT_EQ(places.size(), 2u * 64 * 3 * 2) << "every value of the cube once";
  EXPECT_EQ(*places.rbegin(), 2 * 64 * 3 * 2 - 1);
}

TEST_F(PayloadDefectsTest, FlaggedChirpsAreNotUsed) {
  DrawnFrames drawn(radar_);
  std::vector<AdcCube> cubes = drawn.cubes(3, 5, [](const SamplePlace&) { return 100.0; });
  cubes[1].chirp_valid[1] = 0;
  const Payload p = toPayload(cubes, order_);
  ASSERT_EQ(p.value.size(), 3u * 1024);
  EXPECT_EQ(p.sequence, (std::vector<std::uint32_t>{0, 1, 2}));
  for (int f = 0; f < 3; ++f) {
    for (std::size_t i = 0; i < 1024; ++i) EXPECT_EQ(p.use[p.at(f, i)] == 0, f == 1 && i >= 512) << f << " " << i;
  }
}

TEST_F(PayloadDefectsTest, FindsPacketsOfZeros) {
  Payload p = draw(40);
  const Payload whole = p;
  const std::set<std::size_t> lost{0, 7, 8, 31};
  for (std::size_t packet : lost) zero(p, packet);
  const ZeroedPackets found = markZeroedPackets(p, order_);
  EXPECT_EQ(found.packets, 57) << "40 * 1024 / 728, rounded up";
  EXPECT_EQ(found.lost, 4);
  EXPECT_GT(found.log_likelihood_gain, 1000);
  for (std::size_t i = 0; i < p.value.size(); ++i) EXPECT_EQ(p.use[i] == 0, lost.count(i / kPacketValues) > 0) << i;
}

TEST_F(PayloadDefectsTest, FindsTheShortLastPacket) {
  Payload p = draw(40);
  zero(p, 56);
  EXPECT_EQ(markZeroedPackets(p, order_).lost, 1);
  EXPECT_EQ(std::accumulate(p.use.begin(), p.use.end(), 0u), 56 * kPacketValues);
}

TEST_F(PayloadDefectsTest, ZerosOfAWeakSignalAreNoLoss) {
  Payload silent = draw(40, 0, 0);
  EXPECT_EQ(markZeroedPackets(silent, order_).lost, 0) << "nothing but zeros";
  Payload whole = draw(40);
  EXPECT_EQ(markZeroedPackets(whole, order_).lost, 0);
  EXPECT_EQ(std::accumulate(whole.use.begin(), whole.use.end(), 0u), whole.use.size());
}

TEST_F(PayloadDefectsTest, FindsWhereAndHowManyPacketsAreMissing) {
  for (std::size_t packets : {1u, 3u}) {
    for (std::size_t packet : {4u, 28u, 50u}) {
      Payload p = draw(40);
      loseUnfilled(p, packet, packets);
      const std::optional<Slip> slip = findSlip(p);
      ASSERT_TRUE(slip) << packet;
      EXPECT_EQ(slip->position, packet * kPacketValues);
      EXPECT_EQ(slip->packets, static_cast<int>(packets));
      EXPECT_GT(slip->log_likelihood_gain, 1000);
    }
  }
}

TEST_F(PayloadDefectsTest, ClosedSlipsPutValuesBack) {
  const Payload whole = draw(40);
  Payload p = whole;
  loseUnfilled(p, 20, 2);
  const std::optional<Slip> slip = findSlip(p);
  ASSERT_TRUE(slip);
  closeSlip(*slip, p);
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    const bool missing = i / kPacketValues == 20 || i / kPacketValues == 21;
    EXPECT_EQ(p.use[i] == 0, missing) << i;
    if (!missing) {
      EXPECT_EQ(p.value[i], whole.value[i]) << i;
    }
  }
  EXPECT_FALSE(findSlip(p)) << "nothing is left to find";
}

TEST_F(PayloadDefectsTest, FindsNoSlipWhereNoneIs) {
  EXPECT_FALSE(findSlip(draw(40)));
  EXPECT_FALSE(findSlip(draw(1)));
  EXPECT_FALSE(findSlip(draw(40, 0, 5))) << "noise alone";
  // A tone that turns from frame to frame: frames differ, always.
  DrawnFrames drawn(radar_);
  const Payload turning =
      toPayload(drawn.cubes(40, 5,
                            [&](const SamplePlace& at) {
                              return std::polar(3000.0, 1.1 * at.frame) * echoSample(radar_, 1, 2.3, 0.4, at);
                            }),
                order_);
  EXPECT_FALSE(findSlip(turning));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
