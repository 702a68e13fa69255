#include "mmradartwin_dsp/range_doppler.h"

#include "moving_echoes.h"

namespace mmradartwin {
namespace {

/// lambda_c/(2 L S T).
double speedBin_m_per_s(const RadarConfig& radar) {
  return kSpeedOfLight_m_per_s / radar.center_frequency_hz() / (2 * radar.loops_per_frame * radar.slots() * 60e-6);
}

double levelOf(double amplitude) { return 20 * std::log10(amplitude / 32768); }

TEST(RangeDoppler, EchoStandsAtItsRangeAndSpeedWithItsLevel) {
  for (const int loops : {32, 33}) {
    const RadarConfig radar = loopedRadar(loops);
    const SignalChain chain(radar);
    for (const int bin : {0, 5, -7}) {
      const double range_m = 20 * radar.range_bin_m(), speed = bin * speedBin_m_per_s(radar);
      const AdcCube cube = movingFrame(radar, {{range_m, 0.3, speed, 3000}}, 0, 1);
      const RangeDopplerMap map = rangeDopplerMap(chain, dopplerGrids(radar, cube, nullptr));
      ASSERT_EQ(map.power_db.rows(), 64);
      ASSERT_EQ(map.power_db.cols(), loops);
      Eigen::Index r = 0, d = 0;
      EXPECT_NEAR(map.power_db.maxCoeff(&r, &d), levelOf(3000), 0.1) << loops << " loops, bin " << bin;
      EXPECT_EQ(r, 20);
      EXPECT_NEAR(map.radial_speed_m_per_s[static_cast<std::size_t>(d)], speed, 1e-9);
      EXPECT_EQ(map.stamp_ns, cube.stamp_ns);
    }
  }
}

// The phase gained between the transmitters' turns would put the echo elsewhere, into two beams.
TEST(RangeDoppler, EchoOfEachSpeedKeepsItsAngle) {
  const RadarConfig radar = loopedRadar();
  const SignalChain chain(radar);
  for (const int bin : {-13, -4, 3, 12}) {
    const double azimuth_rad = chain.axes().azimuth_rad[40];
    const MovingEcho echo{3.0, azimuth_rad, bin * speedBin_m_per_s(radar), 3000};
    const DopplerGrids frame = dopplerGrids(radar, movingFrame(radar, {echo}, 0, 1), nullptr);
    const RangeAngleMap map = chain.map(frame.grids[static_cast<std::size_t>(bin + 16)]);
    Eigen::Index r = 0, a = 0;
    EXPECT_NEAR(map.power_db.maxCoeff(&r, &a), levelOf(3000), 1.5) << bin;  // range and speed lie between bins
    EXPECT_EQ(a, 40) << bin;
    EXPECT_EQ(frame.binsFromStill(static_cast<std::size_t>(bin + 16)), std::abs(bin));
  }
}

TEST(RangeDoppler, WhatStandsStillStaysInTheBinsAroundSpeed0ThoughChirpsAreLost) {
  const RadarConfig radar = loopedRadar();
  AdcCube cube = movingFrame(radar, {{3.1, 0, 0, 8000}}, 0, 1);
  const auto per_chirp = static_cast<std::size_t>(cube.samples * cube.receivers * 2);
  for (const std::size_t chirp : {3u, 4u, 20u, 21u, 40u}) {
    cube.chirp_valid[chirp] = 0;
    std::fill_n(cube.data.begin() + static_cast<std::ptrdiff_t>(chirp * per_chirp), per_chirp, std::int16_t{0});
  }
  const RangeDopplerMap map = rangeDopplerMap(SignalChain(radar), dopplerGrids(radar, cube, nullptr));
  EXPECT_NEAR(map.power_db.col(16).maxCoeff(), levelOf(8000), 1.5);
  for (int d = 0; d < 32; ++d) {
    // What is left is the rounding of samples, and the same in each loop.
    if (std::abs(d - 16) <= 1) continue;
    EXPECT_LT(map.power_db.col(d).maxCoeff(), -200) << d;
  }
}

TEST(RangeDoppler, ChannelsAreCorrected) {
  const RadarConfig radar = loopedRadar(8);
  const AdcCube cube = movingFrame(radar, {{3.1, 0.1, 0, 8000}}, 0, 1);
  ChannelCorrection correction;
  correction.phase_deg.assign(8, 0);
  correction.gain_db.assign(8, 0);
  correction.phase_deg[5] = 90;
  correction.gain_db[5] = 20;
  const ComplexGrid raw = dopplerGrids(radar, cube, nullptr).grids[4].x;
  const ComplexGrid x = dopplerGrids(radar, cube, &correction).grids[4].x;
  EXPECT_TRUE(x.row(4) == raw.row(4));
  EXPECT_NEAR(std::abs(x(5, 7) - raw(5, 7) / std::complex<double>(0, 10)), 0, 1e-9);
}

TEST(RangeDoppler, FramesThatTellNoSpeedAreRefusedWithTheReason) {
  RadarConfig radar = loopedRadar(1);
  EXPECT_TRUE(saysInOneLine(whyNoSpeeds(radar), "frames have 1 loop,", "8 or more"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { dopplerGrids(radar, AdcCube(), nullptr); }), "no speeds", "1 loop"));
  radar = loopedRadar(7);
  EXPECT_TRUE(saysInOneLine(whyNoSpeeds(radar), "frames have 7 loops,"));
  radar = loopedRadar(8);
  EXPECT_EQ(whyNoSpeeds(radar), "");
  radar.idle_s = std::nan("");
  EXPECT_TRUE(saysInOneLine(whyNoSpeeds(radar), "idle_s", "ramp_end_s"));
  radar = loopedRadar(8);
  AdcCube cube = movingFrame(radar, {}, 1, 1);
  for (std::size_t chirp = 1; chirp < 16; chirp += 2) cube.chirp_valid[chirp] = 0;
  EXPECT_TRUE(saysInOneLine(inputError([&] { dopplerGrids(radar, cube, nullptr); }), "no valid chirp of slot 1"));
  cube.data.pop_back();
  EXPECT_TRUE(saysInOneLine(inputError([&] { dopplerGrids(radar, cube, nullptr); }), "another shape"));
}

}  // namespace
}  // namespace mmradartwin
