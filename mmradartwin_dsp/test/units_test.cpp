#include "mmradartwin_dsp/units.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mmradartwin {
namespace {

TEST(Units, LevelsAndAnglesGoThereAndBack) {
  EXPECT_DOUBLE_EQ(M_PI / 180.0, kDegree);
  EXPECT_DOUBLE_EQ(10 / std::log(10.0), kNeperOfPower_db);
  EXPECT_DOUBLE_EQ(20 / std::log(10.0), kNeperOfAmplitude_db);
  EXPECT_DOUBLE_EQ(20, dbOfPower(100));
  EXPECT_DOUBLE_EQ(40, dbOfAmplitude(100));
  EXPECT_DOUBLE_EQ(100, powerOfDb(20));
  EXPECT_DOUBLE_EQ(10, amplitudeOfDb(20));
}

}  // namespace
}  // namespace mmradartwin
