#include "mmradartwin_dsp/cfar.h"

#include <random>

#include "mmradartwin_dsp/coherent_average.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

constexpr double kRate = 1e-4;

CfarSettings settingsOf(CfarKind kind) {
  CfarSettings settings;
  settings.kind = kind;
  settings.false_alarm_rate = kRate;
  return settings;
}

double db(double power) { return 10 * std::log10(power); }

RangeAngleMap flatMap(double power_db) {
  RangeAngleMap map;
  map.axes = SignalChain(paperRadar()).axes();
  map.power_db = RealGrid::Constant(64, kAngleBins, power_db);
  return map;
}

/// One hump of a target, as wide as the lobes of window and array.
void addTarget(RangeAngleMap& map, int range_bin, int angle_bin, double power_db) {
  for (int r = std::max(range_bin - 2, 0); r <= std::min(range_bin + 2, 63); ++r) {
    for (int a = std::max(angle_bin - 7, 0); a <= std::min(angle_bin + 7, 63); ++a) {
      const double fall_db = 6.0 * std::pow(r - range_bin, 2) + 0.4 * std::pow(a - angle_bin, 2);
      map.power_db(r, a) = std::max(map.power_db(r, a), power_db - fall_db);
    }
  }
}

/// Cells above their threshold, and cells that have one.
struct Count {
  double above = 0, cells = 0;
  double rate() const { return above / cells; }
  void add(const Cfar& cfar, const RealGrid& power_db) {
    const RealGrid threshold_db = cfar.levels(power_db).threshold_db;
    above += static_cast<double>((power_db.array() > threshold_db.array()).count());
    cells += static_cast<double>((threshold_db.array() == threshold_db.array()).count());
  }
};

/// Circular white noise of a receiver, in ADC counts per component.
class Receiver {
 public:
  Receiver(const RadarConfig& radar, double sigma_counts) : radar_(radar), noise_(0, sigma_counts) {}
  AdcCube frame() {
    AdcCube cube;
    cube.chirps = radar_.chirps_per_frame();
    cube.samples = radar_.samples_per_chirp;
    cube.receivers = radar_.receivers();
    cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
    cube.data.resize(static_cast<std::size_t>(cube.chirps) * static_cast<std::size_t>(cube.samples) *
                     static_cast<std::size_t>(cube.receivers) * 2);
    for (std::int16_t& sample : cube.data) sample = static_cast<std::int16_t>(std::lround(noise_(random_)));
    return cube;
  }
  ComplexGrid grid() {
    ComplexGrid x(radar_.channels(), radar_.samples_per_chirp);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = {noise_(random_), noise_(random_)};
    return x;
  }

 private:
  RadarConfig radar_;
  std::mt19937 random_{11};
  std::normal_distribution<double> noise_;
};

/// Of cells of maps of noise, which come from so many frames each.
double rateOnNoise(const RadarConfig& radar, const CfarSettings& settings, int frames) {
  const Cfar cfar(settings, radar);
  const SignalChain chain(radar);
  Receiver receiver(radar, 20);
  Count count;
  for (int map = 0; map < 4000; ++map) {
    CoherentAverage average(radar, 0);
    for (int frame = 0; frame < frames; ++frame) average.add(receiver.frame());
    count.add(cfar, chain.map(average.grid()).power_db);
  }
  return count.rate();
}

TEST(CfarFactor, CellAveragingFollowsItsFormula) {
  EXPECT_NEAR(cellAveragingFactor(kRate, 1), 1 / kRate - 1, 1e-7);
  EXPECT_NEAR(cellAveragingFactor(kRate, 16), 16 * (std::pow(10, 0.25) - 1), 1e-12);
  EXPECT_NEAR(cellAveragingFactor(kRate, 100000000), -std::log(kRate), 1e-5);  // the noise is known
}

TEST(CfarFactor, OrderedStatisticSolvesItsFormula) {
  EXPECT_NEAR(orderedStatisticFactor(kRate, 1, 1), 1 / kRate - 1, 1e-6);
  EXPECT_NEAR(orderedStatisticFactor(kRate, 20, 1), 20 * (1 / kRate - 1), 1e-5);  // the weakest of N has power 1/N
  for (const auto& [cells, rank] : {std::pair{16, 10}, {24, 18}, {36, 27}, {36, 36}}) {
    const double alpha = orderedStatisticFactor(kRate, cells, rank);
    // The product as a ratio of gamma functions.
    const double log_rate = std::lgamma(cells + 1) - std::lgamma(cells - rank + 1) +
                            std::lgamma(cells - rank + 1 + alpha) - std::lgamma(cells + 1 + alpha);
    EXPECT_NEAR(log_rate, std::log(kRate), 1e-9) << cells << " " << rank;
  }
  EXPECT_NEAR(orderedStatisticMean(4, 4), 1 + 1.0 / 2 + 1.0 / 3 + 1.0 / 4, 1e-15);
}

