#include "mmradartwin_attribution/ros/markers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

using visualization_msgs::Marker;

TEST(FindingMarkers, ARingAsWideAsTheIntervalStandsWhereTheFindingIs) {
  Finding f;
  f.cause = "actor_moved";
  f.parameters = {{"dx_m", "m", 0.2, {{0.0, 0.8}}}, {"dy_m", "m", 0.1, {{0.09, 0.11}}}};
  f.where.resize(2);  // the second has no place
  f.where[0].actors = {"cabinet"};
  f.where[0].x_m = 3;
  f.where[0].y_m = -1;
  Findings findings;
  findings.findings = {f};
  const visualization_msgs::MarkerArray shown = findingMarkers(findings, "map");
  ASSERT_EQ(shown.markers.size(), 3u);
  EXPECT_EQ(shown.markers[0].action, Marker::DELETEALL);  // what an earlier diagnosis had found
  const Marker &ring = shown.markers[1], &label = shown.markers[2];
  double most_x = 0, most_y = 0;
  for (const geometry_msgs::Point& p : ring.points) {
    most_x = std::max(most_x, std::abs(p.x - 3));
    most_y = std::max(most_y, std::abs(p.y + 1));
  }
  EXPECT_NEAR(most_x, 0.4, 1e-9);
  EXPECT_NEAR(most_y, 0.15, 1e-9);  // narrower could not be seen
  EXPECT_EQ(ring.header.frame_id, "map");
  EXPECT_EQ(label.text, "actor_moved cabinet");
  EXPECT_NEAR(label.pose.position.x, 3, 1e-9);
}

TEST(FindingMarkers, NothingIsShownOfFindingsWithoutAPlace) {
  Findings findings;
  findings.findings.resize(1);
  findings.findings[0].where.emplace_back();
  EXPECT_EQ(findingMarkers(findings, "map").markers.size(), 1u);
}

}  // namespace
}  // namespace mmradartwin
