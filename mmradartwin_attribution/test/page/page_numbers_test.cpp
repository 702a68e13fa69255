#include "page/page_numbers.h"

#include <gtest/gtest.h>

namespace mmradartwin::page {
namespace {

TEST(PageNumbers, SayWhereTheyStandAndWhatTheyAre) {
  const nlohmann::json values = {{"a", {{"b", -0.8125}}}, {"many", 4720.4}, {"none", nullptr}, {"ci95", {1.25, 2.5}}};
  const PageNumbers numbers(values, "x.json");
  EXPECT_EQ(numbers.fixed("/a/b", 2), "<data value=\"-0.8125\" data-of=\"x.json#/a/b\">\u22120.81</data>");
  EXPECT_EQ(shownText(numbers.significant("/many")), "4720");
  EXPECT_EQ(shownText(numbers.percent("/a/b")), "\u221281 %");
  EXPECT_EQ(shownText(numbers.interval("/ci95", 2)), "1.2 to 2.5");
  EXPECT_EQ(numbers.interval("/none"), "");
  EXPECT_EQ(numbers.percent("/none"), "\u2013");
  EXPECT_EQ(numbers.count("/missing"), "\u2013");
}

TEST(PageNumbers, PercentHidesNoRest) {
  for (const auto& [share, text] : {std::pair(0.5, "50 %"),
                                    {0.964, "96.4 %"},
                                    {0.9996, "100.0 %"},
                                    {1.0, "100 %"},
                                    {0.0, "0 %"},
                                    {0.0126, "1.3 %"},
                                    {-1.867, "-187 %"}}) {
    EXPECT_EQ(percentText(share), text);
  }
}

TEST(PageNumbers, TinyChancesAreTiny) {
  const nlohmann::json values = {{"tiny", 6.9e-10}, {"small", 0.0015}};
  const PageNumbers numbers(values, "x.json");
  EXPECT_EQ(shownText(numbers.chance("/tiny")), "less than 0.0001 %");
  EXPECT_EQ(shownText(numbers.chance("/small")), "0.15 %");
}

TEST(ShownText, LeavesOutTagsAndMeanings) {
  EXPECT_EQ(
      shownText("<p>a &lt; <span class=\"word\">b<span class=\"meaning\"><b>b</b>: of c</span></span>, d &amp;lt;</p>"),
      "a < b, d &lt;");
}

}  // namespace
}  // namespace mmradartwin::page
