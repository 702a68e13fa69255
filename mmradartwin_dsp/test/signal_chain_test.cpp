#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/range_angle.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

struct Peak {
  Eigen::Index range, angle;
  double db;
};

Peak peakOf(const RangeAngleMap& map) {
  Peak peak = {};
  peak.db = map.power_db.maxCoeff(&peak.range, &peak.angle);
  return peak;
}

RangeAngleMap mapOf(const RadarConfig& radar, const ComplexGrid& x, double full_scale = 1) {
  ReceiveGrid grid;
  grid.x = x;
  grid.full_scale = full_scale;
  return SignalChain(radar).map(grid);
}

double rad(double degrees) { return degrees * M_PI / 180; }

TEST(SignalChain, AxesOfThePaper) {
  const RangeAngleAxes axes = SignalChain(paperRadar()).axes();
  ASSERT_EQ(axes.range_m.size(), 64u);
  ASSERT_EQ(axes.azimuth_rad.size(), 64u);
  EXPECT_NEAR(axes.range_m[1], 0.1561, 5e-5);
  EXPECT_NEAR(axes.azimuth_rad[0] * 180 / M_PI, -81.1, 0.05);
  EXPECT_NEAR(axes.azimuth_rad[63] * 180 / M_PI, 73.2, 0.05);
  EXPECT_EQ(axes.azimuth_rad[32], 0);
  EXPECT_TRUE(std::is_sorted(axes.azimuth_rad.begin(), axes.azimuth_rad.end()));
}

TEST(SignalChain, HannIsPeriodic) {
  const std::vector<double> w = hannWindow(64);
  EXPECT_EQ(w[0], 0);
  EXPECT_DOUBLE_EQ(w[32], 1);
  EXPECT_NEAR(w[1], 0.5 * (1 - std::cos(2 * M_PI / 64)), 1e-15);
  double sum = 0;
  for (const double value : w) sum += value;
  EXPECT_NEAR(sum, 32, 1e-12);  // N/2 for the periodic window, 31.5 for the symmetric one
}

TEST(SignalChain, PointTargetPeaksInItsBinAndOnItsSide) {
  const RadarConfig radar = paperRadar();
  const RangeAngleAxes axes = SignalChain(radar).axes();
  for (const double azimuth_deg : {-55.0, -20.0, 0.0, 30.0, 50.0}) {
    for (const double range_m : {1.3, 3.0, 7.5}) {
      const Peak peak = peakOf(mapOf(radar, pointTarget(radar, range_m, rad(azimuth_deg), 1)));
      // The virtual array's centre lies beside the radar's origin, and the peak is seen from there.
      const double center_y = radar.virtual_element_m(7).y() / 4;
      const double x = range_m * std::cos(rad(azimuth_deg)), y = range_m * std::sin(rad(azimuth_deg)) - center_y;
      const double sine = y / std::hypot(x, y);
      const int expected_angle =
          static_cast<int>(std::lround(32 + 32 * sine * 2 * radar.virtual_pitch_m() / radar.wavelength_m()));
      EXPECT_NEAR(static_cast<double>(peak.angle), expected_angle, 1) << azimuth_deg << " deg, " << range_m << " m";
      EXPECT_EQ(peak.range, std::lround(std::hypot(x, y) / radar.range_bin_m()))
          << azimuth_deg << " deg, " << range_m << " m";
      if (azimuth_deg != 0) {
        EXPECT_GT(axes.azimuth_rad[static_cast<std::size_t>(peak.angle)] * azimuth_deg, 0) << "wrong side";
      }
    }
  }
}

TEST(SignalChain, ConjugationMirrorsAngleAndRange) {
  const RadarConfig radar = paperRadar();
  const ComplexGrid x = pointTarget(radar, 3.0, rad(30), 1);
  const SignalChain chain(radar);
  const RealGrid map = chain.spatialSpectra(chain.rangeSpectra(x)).cwiseAbs();
  const RealGrid mirrored = chain.spatialSpectra(chain.rangeSpectra(x.conjugate())).cwiseAbs();
  for (int r = 0; r < 64; ++r) {
    for (int a = 0; a < 64; ++a) {
      EXPECT_NEAR(mirrored((64 - r) % 64, (64 - a) % 64), map(r, a), 1e-9) << r << " " << a;
    }
  }
}

TEST(SignalChain, TransformsEqualTheirSums) {
  RadarConfig radar = paperRadar();
  radar.samples_per_chirp = 12;
  const SignalChain chain(radar);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  ComplexGrid x(8, 12);
  for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = {normal(random), normal(random)};
  const ComplexGrid range = chain.rangeSpectra(x);
  const ComplexGrid spatial = chain.spatialSpectra(range);
  for (int r = 0; r < 12; ++r) {
    for (int k = 0; k < 8; ++k) {
      std::complex<double> sum = 0;
      for (int n = 0; n < 12; ++n) {
        sum += 0.5 * (1 - std::cos(2 * M_PI * n / 12)) * x(k, n) * std::polar(1.0, -2 * M_PI * r * n / 12);
      }
      EXPECT_LT(std::abs(sum - range(k, r)), 1e-12);
    }
    for (int a = 0; a < 64; ++a) {
      const double sine = (a - 32) / 32.0 * radar.wavelength_m() / (2 * radar.virtual_pitch_m());
      std::complex<double> sum = 0;
      for (int k = 0; k < 8; ++k) {
        sum += range(k, r) * std::polar(1.0, 2 * M_PI * radar.virtual_pitch_m() * k * sine / radar.wavelength_m());
      }
      EXPECT_LT(std::abs(sum - spatial(r, a)), 1e-11);
    }
  }
}

