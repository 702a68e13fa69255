#include <gtest/gtest.h>

#include <cmath>

#include "label_layout.h"
#include "scale_ticks.h"

namespace mmradartwin {
namespace {

TEST(Ticks, AreRoundNumbersWithinTheScale) {
  EXPECT_EQ(ticks(-40, 0, 7), (std::vector<double>{-40, -30, -20, -10, 0}));
  EXPECT_EQ(ticks(-30, 30, 7), (std::vector<double>{-30, -20, -10, 0, 10, 20, 30}));
  EXPECT_EQ(ticks(0, 6, 7), (std::vector<double>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(ticks(-43, -3, 7), (std::vector<double>{-40, -30, -20, -10}));
  EXPECT_EQ(ticks(1, 1, 7), std::vector<double>());
  EXPECT_EQ(ticks(0, NAN, 7), std::vector<double>());
}

TEST(Ticks, AreAsManyAsAllowedAtMost) {
  for (double high : {0.03, 0.7, 1.0, 3.3, 9.6, 12.0, 100.0, 1234.0}) {
    for (int most : {2, 5, 7, 12}) {
      const auto values = ticks(0, high, most);
      ASSERT_GE(values.size(), 1u) << high;
      EXPECT_LE(values.size(), static_cast<std::size_t>(most)) << high;
      EXPECT_LE(values.back(), high * (1 + 1e-9));
      EXPECT_EQ(values.front(), 0);
    }
  }
}

TEST(Labels, DoNotOverlapAndStayInside) {
  const LabelBox bounds{0, 30, 400, 250}, taken{100, 100, 60, 40};
  std::vector<LabelWish> wishes;
  for (int i = 0; i < 40; ++i) wishes.push_back({150 + 3.0 * (i % 7), 120 + 2.0 * (i % 5), 22, 16});
  const auto boxes = placeLabels(wishes, bounds, 2, {taken});
  ASSERT_EQ(boxes.size(), wishes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    EXPECT_EQ(boxes[i].width, 22);
    EXPECT_TRUE(boxes[i].within(bounds));
    EXPECT_FALSE(boxes[i].overlaps(taken));
    for (std::size_t k = 0; k < i; ++k) EXPECT_FALSE(boxes[i].overlaps(boxes[k])) << i << " " << k;
  }
}

TEST(Labels, StandAboveTheirPlaceWhereThereIsRoom) {
  const auto boxes = placeLabels({{200, 150, 20, 16}}, {0, 0, 400, 300}, 2);
  EXPECT_NEAR(boxes[0].x + 10, 200, 1e-9);
  EXPECT_LT(boxes[0].y + 16, 150);
  EXPECT_GT(boxes[0].y + 16, 130);
}

TEST(Labels, WithoutRoomHaveNoSize) {
  const auto boxes = placeLabels({{10, 30, 20, 16}, {10, 30, 20, 16}}, {0, 0, 22, 40}, 2);
  EXPECT_EQ(boxes[0].width, 20);
  EXPECT_EQ(boxes[1].width, 0);
}

}  // namespace
}  // namespace mmradartwin
