#include "diagnosis/numbers/number_text.h"

#include <gtest/gtest.h>

namespace mmradartwin::diagnosis {
namespace {

TEST(NumberText, HasSoManySignificantDigits) {
  EXPECT_EQ(number(1.23456), "1.23");
  EXPECT_EQ(number(-0.00123456), "-0.00123");
  EXPECT_EQ(number(1.23456, 5), "1.2346");
  EXPECT_EQ(number(4.0), "4");
  EXPECT_EQ(number(1234567.0), "1.23e+06");
}

}  // namespace
}  // namespace mmradartwin::diagnosis