TEST(SignalChain, LargeArraysAreFoldedNotCut) {
  RadarConfig radar = paperRadar();
  for (int slot = 2; slot < 18; ++slot) radar.tx_position_m.emplace_back(0, slot * 0.0077867, 0);  // 72 elements
  const SignalChain chain(radar);
  const ComplexGrid range = ComplexGrid::Constant(72, 64, 1.0);
  // A plane wave from boresight adds up in bin 32 over all 72 elements.
  EXPECT_NEAR(std::abs(chain.spatialSpectra(range)(0, 32)), 72, 1e-9);
}

TEST(SignalChain, FullScaleToneIsZero_dBFS) {
  const RadarConfig radar = paperRadar();
  ComplexGrid x(8, 64);
  for (int k = 0; k < 8; ++k) {
    for (int n = 0; n < 64; ++n) x(k, n) = 32768.0 * std::polar(1.0, 2 * M_PI * 20 * n / 64);
  }
  const RangeAngleMap map = mapOf(radar, x, 32768);
  EXPECT_EQ(peakOf(map).range, 20);
  EXPECT_EQ(peakOf(map).angle, 32);
  EXPECT_NEAR(peakOf(map).db, 0, 1e-9);
  EXPECT_NEAR(mapOf(radar, x * 0.5, 32768).power_db(20, 32), 20 * std::log10(0.5), 1e-9);
  EXPECT_TRUE(mapOf(radar, ComplexGrid::Zero(8, 64)).power_db.allFinite());
}

TEST(SignalChain, BinsBeyondASineOfOneAreNaN) {
  RadarConfig radar = paperRadar();
  for (Eigen::Vector3d& p : radar.tx_position_m) p *= 0.8;
  for (Eigen::Vector3d& p : radar.rx_position_m) p *= 0.8;
  const RangeAngleMap map = mapOf(radar, pointTarget(radar, 3, 0, 1));
  EXPECT_TRUE(std::isnan(map.axes.azimuth_rad[0]));
  EXPECT_TRUE(std::isnan(map.power_db(10, 0)));
  EXPECT_FALSE(std::isnan(map.power_db(10, 32)));
}

TEST(SignalChain, NonUniformArraysAreErrors) {
  const auto with = [](const std::function<void(RadarConfig&)>& change) {
    RadarConfig radar = paperRadar();
    change(radar);
    return inputError([&] { SignalChain chain(radar); });
  };
  EXPECT_TRUE(
      saysInOneLine(with([](RadarConfig& r) { r.rx_position_m[2].y() += 3e-4; }), "uniform line along y", "element 2"));
  EXPECT_TRUE(saysInOneLine(with([](RadarConfig& r) { r.rx_position_m[1].z() += 3e-4; }), "uniform line along y"));
  EXPECT_TRUE(saysInOneLine(with([](RadarConfig& r) { r.tx_position_m[1].x() = 0.004; }), "slot 1", "0.004 m before"));
  EXPECT_TRUE(saysInOneLine(with([](RadarConfig& r) {
                              for (auto& p : r.rx_position_m) p.setZero();
                            }),
                            "uniform"));
  EXPECT_FALSE(inputError([] { SignalChain(paperRadar()).rangeSpectra(ComplexGrid::Zero(7, 64)); }).empty());
}

