#include "diagnosis/receiver/receiver_noise.h"

#include <gtest/gtest.h>

#include <random>

#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {
namespace {

/// Poses whose samples have noise of a level, dB over full scale, good to some error.
ChannelData drawnNoise(double level_dbfs, double scatter_db, int poses = 16) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> scatter(0, scatter_db);
  ChannelData data;
  data.radar = paperRadar();
  for (int i = 0; i < poses; ++i) {
    PoseChannels& p = data.poses.emplace_back();
    p.shots = 20 + i;
    // A cell of an average over so many shots: v sum w^2 / (sum w)^2 / shots, (3N/8) / (N/2)^2 = 3 / (2N).
    const double sample_power = std::pow(10.0, (level_dbfs + scatter(random)) / 10);
    p.shot_noise_power = sample_power * 3 / (2 * 64.0);
  }
  return data;
}

NamedParameters stated(double level_dbfs, double delta_db) {
  NamedParameters m{"noise_floor", {}};
  m.values.set("level_dbfs", level_dbfs);
  m.values.set("delta_db", delta_db);
  return m;
}

TEST(NoiseFloor, DepartsByTheDifferenceOfLevels) {
  const auto found = noiseFloorFinding(drawnNoise(-62, 0.2), stated(-70, 3));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->cause, "noise_floor");
  const FindingParameter& delta = found->parameters.front();
  EXPECT_EQ(delta.name, "delta_db");
  EXPECT_NEAR(std::get<double>(delta.value), 5, 0.15);
  EXPECT_NEAR(delta.ci95[0][1] - delta.ci95[0][0], 2 * 1.96 * 0.2 / 4, 0.1) << "scatter over the root of 16";
  EXPECT_NEAR(found->mechanism->values.number("delta_db"), 8, 0.15) << "beyond what the twin states";
  EXPECT_EQ(found->mechanism->values.number("level_dbfs"), -70);
  EXPECT_LT(found->evidence.false_alarm_rate, 1e-6);
}

TEST(NoiseFloor, IsNoneWhereItAgreesOrNothingWasRead) {
  EXPECT_FALSE(noiseFloorFinding(drawnNoise(-67, 0.05), stated(-70, 3)));
  EXPECT_FALSE(noiseFloorFinding(drawnNoise(-66.8, 0.05), stated(-70, 3))) << "0.2 dB are nobody's floor";
  EXPECT_FALSE(noiseFloorFinding(drawnNoise(-66, 3), stated(-70, 3))) << "within its own error";
  EXPECT_FALSE(noiseFloorFinding(drawnNoise(-60, 0.05, 1), stated(-70, 3)));
  ChannelData silent = drawnNoise(-60, 0.05);
  for (PoseChannels& p : silent.poses) p.shot_noise_power = 0;
  EXPECT_FALSE(noiseFloorFinding(silent, stated(-70, 3)));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
