#include "mmradartwin_dsp/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace mmradartwin {
namespace {

TEST(Text, NumbersHaveTheirDigits) {
  EXPECT_EQ("1.500", fixedNumber(1.5, 3));
  EXPECT_EQ("", fixedNumber(std::nan(""), 3));
  EXPECT_EQ("-", fixedNumber(std::numeric_limits<double>::infinity(), 3, "-"));
  EXPECT_EQ("0.00123", significantNumber(0.0012345, 3));
  EXPECT_EQ("1.23e+06", significantNumber(1234567, 3));
}

TEST(Text, FieldsAreQuotedWhereTheyMustBe) {
  EXPECT_EQ("plain", csvField("plain"));
  EXPECT_EQ("\"a,b\"", csvField("a,b"));
  EXPECT_EQ("\"say \"\"a\"\"\"", csvField("say \"a\""));
  EXPECT_EQ("&lt;a href=&quot;x&amp;y&quot;&gt;", htmlEscape("<a href=\"x&y\">"));
  EXPECT_EQ("a, b", join({"a", "b"}, ", "));
  EXPECT_EQ("", join({}, ", "));
  EXPECT_EQ(",b", join({"", "b"}, ","));
}

}  // namespace
}  // namespace mmradartwin