class CfarOfKind : public ::testing::TestWithParam<CfarKind> {};
INSTANTIATE_TEST_SUITE_P(Kinds, CfarOfKind, ::testing::Values(CfarKind::kCellAveraging, CfarKind::kOrderedStatistic));

// Cells at the edges are among them, with the thresholds of their few training cells.
TEST_P(CfarOfKind, RateHoldsOnExponentialNoise) {
  const Cfar cfar(settingsOf(GetParam()), paperRadar());
  std::mt19937 random(5);
  std::exponential_distribution<double> exponential;
  Count count;
  RealGrid power_db(64, kAngleBins);
  for (int map = 0; map < 1500; ++map) {
    for (Eigen::Index i = 0; i < power_db.size(); ++i) power_db.data()[i] = db(exponential(random) * 1e-6);
    count.add(cfar, power_db);
  }
  RecordProperty("false_alarm_rate", std::to_string(count.rate()));
  EXPECT_EQ(count.cells, 1500 * 64 * 64);
  EXPECT_NEAR(count.rate(), kRate, 0.2 * kRate);
}

// Neighbours in such a map are not independent; training cells are. Frames are averaged coherently, so that the law
// does not depend on their number.
TEST_P(CfarOfKind, RateHoldsOnNoiseOfTheReceiver) {
  const RadarConfig radar = paperRadar();
  for (const int frames : {1, 4}) {
    const double rate = rateOnNoise(radar, settingsOf(GetParam()), frames);
    RecordProperty("false_alarm_rate_" + std::to_string(frames), std::to_string(rate));
    EXPECT_NEAR(rate, kRate, 0.2 * kRate) << frames << " frames";
    if (GetParam() == CfarKind::kOrderedStatistic) break;  // it takes longer
  }
}

TEST(CfarNoise, RateHoldsWhereBeamsAreNoWholeBinsApart) {
  RadarConfig radar = paperRadar();
  radar.tx_position_m.emplace_back(0, 2 * radar.tx_position_m[1].y(), 0);
  ASSERT_EQ(radar.channels(), 12);  // 64/12 bins
  const double rate = rateOnNoise(radar, settingsOf(CfarKind::kCellAveraging), 1);
  RecordProperty("false_alarm_rate", std::to_string(rate));
  EXPECT_NEAR(rate, kRate, 0.2 * kRate);
}

TEST_P(CfarOfKind, TargetIsFoundAtItsCellWithItsSnr) {
  const RadarConfig radar = paperRadar();
  const Cfar cfar(settingsOf(GetParam()), radar);
  const SignalChain chain(radar);
  const double sigma = 20, amplitude = 20;  // -3 dB in a sample, before all gains
  ReceiveGrid grid;
  grid.x = pointTarget(radar, 20 * radar.range_bin_m(), 0.2, amplitude);
  Eigen::Index range_bin = 0, angle_bin = 0;
  const double peak_db = chain.map(grid).power_db.maxCoeff(&range_bin, &angle_bin);
  double sum = 0, squares = 0;
  for (const double w : hannWindow(radar.samples_per_chirp)) sum += w, squares += w * w;
  const double noise_db = db(radar.channels() * squares * 2 * sigma * sigma) - 20 * std::log10(radar.channels() * sum) -
                          20 * std::log10(grid.full_scale);
  Receiver receiver(radar, sigma);
  const ComplexGrid target = grid.x;
  constexpr int kDraws = 200;
  double snr = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    grid.x = target + receiver.grid();
    const std::vector<Detection> found = cfar.detect(chain.map(grid));
    ASSERT_FALSE(found.empty());
    const Detection& best = *std::max_element(
        found.begin(), found.end(), [](const Detection& a, const Detection& b) { return a.power_db < b.power_db; });
    EXPECT_NEAR(best.range_bin, static_cast<int>(range_bin), 1);
    EXPECT_NEAR(best.angle_bin, static_cast<int>(angle_bin), 2);
    EXPECT_EQ(best.range_m, chain.axes().range_m[static_cast<std::size_t>(best.range_bin)]);
    EXPECT_EQ(best.azimuth_rad, chain.axes().azimuth_rad[static_cast<std::size_t>(best.angle_bin)]);
    snr += best.snr_db / kDraws;
  }
  EXPECT_NEAR(snr, peak_db - noise_db, 0.5);
}

