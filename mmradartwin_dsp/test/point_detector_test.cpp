#include "mmradartwin_dsp/point_detector.h"

#include "mmradartwin_dsp/coherent_average.h"
#include "moving_echoes.h"

namespace mmradartwin {
namespace {

RangeAngleMap averageOf(const SignalChain& chain, const AdcCube& cube) {
  CoherentAverage average(chain.radar(), 1);
  average.add(cube);
  return chain.map(average.grid());
}

/// With so few false alarms that there is none.
CfarSettings rarely() {
  CfarSettings settings;
  settings.false_alarm_rate = 1e-8;
  return settings;
}

const Detection* nearest(const std::vector<Detection>& found, const MovingEcho& echo) {
  for (const Detection& detection : found) {
    if (std::abs(detection.range_m - echo.range_m) < 0.16 && std::abs(detection.azimuth_rad - echo.azimuth_rad) < 0.1) {
      return &detection;
    }
  }
  return nullptr;
}

TEST(PointDetector, WhoWalksHasHisSpeedAndWhatStandsHas0) {
  const RadarConfig radar = loopedRadar();
  const SignalChain chain(radar);
  const std::vector<MovingEcho> echoes = {
      {4.7, 0.1, 0, 200}, {2.5, -0.4, 2.5, 200}, {2.5, 0.5, -3.0, 200}, {7.5, 0.2, 4.1, 60}};
  const AdcCube cube = movingFrame(radar, echoes, 10, 3);
  const std::vector<Detection> found =
      PointDetector(rarely(), radar).all(chain, averageOf(chain, cube), dopplerGrids(radar, cube, nullptr));
  EXPECT_EQ(found.size(), echoes.size());
  for (const MovingEcho& echo : echoes) {
    const Detection* detection = nearest(found, echo);
    ASSERT_TRUE(detection) << echo.speed_m_per_s;
    EXPECT_NEAR(detection->radial_speed_m_per_s, echo.speed_m_per_s, 0.26) << echo.range_m;  // half a bin
    EXPECT_NEAR(detection->power_db, 20 * std::log10(echo.amplitude / 32768), 3.5);
  }
}

TEST(PointDetector, WithoutAFrameThereIsNoSpeed) {
  const RadarConfig radar = loopedRadar();
  const SignalChain chain(radar);
  const std::vector<Detection> found =
      PointDetector(rarely(), radar).still(averageOf(chain, movingFrame(radar, {{4.7, 0.1, 0, 200}}, 10, 3)));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_TRUE(std::isnan(found.front().radial_speed_m_per_s));
}

// What leaks into the average stands where the walker does; something still beside him stays.
TEST(PointDetector, WalkerIsNoStandingPointToo) {
  const RadarConfig radar = loopedRadar();
  const SignalChain chain(radar);
  const MovingEcho walker{3.0, -0.2, 1.9, 2000}, pillar{3.0, 0.5, 0, 200};
  const AdcCube cube = movingFrame(radar, {walker, pillar}, 10, 3);
  const PointDetector detector(rarely(), radar);
  const RangeAngleMap average = averageOf(chain, cube);
  EXPECT_TRUE(nearest(detector.still(average), walker));
  const std::vector<Detection> found = detector.all(chain, average, dopplerGrids(radar, cube, nullptr));
  for (const Detection& detection : found) {
    if (detection.radial_speed_m_per_s != 0) continue;
    EXPECT_GT(std::abs(detection.azimuth_rad - walker.azimuth_rad), 0.25);
  }
  ASSERT_TRUE(nearest(found, pillar));
  EXPECT_EQ(nearest(found, pillar)->radial_speed_m_per_s, 0);
  EXPECT_NEAR(nearest(found, walker)->radial_speed_m_per_s, 1.9, 0.26);
}

// A cell of range and angle of noise becomes a moving point at the rate asked for, all speeds together: at most, since
// only the strongest of neighbours counts, and what is near speed 0 is left out.
TEST(PointDetector, RateOfFalseAlarmsOverAllSpeedsIsKept) {
  const RadarConfig radar = loopedRadar();
  const SignalChain chain(radar);
  CfarSettings settings;
  settings.false_alarm_rate = 0.01;
  settings.sidelobe_db = 400;
  const PointDetector detector(settings, radar);
  constexpr int kFrames = 40;
  std::size_t found = 0;
  double cells = 0, above = 0;
  CfarSettings of_one_speed = settings;
  of_one_speed.false_alarm_rate /= 32;
  const Cfar cfar(of_one_speed, radar);
  for (unsigned frame = 0; frame < kFrames; ++frame) {
    const DopplerGrids grids = dopplerGrids(radar, movingFrame(radar, {}, 20, 100 + frame), nullptr);
    found += detector.moving(chain, grids).size();
    for (std::size_t d = 0; d < grids.grids.size(); ++d) {
      if (grids.binsFromStill(d) <= kStillBins) continue;
      const RangeAngleMap map = chain.map(grids.grids[d]);
      above += static_cast<double>((map.power_db.array() > cfar.levels(map.power_db).threshold_db.array()).count());
    }
    cells += 64 * 64;
  }
  RecordProperty("points_per_cell", std::to_string(static_cast<double>(found) / cells));
  RecordProperty("cells_above_threshold", std::to_string(above / cells));
  EXPECT_NEAR(above / cells, 0.01 * 27 / 32, 0.2 * 0.01);
  EXPECT_GT(found, 20u);
  EXPECT_LT(static_cast<double>(found) / cells, 0.01);
}

}  // namespace
}  // namespace mmradartwin
