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

TEST(Text, PlainTextIsUtf8WithoutControlCharacters) {
  for (const char* good : {"", "a 1",
                           "K\xc3\xbc"
                           "che",
                           "\xe6\x88\xbf", "\xf0\x9f\x93\xa1"})
    EXPECT_TRUE(isPlainText(good)) << good;
  // Latin-1, an overlong slash, a surrogate, beyond U+10FFFF, cut off, colours for a terminal.
  for (const char* bad : {"K\xfc"
                          "che",
                          "\xc0\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\xe6\x88", "a\x1b[31m", "a\nb", "\x7f"}) {
    EXPECT_FALSE(isPlainText(bad)) << bad;
  }
  EXPECT_EQ(shownShort("K\xfc"
                       "che"),
            "K?che");
  EXPECT_EQ(shownShort(std::string(5000, 'x')), std::string(40, 'x') + "...");
}

}  // namespace
}  // namespace mmradartwin