TEST_P(CfarOfKind, EdgesAreSearched) {
  const Cfar cfar(settingsOf(GetParam()), paperRadar());
  for (const auto& [range_bin, angle_bin] : {std::pair{0, 0}, {0, 63}, {63, 0}, {63, 63}, {1, 32}, {62, 32}, {30, 0}}) {
    RangeAngleMap map = flatMap(-90);
    addTarget(map, range_bin, angle_bin, -50);
    const std::vector<Detection> found = cfar.detect(map);
    ASSERT_EQ(found.size(), 1u) << range_bin << " " << angle_bin;
    EXPECT_EQ(found.front().range_bin, range_bin);
    EXPECT_EQ(found.front().angle_bin, angle_bin);
  }
}

TEST_P(CfarOfKind, MaskedCellsCountNowhere) {
  const Cfar cfar(settingsOf(GetParam()), paperRadar());
  RangeAngleMap map = flatMap(-90);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  map.power_db.leftCols(8).setConstant(nan);
  map.power_db(20, 33) = nan;
  addTarget(map, 20, 32, -50);
  map.power_db(20, 33) = nan;
  std::vector<Detection> found = cfar.detect(map);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front().angle_bin, 32);
  const Cfar::Levels levels = cfar.levels(map.power_db);
  EXPECT_TRUE(std::isnan(levels.threshold_db(20, 33)));
  EXPECT_TRUE(std::isnan(levels.threshold_db(40, 3)));
  // Fewer training cells, a higher threshold.
  EXPECT_GT(levels.threshold_db(45, 8), levels.threshold_db(45, 32));
  // Without any training cell there is no threshold, and no detection.
  map.power_db.setConstant(nan);
  map.power_db(20, 32) = -50;
  EXPECT_TRUE(std::isnan(cfar.levels(map.power_db).threshold_db(20, 32)));
  EXPECT_TRUE(cfar.detect(map).empty());
}

TEST(CfarLevels, ThresholdIsThatOfTheNumberOfTrainingCells) {
  CfarSettings settings = settingsOf(CfarKind::kCellAveraging);
  settings.guard_m = 0.1;  // the window's lobe of two bins stays left out
  settings.training_m = 12 * paperRadar().range_bin_m();
  settings.guard_beams = settings.training_beams = 0;
  const Cfar cfar(settings, paperRadar());
  ASSERT_EQ(cfar.trainingCells(), 8);  // bins 3, 6, 9 and 12 to either side
  const Cfar::Levels levels = cfar.levels(flatMap(-90).power_db);
  EXPECT_NEAR(levels.noise_db(32, 5), -90, 1e-9);
  EXPECT_NEAR(levels.threshold_db(32, 5), -90 + db(cellAveragingFactor(kRate, 8)), 1e-9);
  EXPECT_NEAR(levels.threshold_db(0, 5), -90 + db(cellAveragingFactor(kRate, 4)), 1e-9);
  EXPECT_NEAR(levels.threshold_db(8, 5), -90 + db(cellAveragingFactor(kRate, 6)), 1e-9);
}

TEST(CfarLevels, NoiseIsNotTakenAsLessThanStated) {
  const Cfar cfar(settingsOf(CfarKind::kOrderedStatistic), paperRadar());
  RangeAngleMap map = flatMap(-300);  // as a simulation is that has no noise
  addTarget(map, 20, 32, -50);
  addTarget(map, 40, 32, -120);
  EXPECT_EQ(cfar.detect(map).size(), 2u);
  const std::vector<Detection> found = cfar.detect(map, -100);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found.front().snr_db, 50, 1e-9);
}

