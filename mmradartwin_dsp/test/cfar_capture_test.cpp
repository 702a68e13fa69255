#include <algorithm>
#include <map>
#include <sstream>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/cfar.h"
#include "mmradartwin_dsp/point_detector.h"
#include "mmradartwin_dsp/session.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

bool isInFront(double range_m, double azimuth_rad) { return range_m > 0.5 && std::abs(azimuth_rad) < M_PI / 3; }

/// One Doppler bin of a frame under a Hann window over its loops, as a grid: positive bins move away. Slots follow each
/// other in time, and the phase that an echo gains meanwhile is taken out.
ReceiveGrid dopplerGrid(const RadarConfig& radar, const AdcCube& cube, int bin) {
  ReceiveGrid grid;
  grid.x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  const std::vector<double> window = hannWindow(radar.loops_per_frame);
  for (int chirp = 0; chirp < cube.chirps; ++chirp) {
    const int slot = chirp % radar.slots();
    const std::complex<double> weight =
        std::polar(window[static_cast<std::size_t>(chirp / radar.slots())] * 2 / radar.loops_per_frame,
                   -2 * M_PI * bin * chirp / cube.chirps);
    for (int n = 0; n < cube.samples; ++n) {
      for (int rx = 0; rx < cube.receivers; ++rx) {
        const auto i = static_cast<std::size_t>((chirp * cube.samples + n) * cube.receivers + rx) * 2;
        grid.x(slot * cube.receivers + rx, n) += weight * std::complex<double>(cube.data[i], cube.data[i + 1]);
      }
    }
  }
  return grid;
}

class CfarOnARealCapture : public ::testing::TestWithParam<CfarKind> {
 protected:
  void SetUp() override {
    SKIP_WITHOUT(capture_);
    radar_ = loadRadarConfig(MMRADARTWIN_DSP_SOURCE "/test/data/openradar_indoor.yaml");
    chain_ = std::make_unique<SignalChain>(radar_);
    CfarSettings settings;
    settings.kind = GetParam();
    cfar_ = std::make_unique<Cfar>(settings, radar_);
  }
  /// In the evaluated field of view and beyond the leakage, the strongest first.
  std::vector<Detection> detectionsInFront(const RangeAngleMap& map) const {
    std::vector<Detection> found;
    for (const Detection& detection : cfar_->detect(map)) {
      if (isInFront(detection.range_m, detection.azimuth_rad)) found.push_back(detection);
    }
    std::sort(found.begin(), found.end(),
              [](const Detection& a, const Detection& b) { return a.power_db > b.power_db; });
    return found;
  }
  double speedOf(int bin) const {
    return bin * radar_.wavelength_m() / (2 * radar_.loops_per_frame * radar_.slots() * radar_.chirp_period_s());
  }
  static std::string text(const Detection& d) {
    std::ostringstream text;
    text << d.range_m << " m, " << d.azimuth_rad * 180 / M_PI << " deg, " << d.power_db << " dBFS, " << d.snr_db
         << " dB";
    return text.str();
  }

  const std::filesystem::path capture_ = dataFolder() / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  RadarConfig radar_;
  std::unique_ptr<SignalChain> chain_;
  std::unique_ptr<Cfar> cfar_;
};
INSTANTIATE_TEST_SUITE_P(Kinds, CfarOnARealCapture,
                         ::testing::Values(CfarKind::kCellAveraging, CfarKind::kOrderedStatistic));

TEST_P(CfarOnARealCapture, WallIsTheStrongestOfTheAverage) {
  const Recording recording = openCapture(capture_.string(), radar_);
  const std::vector<Detection> found = detectionsInFront(chain_->map(averagePose(recording, recording.poses.front())));
  ASSERT_FALSE(found.empty());
  RecordProperty("wall", text(found.front()));
  RecordProperty("detections", static_cast<int>(found.size()));
  EXPECT_NEAR(found.front().range_m, 5.2, 0.05);
  EXPECT_GT(found.front().snr_db, 25);
}

