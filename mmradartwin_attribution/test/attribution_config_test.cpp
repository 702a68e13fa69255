#include "mmradartwin_attribution/attribution_config.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

std::string errorOf(const std::string& yaml) {
  try {
    parseAttributionConfig(yaml, "attribution.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(AttributionConfig, DefaultsAreThoseOfTheDesign) {
  const AttributionConfig c;
  constexpr double kDegree = M_PI / 180;
  EXPECT_DOUBLE_EQ(c.min_range_m, 0.16);
  EXPECT_DOUBLE_EQ(c.max_azimuth_rad, 60 * kDegree);
  EXPECT_DOUBLE_EQ(c.floor_db, -50);
  EXPECT_DOUBLE_EQ(c.strong_db, -15);
  EXPECT_DOUBLE_EQ(c.medium_db, -20);
  EXPECT_DOUBLE_EQ(c.weak_db, -25);
  EXPECT_DOUBLE_EQ(c.response_margin_db, 3);
  EXPECT_DOUBLE_EQ(c.tight.range_m, 0.20);
  EXPECT_DOUBLE_EQ(c.tight.azimuth_rad, 5 * kDegree);
  EXPECT_DOUBLE_EQ(c.wide.range_m, 0.60);
  EXPECT_DOUBLE_EQ(c.wide.azimuth_rad, 20 * kDegree);
  EXPECT_DOUBLE_EQ(c.agreement.range_m, 0.35);
  EXPECT_DOUBLE_EQ(c.agreement.azimuth_rad, 10 * kDegree);
  EXPECT_DOUBLE_EQ(c.near_limit_m, 2);
  EXPECT_DOUBLE_EQ(c.far_limit_m, 4);
  EXPECT_EQ(c.top_k, (std::vector<int>{1, 3, 5}));
}

TEST(AttributionConfig, TheShippedFileHoldsTheDefaults) {
  const std::string file = MMRADARTWIN_CONFIG_DIR "/attribution.yaml";
  if (!std::ifstream(file)) GTEST_SKIP() << file << " is missing: this is no complete checkout";
  EXPECT_EQ(toYaml(loadAttributionConfig(file)), toYaml(AttributionConfig()));
}

TEST(AttributionConfig, WrittenAndReadBackIsTheSame) {
  AttributionConfig c;
  c.strong_db = -12;
  c.wide = {0.7, 0.4};
  c.top_k = {2, 4, 8};
  c.regions.support_floor_db = -22;
  const AttributionConfig back = parseAttributionConfig(toYaml(c), "x");
  EXPECT_EQ(toYaml(back), toYaml(c));
  EXPECT_DOUBLE_EQ(back.strong_db, -12);
  EXPECT_NEAR(back.wide.azimuth_rad, 0.4, 1e-9);
}

TEST(AttributionConfig, AbsentKeysKeepTheirDefaults) {
  EXPECT_DOUBLE_EQ(parseAttributionConfig("strong_db: -10", "x").weak_db, -25);
}

TEST(AttributionConfig, ErrorsNameFileAndKey) {
  for (const char* yaml : {"strongdb: -15", "tight: {range_m: 0.2, angle_deg: 5}", "regions: {floor: 1}"}) {
    const std::string error = errorOf(yaml);
    EXPECT_NE(error.find("attribution.yaml"), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_NE(errorOf("strongdb: -15").find("strongdb"), std::string::npos);
  EXPECT_NE(errorOf("strong_db: 3").find("strong_db"), std::string::npos);
  EXPECT_NE(errorOf("strong_db: .nan").find("strong_db"), std::string::npos);
  EXPECT_NE(errorOf("top_k: [1, 3]").find("top_k"), std::string::npos);
  EXPECT_NE(errorOf("weak_db: -10").find("weak_db"), std::string::npos) << "weak above medium";
  EXPECT_NE(errorOf("outer_azimuth_deg: 50").find("outer_azimuth_deg"), std::string::npos);
  EXPECT_NE(errorOf("wide: {range_m: 0.1, azimuth_deg: 20}").find("wide"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
