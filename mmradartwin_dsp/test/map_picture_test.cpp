#include "mmradartwin_dsp/map_picture.h"

#include <gtest/gtest.h>

#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "test_radar.h"

namespace mmradartwin {
namespace {

RangeAngleMap targetMap(double range_m, double azimuth_deg) {
  const RadarConfig radar = paperRadar();
  ReceiveGrid grid;
  grid.x = pointTarget(radar, range_m, azimuth_deg * M_PI / 180, 1e-3);
  grid.full_scale = 1;
  return SignalChain(radar).map(grid);
}

/// Centre of the pixels with colours between two (BGR).
cv::Point2d centreOf(const cv::Mat& picture, const cv::Scalar& least, const cv::Scalar& most) {
  cv::Mat found;
  cv::inRange(picture, least, most, found);
  double x = 0, y = 0, count = 0;
  for (int row = 0; row < found.rows; ++row) {
    for (int col = 0; col < found.cols; ++col) {
      if (found.at<std::uint8_t>(row, col)) x += col, y += row, ++count;
    }
  }
  return count > 0 ? cv::Point2d(x / count, y / count) : cv::Point2d(-1, -1);
}

/// Where the fan is yellow, the upper end of viridis; the colour bar at the right is left out.
cv::Point2d peakIn(const cv::Mat& picture) {
  return centreOf(picture.colRange(0, picture.cols - 110), cv::Scalar(20, 200, 200), cv::Scalar(80, 240, 255));
}

TEST(MapPicture, BoresightIsUpAndLeftIsLeft) {
  FanStyle style;
  style.max_range_m = 10;
  const cv::Mat ahead = drawFan(targetMap(8, 0).axes, targetMap(8, 0).power_db, style);
  const cv::Mat left = drawFan(targetMap(8, 45).axes, targetMap(8, 45).power_db, style);
  const cv::Mat right = drawFan(targetMap(8, -45).axes, targetMap(8, -45).power_db, style);
  ASSERT_EQ(ahead.rows, 600);
  const cv::Point2d a = peakIn(ahead), l = peakIn(left), r = peakIn(right);
  ASSERT_GT(a.x, 0);
  EXPECT_LT(l.x, a.x - 100);
  EXPECT_GT(r.x, a.x + 100);
  EXPECT_LT(a.y, l.y - 50);
  EXPECT_NEAR(l.y, r.y, 10);
}

TEST(MapPicture, NaNIsGreyAndResidualsAreRedAndBlue) {
  RangeAngleMap map = targetMap(5, 0);
  map.power_db.setConstant(std::nan(""));
  FanStyle style;
  style.diverging = true;
  style.min_db = -20;
  style.max_db = 20;
  const cv::Mat empty = drawFan(map.axes, map.power_db, style);
  EXPECT_EQ(empty.at<cv::Vec3b>(300, empty.cols / 2 - 40), cv::Vec3b(214, 214, 214));
  map.power_db.setConstant(20);
  const cv::Vec3b plus = drawFan(map.axes, map.power_db, style).at<cv::Vec3b>(305, empty.cols / 2 - 60);
  map.power_db.setConstant(-20);
  const cv::Vec3b minus = drawFan(map.axes, map.power_db, style).at<cv::Vec3b>(305, empty.cols / 2 - 60);
  map.power_db.setConstant(0);
  const cv::Vec3b none = drawFan(map.axes, map.power_db, style).at<cv::Vec3b>(305, empty.cols / 2 - 60);
  EXPECT_GT(plus[2], plus[0] + 80);
  EXPECT_GT(minus[0], minus[2] + 80);
  EXPECT_NEAR(none[0], none[2], 3);
}

TEST(MapPicture, BoxesStandWhereTheyShould) {
  const RangeAngleMap map = targetMap(6, 30);
  FanStyle style;
  const cv::Scalar magenta(255, 0, 255);
  const FanBox box = {6, 30 * M_PI / 180, 0.2, 5 * M_PI / 180, magenta, "desk"};
  const cv::Mat picture = drawFan(map.axes, map.power_db, style, {box});
  const cv::Point2d outline = centreOf(picture, magenta, magenta), peak = peakIn(picture);
  EXPECT_NEAR(outline.x, peak.x, 25);
  EXPECT_NEAR(outline.y, peak.y, 25);
}

TEST(MapPicture, CsvHoldsEveryCell) {
  const TestFolder folder;
  const RangeAngleMap map = targetMap(6, 30);
  writeMapCsv(map, folder / "a.csv");
  std::ifstream in(folder / "a.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "range_m,azimuth_deg,power_db");
  int rows = 0;
  for (double range_m, azimuth_deg, power_db; std::getline(in, line); ++rows) {
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf", &range_m, &azimuth_deg, &power_db), 3);
    const auto r = static_cast<std::size_t>(rows / 64), a = static_cast<std::size_t>(rows % 64);
    EXPECT_NEAR(range_m, map.axes.range_m[r], 1e-6);
    EXPECT_NEAR(azimuth_deg * M_PI / 180, map.axes.azimuth_rad[a], 1e-7);
    EXPECT_NEAR(power_db, map.power_db(rows / 64, rows % 64), 1e-6);
  }
  EXPECT_EQ(rows, 64 * 64);
  EXPECT_THROW(writeMapCsv(map, "/nowhere/a.csv"), std::runtime_error);
  EXPECT_THROW(writePicture(cv::Mat(4, 4, CV_8UC3), "/nowhere/a.png"), std::runtime_error);
}

}  // namespace
}  // namespace mmradartwin
