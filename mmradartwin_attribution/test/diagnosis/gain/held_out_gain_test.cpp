#include "diagnosis/gain/held_out_gain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <memory>
#include <random>

#include "cabinet_twin.h"
#include "synthetic_map.h"

namespace mmradartwin::diagnosis {
namespace {

/// Cells of a map that are judged: of the paper's radar range bins 2 to 63, and azimuths within 60 deg.
std::vector<std::pair<double, double>> judgedCells() {
  const RangeAngleAxes axes = SignalChain(paperRadar()).axes();
  std::vector<std::pair<double, double>> cells;
  for (std::size_t bin = 2; bin < axes.range_m.size(); ++bin) {
    for (double azimuth_rad : axes.azimuth_rad) {
      if (std::abs(azimuth_rad) <= M_PI / 3) cells.emplace_back(axes.range_m[bin], azimuth_rad);
    }
  }
  return cells;
}

ChannelData places(int count) {
  return channelsAt(std::vector<Eigen::Isometry3d>(static_cast<std::size_t>(count), Eigen::Isometry3d::Identity()));
}

TEST(ExplainedPower, FollowsItsClosedForm) {
  // sqrt(g) = (2 * 1 + 3 * 2)/(1 + 4) = 1.6, missed 0.4^2 + 0.2^2 of 13.
  const CellPowers cells{{4, 9}, {1, 4}};
  EXPECT_NEAR(explainedPower({cells}), 1 - 0.2 / 13, 1e-12);
  // One gain for all poses, however the cells are spread over them.
  EXPECT_NEAR(explainedPower({{{4}, {1}}, {{9}, {4}}}), 1 - 0.2 / 13, 1e-12);
}

TEST(ExplainedPower, IsOneForAnyCommonLevelAndZeroForNothing) {
  EXPECT_NEAR(explainedPower({{{1, 2, 3}, {0.01, 0.02, 0.03}}}), 1, 1e-12);
  EXPECT_EQ(explainedPower({{{1, 2, 3}, {0, 0, 0}}}), 0);
  EXPECT_EQ(explainedPower({{{0, 0}, {1, 1}}}), 0);
}

TEST(CellPowersOfAPose, MeasuredOnesAreTheSignalChainsMap) {
  ChannelData data = places(1);
  const SignalChain chain(data.radar);
  data.poses[0].grid = synthetic::grid(data.radar, {{3.1, 20, 0}, {5.2, -35, -6}});
  transformGrid(chain, data.poses[0]);
  const RangeAngleMap map = chain.map(data.poses[0].grid);
  const CellPowers cells = cellPowers(data, {PoseEchoes()}).front();
  ASSERT_EQ(cells.measured.size(), judgedCells().size());
  std::size_t j = 0;
  for (std::size_t bin = 2; bin < map.axes.range_m.size(); ++bin) {
    for (std::size_t a = 0; a < map.axes.azimuth_rad.size(); ++a) {
      if (!(std::abs(map.axes.azimuth_rad[a]) <= M_PI / 3)) continue;
      const double power = std::pow(10.0, map.power_db(static_cast<int>(bin), static_cast<int>(a)) / 10);
      EXPECT_NEAR(cells.measured[j], power, 1e-9) << "bin " << bin << ", angle " << a;
      EXPECT_EQ(cells.expected[j], 0);
      ++j;
    }
  }
}

// The expectation of a power whose channels have the covariance c c^H is the power of the channels c.
TEST(CellPowersOfAPose, ExpectedOnesAreThoseOfTheChannelsCovariance) {
  ChannelData data = places(1);
  const int channels = data.radar.channels(), bin = 20;
  Eigen::MatrixXcd y = Eigen::MatrixXcd::Zero(channels, data.radar.samples_per_chirp);
  auto group = std::make_shared<EchoGroup>();
  group->bins.first = bin;
  group->bins.cells = 1;
  group->bins.cosine = {1};
  const std::size_t size = static_cast<std::size_t>(channels) * (channels + 1) / 2;
  group->bins.packed.assign(EchoGroup::Fields::kOfCell * size, {});
  for (int k = 0; k < channels; ++k) y(k, bin) = std::polar(0.3 + 0.1 * k, 0.7 * k * k);
  std::size_t j = 0;
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l) {
      group->bins.packed[j++] = static_cast<std::complex<float>>(y(k, bin) * std::conj(y(l, bin)));
    }
  }
  data.poses[0].range_spectra = y;
  PoseEchoes echoes;
  echoes.groups = {group};
  const CellPowers cells = cellPowers(data, {echoes}).front();
  double most = 0;
  for (double power : cells.measured) most = std::max(most, power);
  ASSERT_GT(most, 0.01);
  for (std::size_t cell = 0; cell < cells.measured.size(); ++cell) {
    EXPECT_NEAR(cells.expected[cell], cells.measured[cell], 1e-6 * most);
  }
}