// Where the diagnosis of this recording sees them (docs/verification/protocol.md).
TEST_P(CfarOnARealCapture, BothPeopleAreTheStrongestThatMove) {
  const AdcCube cube = CaptureReader(radar_, capture_.string()).frame(0, 0);
  std::map<int, Detection> away_and_towards;  // by sign of the speed
  std::map<int, int> bins;
  for (int bin = -radar_.loops_per_frame / 2; bin < radar_.loops_per_frame / 2; ++bin) {
    if (std::abs(speedOf(bin)) < 0.2) continue;
    const std::vector<Detection> found = detectionsInFront(chain_->map(dopplerGrid(radar_, cube, bin)));
    const int sign = bin > 0 ? 1 : -1;
    if (found.empty()) continue;
    const auto best = away_and_towards.find(sign);
    if (best != away_and_towards.end() && best->second.power_db >= found.front().power_db) continue;
    away_and_towards[sign] = found.front();
    bins[sign] = bin;
  }
  ASSERT_EQ(away_and_towards.size(), 2u);
  for (const auto& [sign, detection] : away_and_towards) {
    RecordProperty(sign > 0 ? "away" : "towards", std::to_string(speedOf(bins[sign])) + " m/s, " + text(detection));
    EXPECT_GT(detection.snr_db, 25);
  }
  EXPECT_NEAR(away_and_towards[1].range_m, 2.95, 0.1);
  EXPECT_NEAR(away_and_towards[1].azimuth_rad, -7 * M_PI / 180, 0.06);
  EXPECT_NEAR(speedOf(bins[1]), 0.59, 0.16);
  EXPECT_NEAR(away_and_towards[-1].range_m, 2.97, 0.1);
  EXPECT_NEAR(away_and_towards[-1].azimuth_rad, 13 * M_PI / 180, 0.06);
  EXPECT_NEAR(speedOf(bins[-1]), -0.63, 0.16);
}

// What radar/points holds of this frame: of each sign of the speed the strongest is one of both people.
TEST_P(CfarOnARealCapture, PointsHaveTheSpeedsOfBothPeople) {
  const AdcCube cube = CaptureReader(radar_, capture_.string()).frame(0, 0);
  const Recording recording = openCapture(capture_.string(), radar_);
  CfarSettings settings;
  settings.kind = GetParam();
  const std::vector<Detection> points = PointDetector(settings, radar_)
                                            .all(*chain_, chain_->map(averagePose(recording, recording.poses.front())),
                                                 dopplerGrids(radar_, cube, nullptr));
  const Detection *away = nullptr, *towards = nullptr, *still = nullptr;
  int moving = 0;
  for (const Detection& point : points) {
    if (!isInFront(point.range_m, point.azimuth_rad)) continue;
    ASSERT_FALSE(std::isnan(point.radial_speed_m_per_s));
    const Detection*& best = point.radial_speed_m_per_s > 0 ? away : point.radial_speed_m_per_s < 0 ? towards : still;
    if (!best || point.power_db > best->power_db) best = &point;
    moving += point.radial_speed_m_per_s != 0 ? 1 : 0;
  }
  ASSERT_TRUE(away && towards && still);
  RecordProperty("moving", moving);
  RecordProperty("away", std::to_string(away->radial_speed_m_per_s) + " m/s, " + text(*away));
  RecordProperty("towards", std::to_string(towards->radial_speed_m_per_s) + " m/s, " + text(*towards));
  EXPECT_NEAR(away->range_m, 2.93, 0.03);
  EXPECT_NEAR(away->azimuth_rad * 180 / M_PI, -7, 1);
  EXPECT_NEAR(away->radial_speed_m_per_s, 0.56, 0.01);
  EXPECT_NEAR(towards->range_m, 2.98, 0.03);
  EXPECT_NEAR(towards->azimuth_rad * 180 / M_PI, 15.9, 1);
  EXPECT_NEAR(towards->radial_speed_m_per_s, -0.48, 0.01);
  EXPECT_NEAR(still->range_m, 5.2, 0.05);
}

// Nobody in the room is faster than 2.5 m/s: what lies there is the receiver's noise, of real silicon.
TEST_P(CfarOnARealCapture, RateIsAboutKeptWhereNothingMoves) {
  const AdcCube cube = CaptureReader(radar_, capture_.string()).frame(0, 0);
  double above = 0, cells = 0;
  for (int bin = -radar_.loops_per_frame / 2; bin < radar_.loops_per_frame / 2; ++bin) {
    if (std::abs(speedOf(bin)) < 2.5) continue;
    const RangeAngleMap map = chain_->map(dopplerGrid(radar_, cube, bin));
    const RealGrid threshold_db = cfar_->levels(map.power_db).threshold_db;
    for (Eigen::Index r = 0; r < threshold_db.rows(); ++r) {
      for (Eigen::Index a = 0; a < threshold_db.cols(); ++a) {
        if (!isInFront(map.axes.range_m[static_cast<std::size_t>(r)],
                       map.axes.azimuth_rad[static_cast<std::size_t>(a)])) {
          continue;
        }
        ++cells;
        above += map.power_db(r, a) > threshold_db(r, a) ? 1 : 0;
      }
    }
  }
  RecordProperty("false_alarm_rate", std::to_string(above / cells));
  RecordProperty("cells", std::to_string(cells));
  EXPECT_LT(above / cells, 1e-3);
}

}  // namespace
}  // namespace mmradartwin