TEST(CfarDetections, OrderedStatisticFindsATargetBesideAStrongOne) {
  RangeAngleMap map = flatMap(-90);
  addTarget(map, 20, 32, -60);
  addTarget(map, 29, 32, -45);  // within the training cells of the other
  const std::vector<Detection> os = Cfar(settingsOf(CfarKind::kOrderedStatistic), paperRadar()).detect(map);
  ASSERT_EQ(os.size(), 2u);
  EXPECT_EQ(os.front().range_bin, 20);
  EXPECT_EQ(os.back().range_bin, 29);
  const std::vector<Detection> ca = Cfar(settingsOf(CfarKind::kCellAveraging), paperRadar()).detect(map);
  ASSERT_EQ(ca.size(), 1u);
  EXPECT_EQ(ca.front().range_bin, 29);
}

TEST(CfarDetections, SidelobesOfAStrongTargetAreNone) {
  const RadarConfig radar = paperRadar();
  ReceiveGrid grid;
  grid.full_scale = 1;
  grid.x = pointTarget(radar, 20 * radar.range_bin_m(), 0.2, 1) + Receiver(radar, 1e-3).grid();
  const RangeAngleMap map = SignalChain(radar).map(grid);
  CfarSettings settings = settingsOf(CfarKind::kOrderedStatistic);
  EXPECT_EQ(Cfar(settings, radar).detect(map).size(), 1u);
  settings.sidelobe_db = 400;
  EXPECT_GT(Cfar(settings, radar).detect(map).size(), 3u);
}

TEST_P(CfarOfKind, DetectionsAreTheLocalMaximaAboveTheThresholds) {
  const RadarConfig radar = paperRadar();
  CfarSettings settings = settingsOf(GetParam());
  settings.false_alarm_rate = 0.02;
  settings.sidelobe_db = 400;
  const Cfar cfar(settings, radar);
  Receiver receiver(radar, 20);
  ReceiveGrid grid;
  grid.x = receiver.grid();
  const RangeAngleMap map = SignalChain(radar).map(grid);
  const Cfar::Levels levels = cfar.levels(map.power_db);
  int expected = 0;
  const std::vector<Detection> found = cfar.detect(map);
  for (int r = 0; r < 64; ++r) {
    for (int a = 0; a < 64; ++a) {
      const int top = std::max(r - 1, 0), left = std::max(a - 4, 0);
      const double around_db =
          map.power_db.block(top, left, std::min(r + 1, 63) - top + 1, std::min(a + 4, 63) - left + 1).maxCoeff();
      if (map.power_db(r, a) < around_db || map.power_db(r, a) <= levels.threshold_db(r, a)) continue;
      ASSERT_LT(expected, static_cast<int>(found.size()));
      const Detection& detection = found[static_cast<std::size_t>(expected++)];
      EXPECT_EQ(detection.range_bin, r);
      EXPECT_EQ(detection.angle_bin, a);
      EXPECT_NEAR(detection.snr_db, map.power_db(r, a) - levels.noise_db(r, a), 1e-9);
    }
  }
  EXPECT_GT(expected, 3);
  EXPECT_EQ(expected, static_cast<int>(found.size()));
}

TEST(CfarFloor, IsTheReceiversWhereATenthOfTheMapIsNoise) {
  const Cfar cfar(settingsOf(CfarKind::kCellAveraging), paperRadar());
  RangeAngleMap map = flatMap(-60);
  map.power_db.bottomRows(30).setConstant(-95);
  EXPECT_NEAR(cfar.noiseFloor_db(map.power_db), -95, 1e-9);
  map.power_db.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_TRUE(std::isnan(cfar.noiseFloor_db(map.power_db)));
}

TEST(CfarSettings, ValuesOutOfRangeAreRefused) {
  const auto refusal = [](auto change) {
    CfarSettings settings;
    change(settings);
    return inputError([&] { Cfar(settings, paperRadar()); });
  };
  EXPECT_TRUE(
      saysInOneLine(refusal([](CfarSettings& s) { s.false_alarm_rate = 0; }), "false_alarm_rate: 0", "1e-12 to 0.5"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.guard_m = -1; }), "guard_m: -1", "0 to 100"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.training_m = NAN; }), "training_m: nan", "0.01 to 100"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.guard_beams = -2; }), "guard_beams: -2", "0 to 64"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.training_beams = 65; }), "training_beams: 65", "0 to 64"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.rank_share = 1.1; }), "rank_share: 1.1", "0.01 to 1"));
  EXPECT_TRUE(saysInOneLine(refusal([](CfarSettings& s) { s.sidelobe_db = -1; }), "sidelobe_db: -1", "0 to 400"));
}

}  // namespace
}  // namespace mmradartwin