TEST(ExplainedPowerGain, IsTheDifferenceAndItsIntervalTheSpreadOverPlaces) {
  const ChannelData data = places(2);
  const std::vector<CellPowers> before = {{{4, 9}, {1, 4}}, {{1, 1}, {1, 1}}},
                                after = {{{4, 9}, {4, 9}}, {{1, 1}, {1, 1}}};
  const GainMetric gain = explainedPowerGain(data, before, after);
  // All of them: sqrt(g) = (8 + 2)/(5 + 2), missed by the cells 4, 9, 1 and 1.
  const double root = 10.0 / 7;
  const double missed = std::pow(2 - root, 2) + std::pow(3 - 2 * root, 2) + 2 * std::pow(1 - root, 2);
  EXPECT_NEAR(gain.before, 1 - missed / 15, 1e-12);
  EXPECT_NEAR(gain.after, 1, 1e-12);
  ASSERT_TRUE(gain.difference_ci95);
  // Drawn twice each, the places give the ends.
  const double first = (std::pow(2 - root, 2) + std::pow(3 - 2 * root, 2)) / 13, second = std::pow(1 - root, 2);
  EXPECT_NEAR((*gain.difference_ci95)[0], std::min(first, second), 1e-9);
  EXPECT_NEAR((*gain.difference_ci95)[1], std::max(first, second), 1e-9);
}

TEST(LikelihoodGain, IsTheMeanOverPoses) {
  ChannelData data = places(3);
  data.poses[2].location = 1;
  const GainMetric gain = likelihoodGain(data, {1, 2, 3}, {2, 4, 9});
  EXPECT_NEAR(gain.before, 2, 1e-12);
  EXPECT_NEAR(gain.after, 5, 1e-12);
}

// The percentile interval of 20 places is somewhat narrow: about 92 of 100 instead of 95.
TEST(LikelihoodGain, ItsIntervalCoversTheTrueMean) {
  constexpr int kPlaces = 20, kTrials = 200;
  constexpr double kTrueMean = 3;
  const ChannelData data = places(kPlaces);
  std::mt19937 random(7);
  std::normal_distribution<double> normal(kTrueMean, 2);
  int covered = 0;
  double width = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<double> gains;
    for (int i = 0; i < kPlaces; ++i) gains.push_back(normal(random));
    const auto [low, high] = *likelihoodGain(data, std::vector<double>(kPlaces, 0.0), gains).difference_ci95;
    covered += low <= kTrueMean && kTrueMean <= high;
    width += (high - low) / kTrials;
  }
  EXPECT_GE(covered, 0.87 * kTrials);
  EXPECT_LE(covered, 0.98 * kTrials);
  EXPECT_NEAR(width, 2 * 1.96 * 2 / std::sqrt(kPlaces), 0.15);
}