TEST(SignalChain, ThreadsShareOneChain) {
  const RadarConfig radar = paperRadar();
  const SignalChain chain(radar);
  const ComplexGrid x = pointTarget(radar, 3, 0.3, 1);
  const ComplexGrid expected = chain.spatialSpectra(chain.rangeSpectra(x));
  std::vector<int> wrong(4, 0);
  std::vector<std::thread> threads;
  for (int& count : wrong) {
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) count += chain.spatialSpectra(chain.rangeSpectra(x)) == expected ? 0 : 1;
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

class AverageTest : public ::testing::Test {
 protected:
  AverageTest() {
    radar_ = paperRadar();
    radar_.loops_per_frame = 3;
  }

  AdcCube cube(unsigned seed) const {
    std::mt19937 random(seed);
    std::uniform_int_distribution<int> value(-32768, 32767), coin(0, 3);
    AdcCube cube;
    cube.sequence = seed;
    cube.stamp_ns = seed * 50000000ll;
    cube.chirps = 6;
    cube.samples = 64;
    cube.receivers = 4;
    cube.data.resize(6 * 64 * 4 * 2);
    for (std::int16_t& sample : cube.data) sample = static_cast<std::int16_t>(value(random));
    for (int chirp = 0; chirp < 6; ++chirp) cube.chirp_valid.push_back(coin(random) == 0 ? 0 : 1);
    return cube;
  }

  /// The average by its definition, [M][N] from cubes [chirp][sample][rx][I, Q].
  ComplexGrid byDefinition(const std::vector<AdcCube>& cubes) const {
    ComplexGrid x = ComplexGrid::Zero(8, 64);
    for (int k = 0; k < 8; ++k) {
      for (int n = 0; n < 64; ++n) {
        std::int64_t re = 0, im = 0, weight = 0;
        for (const AdcCube& cube : cubes) {
          for (int loop = 0; loop < 3; ++loop) {
            const int chirp = loop * 2 + k / 4;
            if (!cube.chirp_valid[static_cast<std::size_t>(chirp)]) continue;
            const auto at = static_cast<std::size_t>(((chirp * 64 + n) * 4 + k % 4) * 2);
            re += cube.data[at];
            im += cube.data[at + 1];
            ++weight;
          }
        }
        x(k, n) = {static_cast<double>(re) / static_cast<double>(weight),
                   static_cast<double>(im) / static_cast<double>(weight)};
      }
    }
    return x;
  }

  RadarConfig radar_;
};

TEST_F(AverageTest, SlidingEqualsRecomputationBitForBit) {
  CoherentAverage average(radar_, 5);
  std::vector<AdcCube> all;
  for (unsigned i = 1; i <= 40; ++i) {
    all.push_back(cube(i));
    average.add(all.back());
    const std::vector<AdcCube> window(all.end() - std::min<std::ptrdiff_t>(5, static_cast<std::ptrdiff_t>(all.size())),
                                      all.end());
    EXPECT_EQ(average.frames(), static_cast<int>(window.size()));
    if (!average.complete()) continue;
    EXPECT_TRUE(average.grid().x == byDefinition(window)) << i;
    EXPECT_EQ(average.grid().stamp_ns, all.back().stamp_ns);
  }
}

TEST_F(AverageTest, InvalidChirpsCarryNoWeight) {
  AdcCube frame = cube(1);
  frame.chirp_valid = {1, 0, 0, 1, 1, 1};
  for (std::size_t i = 0; i < frame.data.size(); ++i) frame.data[i] = 1000;
  const std::size_t per_chirp = 64 * 4 * 2;
  for (const std::size_t chirp : {1u, 2u}) {  // what was lost is zero in the cube
    std::fill_n(frame.data.begin() + static_cast<std::ptrdiff_t>(chirp * per_chirp), per_chirp, std::int16_t{0});
  }
  CoherentAverage average(radar_, 0);
  average.add(frame);
  EXPECT_TRUE(average.grid().x == ComplexGrid::Constant(8, 64, std::complex<double>(1000, 1000)));
}

TEST_F(AverageTest, ASlotWithoutChirpsIsNamed) {
  AdcCube frame = cube(1);
  frame.chirp_valid = {1, 0, 1, 0, 1, 0};
  CoherentAverage average(radar_, 10);
  average.add(frame);
  EXPECT_FALSE(average.complete());
  EXPECT_TRUE(saysInOneLine(inputError([&] { average.grid(); }), "slot 1"));
  average.reset();
  EXPECT_EQ(average.frames(), 0);
}

TEST_F(AverageTest, ForeignShapesAreRefused) {
  CoherentAverage average(radar_, 10);
  AdcCube frame = cube(1);
  frame.receivers = 2;
  EXPECT_TRUE(saysInOneLine(inputError([&] { average.add(frame); }), "6 chirps", "2 receivers"));
  frame = cube(1);
  frame.data.pop_back();
  EXPECT_FALSE(inputError([&] { average.add(frame); }).empty());
  EXPECT_EQ(average.frames(), 0);
}

TEST(RealCapture, WallStandsAtItsPlace) {
  const auto capture = dataFolder() / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  SKIP_WITHOUT(capture);
  const RadarConfig radar = loadRadarConfig(MMRADARTWIN_DSP_SOURCE "/test/data/openradar_indoor.yaml");
  const Recording recording = openCapture(capture.string(), radar);
  const RangeAngleMap map = SignalChain(radar).map(averagePose(recording, recording.poses.front()));
  EXPECT_NEAR(map.axes.range_m[1], 0.0488, 5e-5);
  // The strongest static response beyond the leakage, within the evaluated field of view.
  double best_db = -1e9, best_range_m = 0;
  for (Eigen::Index r = 0; r < map.power_db.rows(); ++r) {
    for (Eigen::Index a = 0; a < map.power_db.cols(); ++a) {
      const double range_m = map.axes.range_m[static_cast<std::size_t>(r)];
      if (range_m < 0.5 || std::abs(map.axes.azimuth_rad[static_cast<std::size_t>(a)]) > M_PI / 3) continue;
      if (map.power_db(r, a) > best_db) best_db = map.power_db(r, a), best_range_m = range_m;
    }
  }
  EXPECT_NEAR(best_range_m, 5.2, 0.05);
}

}  // namespace
}  // namespace mmradartwin
