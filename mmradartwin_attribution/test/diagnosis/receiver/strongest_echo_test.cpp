#include "diagnosis/receiver/strongest_echo.h"

#include <gtest/gtest.h>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/drawn_channels.h"
#include "diagnosis/receiver/cabinet_room.h"

namespace mmradartwin::diagnosis {
namespace {

/// A radar 2 m square in front of the cabinet; what it measures is drawn.
class StrongestEchoTest : public ::testing::Test {
 protected:
  ChannelData session(const std::vector<DrawnTone>& tones) const {
    ChannelData data = sessionOf(radar_, {gridOf(radar_, tones)}, 1e-12);
    data.poses[0].pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(1, 0, 0));
    return data;
  }
  Twin twin() const { return Twin(loadTwin("", room_.sceneFile(), radar_)).changed({defaultMechanism("specular")}); }
  static Finding level(double level_db) {
    Finding f;
    f.cause = "tx_rx_leakage";
    f.mechanism = NamedParameters{"tx_rx_leakage", {}};
    f.mechanism->values.set("level_db", level_db);
    f.parameters = {{"level_db", "dB", level_db, {{level_db - 1, level_db + 1}}}};
    return f;
  }
  static double levelOf(const Finding& f) { return std::get<double>(f.parameters[0].value); }
  RadarConfig radar_ = paperRadar();
  CabinetRoom room_;
};

TEST_F(StrongestEchoTest, IsTheAmplitudeOfATonesWhereverItLiesBetweenBins) {
  for (double range_m : {3.0, 3.02, 3.05, 3.07}) {
    const ChannelData data = session({{range_m, 0.3, 0.02}, {1.2, 0, 0.012}, {5.5, -0.2, 0.005}});
    EXPECT_NEAR(strongestMeasured(data), 0.02, 4e-4) << range_m;
  }
}

TEST_F(StrongestEchoTest, IsTheStrongestOfAllPoses) {
  ChannelData data = session({{3, 0, 0.01}});
  const ChannelData second = session({{2, 0.1, 0.03}});
  data.poses.push_back(second.poses[0]);
  EXPECT_NEAR(strongestMeasured(data), 0.03, 6e-4);
}

TEST_F(StrongestEchoTest, LevelsReferToWhereTheTwinHasItsStrongest) {
  // The cabinet's echo at 2 m, and a tone twice as strong where the twin has nothing.
  const ChannelData data = session({{2.0, 0, 0.01}, {5.0, 0.2, 0.02}});
  Finding f = level(-30);
  referToStrongestEcho(twin(), data, f);
  EXPECT_NEAR(levelOf(f), -30 + 20 * std::log10(2), 0.2);
  EXPECT_NEAR(f.mechanism->values.number("level_db"), levelOf(f), 1e-12);
  const double half_db = 0.5 * (f.parameters[0].ci95[0][1] - f.parameters[0].ci95[0][0]);
  EXPECT_NEAR(half_db, std::hypot(1, 1.96 * 0.3), 0.01) << "an echo alone in its cell is good to 0.3 dB";
}

TEST_F(StrongestEchoTest, LevelsOfAHostReferToTheMeasuredEcho) {
  // The twin's own strongest had amplitude 0.02 and the session 3 dB more power than it: 0.01 measured is 9 dB below.
  const ChannelData data = session({{2.0, 0, 0.01}});
  Finding f = level(-30);
  const double three_db = std::log(2.0);
  referToStrongestHost(twin(), data, three_db, 0.02, f);
  EXPECT_NEAR(levelOf(f), -30 - 20 * std::log10(2) - 10 * std::log10(2), 0.2);
}

TEST_F(StrongestEchoTest, FindingsWithoutALevelStayAsTheyAre) {
  Finding f = level(-30);
  f.parameters[0].name = "range_m";
  referToStrongestEcho(twin(), session({{2.0, 0, 0.01}, {5.0, 0.2, 0.02}}), f);
  EXPECT_EQ(levelOf(f), -30);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
