#include "diagnosis/gain/gain_measurement.h"

#include <gtest/gtest.h>

#include "cabinet_twin.h"
#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

/// Two radars before a cabinet that measure what a twin with a range bias of 1 m simulates.
class BiasedCabinet : public ::testing::Test {
 protected:
  void SetUp() override {
    bias_.values.set("range_m", 1.0);
    const SignalChain chain(data_.radar);
    for (PoseChannels& pose : data_.poses) {
      pose.grid = cabinet_.with({specular_, bias_}).simulate(pose.pose.T_map_radar).grid;
      transformGrid(chain, pose);
    }
  }
  Finding changeOf(ChannelData& data, const std::vector<NamedParameters>& before,
                   const std::vector<NamedParameters>& after) {
    DiagnosisContext context(recording_, twin_, data, options_, options_.accuracy, 2);
    GainMeasurement gain(context);
    Finding finding;
    finding.where.emplace_back();
    gain.ofChange(data, before, data, after, finding);
    return finding;
  }

  CabinetTwin cabinet_;
  NamedParameters specular_ = defaultMechanism("specular"), bias_ = defaultMechanism("range_bias");
  Twin twin_ = cabinet_.with({specular_});
  ChannelData data_ = channelsAt({facingEastAt(0, 0), facingEastAt(0.5, 0.1)});
  Recording recording_;
  DiagnosisOptions options_;
};

TEST_F(BiasedCabinet, IsExplainedByTheBiasAlone) {
  const Finding finding = changeOf(data_, {specular_}, {specular_, bias_});
  ASSERT_TRUE(finding.gain);
  EXPECT_LT(finding.gain->explained_power.before, 0.05);
  EXPECT_GT(finding.gain->explained_power.after, 0.95);
  EXPECT_GT((*finding.gain->explained_power.difference_ci95)[0], 0.9);
  ASSERT_TRUE(finding.maps);
  // From the nearer echo without the bias, 2.5 m, to the farther with it, 4 m.
  ASSERT_TRUE(finding.where[0].range_m);
  EXPECT_NEAR((*finding.where[0].range_m)[0], 2.5, 0.2);
  EXPECT_NEAR((*finding.where[0].range_m)[1], 4, 0.2);
}

TEST_F(BiasedCabinet, OnePlaceAloneHoldsNothingOut) {
  data_.poses.resize(1);
  data_.locations.resize(1);
  EXPECT_FALSE(changeOf(data_, {specular_}, {specular_, bias_}).gain);
}

TEST_F(BiasedCabinet, ItsMapMetricsAreTheTwinsBeforeAndAfter) {
  for (PoseChannels& pose : data_.poses) pose.uncorrected_average = pose.grid;
  recording_.radar = data_.radar;
  DiagnosisContext context(recording_, twin_, data_, options_, options_.accuracy, 2);
  const GainMeasurement measurement(context);
  FindingGain gain;
  measurement.addMetrics({specular_}, std::vector<NamedParameters>{specular_, bias_}, gain);
  EXPECT_GT(gain.q1.before, 0.9);
  EXPECT_EQ(gain.q1.after, 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
