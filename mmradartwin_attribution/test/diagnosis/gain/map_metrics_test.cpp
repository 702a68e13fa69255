#include "diagnosis/gain/map_metrics.h"

#include <gtest/gtest.h>

#include <cmath>

#include "cabinet_twin.h"
#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

/// Radars before the cabinet, each of which measures what a twin with mechanisms of its own simulates.
class MapMetrics : public ::testing::Test {
 protected:
  void SetUp() override { options_.jobs = 1; }
  /// Fills the average of a pose.
  void measure(std::size_t pose, const std::vector<NamedParameters>& mechanisms) {
    data_.poses[pose].uncorrected_average = cabinet_.with(mechanisms).simulate(data_.poses[pose].pose.T_map_radar).grid;
  }
  FindingGain gain(const std::vector<NamedParameters>& before, const std::vector<std::vector<NamedParameters>>& after,
                   const std::function<int(int)>& fold_of) {
    FindingGain gain;
    addMapMetrics(recording_, twin_, data_, before, after, fold_of, options_, gain);
    return gain;
  }
  static NamedParameters bias(double bias_m) {
    NamedParameters mechanism = defaultMechanism("range_bias");
    mechanism.values.set("range_m", bias_m);
    return mechanism;
  }

  CabinetTwin cabinet_;
  NamedParameters specular_ = defaultMechanism("specular");
  Twin twin_ = cabinet_.with({specular_});
  ChannelData data_ = channelsAt({facingEastAt(0, 0), facingEastAt(0.5, 0.1), facingEastAt(0.8, -0.1)});
  Recording recording_ = [] {
    Recording recording;
    recording.radar = paperRadar();
    return recording;
  }();
  EvaluationOptions options_;
};

TEST_F(MapMetrics, AreThoseOfEqualMapsWhereTheTwinIsTheTruth) {
  for (std::size_t pose = 0; pose < 3; ++pose) measure(pose, {specular_, bias(1)});
  const FindingGain found = gain({specular_}, {{specular_, bias(1)}}, [](int) { return 0; });
  EXPECT_EQ(found.q1.after, 0);
  EXPECT_EQ(found.q2.after, 0);
  for (const GainMetric& count : found.classes) EXPECT_EQ(count.after, 0);
  // A metre aside, the echo is missing where it was measured and is one where none was: all of the map's power.
  EXPECT_GT(found.q1.before, 0.9);
  EXPECT_GT(found.q2.before, 0.9);
  double residuals = 0;
  for (const GainMetric& count : found.classes) residuals += count.before;
  EXPECT_EQ(residuals, 6);  // three measured, three simulated
  ASSERT_TRUE(found.q1.difference_ci95);
  EXPECT_LT((*found.q1.difference_ci95)[1], -0.9);
}

TEST_F(MapMetrics, RecallCountsTheCabinetsFront) {
  for (std::size_t pose = 0; pose < 3; ++pose) measure(pose, {specular_});
  const FindingGain found = gain({specular_, bias(1)}, {{specular_}}, [](int) { return 0; });
  EXPECT_EQ(found.recall.before, 0);
  EXPECT_EQ(found.recall.after, 1);
  EXPECT_TRUE(std::isnan(found.recall_band[0].after));  // nothing stands near
  EXPECT_EQ(found.recall_band[1].after, 1);
  EXPECT_NEAR(found.q3_median_db.after, 0, 1e-6);
}

TEST_F(MapMetrics, EachPlaceIsJudgedByTheFoldThatDidNotSeeIt) {
  for (std::size_t pose = 0; pose < 3; ++pose) measure(pose, {specular_, bias(pose == 0 ? 1 : -1)});
  const std::vector<std::vector<NamedParameters>> folds = {{specular_, bias(1)}, {specular_, bias(-1)}};
  const FindingGain right = gain({specular_}, folds, [](int location) { return location == 0 ? 0 : 1; });
  EXPECT_EQ(right.q1.after, 0);
  const FindingGain wrong = gain({specular_}, folds, [](int location) { return location == 0 ? 1 : 0; });
  EXPECT_GT(wrong.q1.after, 0.9);
}

TEST_F(MapMetrics, PosesWithoutAnAverageAreLeftOut) {
  measure(0, {specular_});
  const FindingGain found = gain({specular_, bias(1)}, {{specular_}}, [](int) { return 0; });
  double residuals = 0;
  for (const GainMetric& count : found.classes) residuals += count.before;
  EXPECT_EQ(residuals, 2);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
