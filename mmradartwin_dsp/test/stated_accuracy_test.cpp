#include "mmradartwin_dsp/stated_accuracy.h"

#include <gtest/gtest.h>

#include <string>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

std::string errorOf(const std::string& yaml) {
  try {
    readStatedAccuracy(YamlMap::parse(yaml, "session.yaml"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(StatedAccuracy, KeysThatAreLeftOutKeepTheirValue) {
  StatedAccuracy coarse;
  coarse.level_db = 3;
  const StatedAccuracy accuracy =
      with(coarse, readStatedAccuracy(YamlMap::parse("{scene_m: 0.05, heading_deg: 1.0}", "session.yaml")));
  EXPECT_EQ(accuracy.scene_m, 0.05);
  EXPECT_EQ(accuracy.heading_deg, 1.0);
  EXPECT_EQ(accuracy.level_db, 3);
  EXPECT_EQ(accuracy.pose_m, StatedAccuracy().pose_m);
}

TEST(StatedAccuracy, EveryKeySetsItsOwnMember) {
  for (const AccuracyKey& key : accuracyKeys()) {
    const double value = 0.5 * (key.min + key.max);
    const StatedAccuracy accuracy = with({}, {{key.name, value}});
    for (const AccuracyKey& other : accuracyKeys()) {
      EXPECT_EQ(accuracy.*other.member, &other == &key ? value : StatedAccuracy().*other.member)
          << key.name << " and " << other.name;
    }
  }
}

TEST(StatedAccuracy, RefusesValuesOutOfRangeAndUnknownKeys) {
  const std::string too_large = errorOf("{scene_m: 0.6}");
  EXPECT_NE(too_large.find("session.yaml"), std::string::npos) << too_large;
  EXPECT_NE(too_large.find("scene_m"), std::string::npos) << too_large;
  EXPECT_NE(too_large.find("0.5"), std::string::npos) << too_large;
  EXPECT_NE(errorOf("{heading_deg: 0}"), "");
  EXPECT_NE(errorOf("{scene_cm: 2}").find("scene_cm"), std::string::npos);
}

TEST(StatedAccuracy, DefaultsLieWithinTheirRanges) {
  for (const AccuracyKey& key : accuracyKeys()) {
    EXPECT_GE(StatedAccuracy().*key.member, key.min) << key.name;
    EXPECT_LE(StatedAccuracy().*key.member, key.max) << key.name;
  }
}

}  // namespace
}  // namespace mmradartwin
