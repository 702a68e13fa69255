#include "diagnosis/receiver/body_fixed_tone.h"

#include <gtest/gtest.h>

#include <random>

#include "diagnosis/channels/drawn_channels.h"

namespace mmradartwin::diagnosis {
namespace {

/// Echoes of another phase and place at every pose, and a tone that is the same at all of them.
class BodyFixedToneTest : public ::testing::Test {
 protected:
  ChannelData draw(int poses, const std::function<void(ComplexGrid&)>& change) {
    std::uniform_real_distribution<double> sine(-0.7, 0.7), phase(-M_PI, M_PI), range_m(0.5, 6);
    const double noise_power = 1e-10;
    std::normal_distribution<double> noise(0, std::sqrt(0.5 * noise_power * 32 * 32 / 24.0));
    std::vector<ComplexGrid> grids;
    for (int i = 0; i < poses; ++i) {
      ComplexGrid x = ComplexGrid::Zero(8, 64);
      for (int e = 0; e < 8; ++e) {
        addTone(radar_, range_m(random_), std::polar(0.01, phase(random_)) * arrayResponse(radar_, sine(random_)), x);
      }
      for (std::complex<double>& v : x.reshaped()) v += std::complex<double>(noise(random_), noise(random_));
      if (change) change(x);
      grids.push_back(x);
    }
    return sessionOf(radar_, grids, noise_power);
  }
  /// What leaks has any channels.
  static Eigen::VectorXcd leakage() {
    Eigen::VectorXcd v(8);
    const double phase[] = {0.3, 2.0, -1.4, 0.9, -2.6, 1.1, 3.0, -0.4};
    for (int k = 0; k < 8; ++k) v[k] = std::polar(0.01 * (1 + 0.1 * (k % 3)), phase[k]);
    return v;
  }
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{4};
};

TEST_F(BodyFixedToneTest, NoneWhereEchoesStandAlone) {
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(isUnambiguous(findBodyFixedTone(draw(12, {}))));
}

TEST_F(BodyFixedToneTest, HasItsRangeAndChannels) {
  for (double range_m : {0.03, 0.08, 0.14}) {
    const BodyFixedTone tone =
        findBodyFixedTone(draw(12, [&](ComplexGrid& x) { addTone(radar_, range_m, leakage(), x); }));
    ASSERT_TRUE(isUnambiguous(tone)) << range_m;
    EXPECT_NEAR(tone.range_m, range_m, 0.002);
    EXPECT_NEAR(tone.range_m, range_m, 5 * tone.range_error_m);
    EXPECT_LT((tone.channels - leakage()).norm(), 0.05 * leakage().norm());
    EXPECT_LT(tone.array_share, 0.6) << "no direction";
    EXPECT_GT(tone.gain, 100);
  }
}

TEST_F(BodyFixedToneTest, IsTakenOutOfAllPoses) {
  ChannelData clean = draw(12, {});
  random_.seed(4);
  ChannelData data = draw(12, [&](ComplexGrid& x) { addTone(radar_, 0.08, leakage(), x); });
  BodyFixedTone tone;
  tone.range_m = 0.08;
  tone.channels = leakage();
  subtractTone(tone, data);
  for (std::size_t i = 0; i < data.poses.size(); ++i) {
    EXPECT_LT((data.poses[i].grid.x - clean.poses[i].grid.x).norm(), 1e-9);
    EXPECT_LT((data.poses[i].range_spectra - clean.poses[i].range_spectra).norm(), 1e-9);
  }
}

TEST_F(BodyFixedToneTest, LiesBehindTheRadarWhereSamplesAreConjugated) {
  const auto leak = [&](ComplexGrid& x) { addTone(radar_, 0.08, leakage(), x); };
  const BodyFixedTone before = findBodyFixedTone(draw(12, leak), true);
  EXPECT_GT(before.range_m, 0);
  EXPECT_LT(before.behind, -12);
  const BodyFixedTone behind = findBodyFixedTone(draw(12,
                                                      [&](ComplexGrid& x) {
                                                        leak(x);
                                                        x = x.conjugate().eval();
                                                      }),
                                                 true);
  EXPECT_LT(behind.range_m, 0);
  EXPECT_GT(behind.behind, 12);
}

TEST_F(BodyFixedToneTest, ConstantIsNeitherBeforeNorBehind) {
  const BodyFixedTone tone = findBodyFixedTone(draw(12, [&](ComplexGrid& x) { x.colwise() += leakage(); }), true);
  ASSERT_TRUE(isUnambiguous(tone));
  EXPECT_NEAR(tone.range_m, 0, 0.002);
  EXPECT_LT(tone.behind, 12);
}

TEST_F(BodyFixedToneTest, OfOnePoseIsWhatIsNoArrayResponse) {
  const auto strong = [&](ComplexGrid& x) { addTone(radar_, 0.08, 3 * leakage(), x); };
  const BodyFixedTone tone = findBodyFixedTone(draw(1, strong));
  EXPECT_TRUE(isUnambiguous(tone)) << tone.gain;
  EXPECT_NEAR(tone.range_m, 0.08, 0.02);
  // An echo as near as that comes from one direction.
  const BodyFixedTone echo =
      findBodyFixedTone(draw(1, [&](ComplexGrid& x) { addTone(radar_, 0.08, 0.03 * arrayResponse(radar_, 0.3), x); }));
  EXPECT_FALSE(isUnambiguous(echo));
  EXPECT_GT(echo.array_share, 0.9);
}

TEST_F(BodyFixedToneTest, EchoesOfTheSameWallAtAllPosesAreNone) {
  // The same range at every pose, but another phase, evenly around the circle: a radar carried along a wall.
  int pose = 0;
  const BodyFixedTone tone = findBodyFixedTone(draw(
      12, [&](ComplexGrid& x) { addTone(radar_, 0.1, std::polar(1.0, 2 * M_PI * 5 * pose++ / 12) * leakage(), x); }));
  EXPECT_FALSE(isUnambiguous(tone));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