TEST(GainInNats, NeedsTwoPlacesAndPrefersWhatIsKnownByPose) {
  Finding finding;
  finding.evidence.log_likelihood_gain = 12;
  addGainInNats(places(1), {}, finding);
  EXPECT_FALSE(finding.gain);
  addGainInNats(places(3), {}, finding);
  ASSERT_TRUE(finding.gain);
  EXPECT_EQ(finding.gain->log_likelihood_per_pose.before, 0);
  EXPECT_NEAR(finding.gain->log_likelihood_per_pose.after, 4, 1e-12);
  EXPECT_FALSE(finding.gain->log_likelihood_per_pose.difference_ci95);
  addGainInNats(places(3), {{"1", 6}, {"elsewhere", 50}}, finding);
  EXPECT_NEAR(finding.gain->log_likelihood_per_pose.after, 2, 1e-12);
  EXPECT_TRUE(finding.gain->log_likelihood_per_pose.difference_ci95);
}

/// One pose whose cells are all measured with power 1, of which one cell is expected otherwise.
class OneCellChanged : public ::testing::Test {
 protected:
  OneCellChanged() : cells_(judgedCells()) {
    changed_ = 30 * (cells_.size() / 62) + 10;  // range bin 32
    before_ = {{std::vector<double>(cells_.size(), 1.0), std::vector<double>(cells_.size(), 1.0)}};
    after_ = before_;
    before_[0].expected[changed_] = 1e-4;
    finding_.where.emplace_back();
  }
  std::vector<std::pair<double, double>> cells_;
  std::size_t changed_ = 0;
  std::vector<CellPowers> before_, after_;
  Finding finding_;
};

TEST_F(OneCellChanged, IsWhereTheFindingLiesInTheMaps) {
  measureHeldOutGain(places(1), before_, after_, finding_);
  const auto [range_m, azimuth_rad] = cells_[changed_];
  ASSERT_TRUE(finding_.where[0].range_m && finding_.where[0].azimuth_deg);
  EXPECT_NEAR((*finding_.where[0].range_m)[0], range_m, 1e-9);
  EXPECT_NEAR((*finding_.where[0].range_m)[1], range_m, 1e-9);
  EXPECT_NEAR((*finding_.where[0].azimuth_deg)[0], azimuth_rad * 180 / M_PI, 1e-9);
  EXPECT_NEAR((*finding_.where[0].azimuth_deg)[1], azimuth_rad * 180 / M_PI, 1e-9);
}

TEST_F(OneCellChanged, LeavesAPlaceThatIsKnownAsItIs) {
  finding_.where[0].range_m = {1, 2};
  measureHeldOutGain(places(1), before_, after_, finding_);
  EXPECT_EQ((*finding_.where[0].range_m)[1], 2);
}

TEST_F(OneCellChanged, IsSeenInTheMapsOfTheFigure) {
  measureHeldOutGain(places(1), before_, after_, finding_);
  ASSERT_TRUE(finding_.maps);
  const FindingMaps& maps = *finding_.maps;
  int different = 0;
  for (std::size_t r = 0; r < maps.axes.range_m.size(); ++r) {
    for (std::size_t a = 0; a < maps.axes.azimuth_rad.size(); ++a) {
      const auto row = static_cast<Eigen::Index>(r), column = static_cast<Eigen::Index>(a);
      const bool judged = r >= 2 && std::abs(maps.axes.azimuth_rad[a]) <= M_PI / 3;
      EXPECT_EQ(std::isnan(maps.after_db(row, column)), !judged);
      if (!judged) continue;
      EXPECT_NEAR(maps.after_db(row, column), 0, 1e-9);
      if (maps.before_db(row, column) > -5) continue;
      ++different;
      EXPECT_NEAR(maps.axes.range_m[r], cells_[changed_].first, 1e-9);
      EXPECT_NEAR(maps.before_db(row, column), -40, 0.1);  // the session's one gain makes up for a trace of it
    }
  }
  EXPECT_EQ(different, 1);
}

TEST_F(OneCellChanged, NothingThatChangesHasNoPlace) {
  measureHeldOutGain(places(1), after_, after_, finding_);
  EXPECT_FALSE(finding_.where[0].range_m);
  EXPECT_NEAR(finding_.gain->explained_power.after, 1, 1e-12);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
