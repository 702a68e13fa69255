#include "diagnosis/frames/shot_examiner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/frames/drawn_frames.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr int kFrames = 60;
constexpr double kNoise = 6;  // rms of I and of Q, counts

/// Two echoes that stand, and whatever a test adds.
class ShotExaminerTest : public ::testing::Test {
 protected:
  std::complex<double> standing(const SamplePlace& at) const {
    return echoSample(radar_, 3000, 2.1, 0.5, at) + echoSample(radar_, 1200, 4.6, -0.35, at);
  }
  FrameStack draw(const DrawnFrames::Signal& signal, int frames = kFrames, unsigned seed = 1) {
    return DrawnFrames(radar_, seed).stack(frames, kNoise, signal);
  }
  ShotStatistics examine(const DrawnFrames::Signal& signal, int frames = kFrames) {
    const FrameStack stack = draw(signal, frames);
    return ShotExaminer(radar_).examine(stack, meanShot(stack));
  }
  /// A point that goes straight, seen from frame to frame at its exact range.
  DrawnFrames::Signal mover(double amplitude, double range_m, double azimuth_rad, double speed_m_per_s) const {
    return [=](const SamplePlace& at) {
      const double chirp_s = radar_.adc_start_s + radar_.samples_per_chirp / radar_.sample_rate_hz;
      const double t_s = at.frame * radar_.frame_period_s + (at.loop * radar_.slots() + at.slot) * chirp_s;
      return standing(at) + echoSample(radar_, amplitude, range_m + speed_m_per_s * t_s, azimuth_rad, at);
    };
  }
  int bin(double range_m) const { return static_cast<int>(std::lround(range_m / radar_.range_bin_m())); }
  RadarConfig radar_ = paperRadar();
};

TEST_F(ShotExaminerTest, ReadsTheNoiseOfEachChannel) {
  const ShotStatistics s = examine([&](const SamplePlace& at) { return standing(at); });
  EXPECT_EQ(s.shots, kFrames);
  ASSERT_EQ(s.noise_variance.size(), 8u);
  for (double v : s.noise_variance) EXPECT_NEAR(v, 2 * kNoise * kNoise + 1.0 / 6, 0.12 * 2 * kNoise * kNoise);
}

TEST_F(ShotExaminerTest, FindsNothingWhereNothingMoves) {
  const ShotStatistics s = examine([&](const SamplePlace& at) { return standing(at); });
  EXPECT_TRUE(s.unsteadiness.empty());
  EXPECT_LT(s.evidence.maxCoeff(), 12);
  EXPECT_TRUE(s.cells.empty());
  EXPECT_EQ(s.unsteady_share, 0);
  EXPECT_NEAR(s.turn_rad_per_frame, 0, 4 * std::sqrt(s.turn_variance));
  for (double level : s.frame_level) EXPECT_NEAR(level, 1, 0.002);
  EXPECT_LT(s.echoes.size(), 4u) << "chance passes one bin in a million";
}

TEST_F(ShotExaminerTest, NoiseIsReadBesideAWalker) {
  const ShotStatistics s = examine(mover(2000, 3.2, 0.1, 0.7));
  for (double v : s.noise_variance) EXPECT_NEAR(v, 2 * kNoise * kNoise + 1.0 / 6, 0.2 * 2 * kNoise * kNoise);
}

TEST_F(ShotExaminerTest, PlacesAMoverInRangeAndAngle) {
  for (double azimuth_rad : {-0.6, 0.0, 0.35}) {
    const double start_m = 3.2, speed_m_per_s = 0.05;
    const ShotStatistics s = examine(mover(400, start_m, azimuth_rad, speed_m_per_s));
    ASSERT_GE(s.echoes.size(), 50u);
    int near = 0;
    for (const MovingEcho& e : s.echoes) {
      const double range_m = start_m + speed_m_per_s * e.frame * radar_.frame_period_s;
      near += std::abs(e.range_m - range_m) < 0.1 && std::abs(e.azimuth_rad - azimuth_rad) < 0.06 ? 1 : 0;
      EXPECT_TRUE(std::isnan(e.radial_m_per_s)) << "one loop tells no speed";
    }
    EXPECT_GT(near, 50);
    Eigen::Index at_bin = 0, at_beam = 0;
    EXPECT_GT(s.evidence.maxCoeff(&at_bin, &at_beam), 100);
    EXPECT_NEAR(static_cast<double>(at_bin), bin(start_m + 0.075), 1);
    EXPECT_NEAR(ShotExaminer(radar_).axes().azimuth_rad[static_cast<std::size_t>(at_beam)], azimuth_rad, 0.1);
  }
}

TEST_F(ShotExaminerTest, EchoOfAMoverHasItsPowerOverTheNoise) {
  // Amplitude A in M channels of variance v after Hann: A^2 (sum w)^2 M / (v sum w^2), and the average takes 1/shots.
  const double amplitude = 60, m = 8, n = radar_.samples_per_chirp;
  const ShotStatistics s = examine(mover(amplitude, bin(3.2) * radar_.range_bin_m(), 0, 0.031));
  const double expected = amplitude * amplitude * m * (n / 2) * (n / 2) / (2 * kNoise * kNoise * 3 * n / 8);
  double mean = 0;
  int count = 0;
  for (const MovingEcho& e : s.echoes) {
    if (bin(e.range_m) != bin(3.2)) continue;
    mean += e.snr;
    ++count;
  }
  ASSERT_GT(count, 40);
  EXPECT_NEAR(mean / count / expected, 1, 0.25);
}

TEST_F(ShotExaminerTest, UnsteadinessIsWhereSomethingMoves) {
  const ShotStatistics s = examine(mover(300, 3.2, 0.1, 0.02));
  ASSERT_EQ(s.unsteadiness.size(), 64u);
  EXPECT_GT(s.unsteadiness[static_cast<std::size_t>(bin(3.2))], 50);
  for (int b = 0; b < 64; ++b) {
    EXPECT_GE(s.unsteadiness[static_cast<std::size_t>(b)], 1);
    if (std::abs(b - bin(3.2)) > 8) {
      EXPECT_EQ(s.unsteadiness[static_cast<std::size_t>(b)], 1) << b;
    }
  }
}

TEST_F(ShotExaminerTest, CommonTurnIsTheTurnOfStandingEchoes) {
  for (double turn : {-0.4, 0.03, 1.5}) {
    const FrameStack stack =
        draw([&](const SamplePlace& at) { return std::polar(1.0, turn * at.frame) * standing(at); });
    EXPECT_NEAR(ShotExaminer(radar_).commonTurn(stack), turn, 2e-3) << turn;
  }
  // What moves takes part of the bins, not the median.
  const FrameStack walked = draw([&](const SamplePlace& at) {
    return standing(at) + std::polar(1.0, 0.8 * at.frame) * echoSample(radar_, 1000, 3.2, 0.1, at);
  });
  EXPECT_NEAR(ShotExaminer(radar_).commonTurn(walked), 0, 2e-3);
  EXPECT_EQ(ShotExaminer(radar_).commonTurn(draw([&](const SamplePlace& at) { return standing(at); }, 2)), 0);
}

TEST_F(ShotExaminerTest, SlowTurnIsReadWithItsError) {
  const double turn = 0.002;
  const ShotStatistics s = examine([&](const SamplePlace& at) {
    const auto alike = echoSample(radar_, 3000, 2.1, 0.5, at) + echoSample(radar_, 3000, 3.7, 0, at) +
                       echoSample(radar_, 3000, 5.3, -0.4, at);
    return std::polar(1.0, turn * (at.frame - 29.5)) * alike;
  });
  EXPECT_GE(s.turn_cells, 2) << "three echoes, each in two or three bins";
  EXPECT_NEAR(s.turn_rad_per_frame, turn, 4 * std::sqrt(s.turn_variance));
  EXPECT_LT(std::sqrt(s.turn_variance), 1e-4);
}

TEST_F(ShotExaminerTest, LevelsOfFramesAreThoseOfTheSignal) {
  const auto level = [](int frame) { return frame < 20 ? 0.9 : 1.05; };
  const ShotStatistics s = examine([&](const SamplePlace& at) { return level(at.frame) * standing(at); });
  ASSERT_EQ(s.frame_level.size(), static_cast<std::size_t>(kFrames));
  for (int f = 0; f < kFrames; ++f) EXPECT_NEAR(s.frame_level[static_cast<std::size_t>(f)], level(f), 0.003) << f;
}

TEST_F(ShotExaminerTest, RadarThatChangesIsUnsteadyInItsEchoes) {
  // Every second frame comes a third of a bin later: each echo has another phase and channel there.
  const ShotStatistics s = examine([&](const SamplePlace& at) {
    const double late = at.frame % 2 == 1 ? 2 * M_PI * 0.7 * at.sample / radar_.samples_per_chirp : 0;
    return std::polar(1.0, late) * standing(at);
  });
  EXPECT_GT(s.unsteady_share, 0.5);
  EXPECT_GT(s.unsteady_nats, 1000);
  EXPECT_TRUE(s.unsteadiness.empty()) << "nothing in the room moves";
}

TEST_F(ShotExaminerTest, ShotsWithGapsAreLeftOut) {
  FrameStack stack = draw([&](const SamplePlace& at) { return standing(at); });
  for (int k = 0; k < 8; ++k) {
    for (int n = 0; n < 10; ++n) {  // 16 % of shot 4, 3 % of shot 9
      stack.use[stack.at(4, k, n)] = 0;
      if (n < 2) stack.use[stack.at(9, k, n)] = 0;
    }
  }
  EXPECT_EQ(ShotExaminer(radar_).examine(stack, meanShot(stack)).shots, kFrames - 1);
}

TEST_F(ShotExaminerTest, ManyLoopsTellTheSpeed) {
  radar_.loops_per_frame = 64;
  radar_.idle_s = 180e-6;  // 200 us per chirp, 400 us per loop: 2.4 m/s either way
  radar_.ramp_end_s = 20e-6;
  const double chirp_s = radar_.idle_s + radar_.ramp_end_s;
  for (double speed_m_per_s : {-0.9, 1.4}) {
    const double range_m = 3.2, azimuth_rad = 0.3;
    const ShotStatistics s = examine(
        [&](const SamplePlace& at) {
          const double t_s = (at.loop * 2 + at.slot) * chirp_s;
          return standing(at) + echoSample(radar_, 200, range_m + speed_m_per_s * t_s, azimuth_rad, at);
        },
        2);
    ASSERT_EQ(s.echoes.size(), 2u) << "one body in each of two frames";
    for (const MovingEcho& e : s.echoes) {
      EXPECT_NEAR(e.radial_m_per_s, speed_m_per_s, 0.05);
      EXPECT_NEAR(e.range_m, range_m + 0.0128 * speed_m_per_s, 0.1);
      EXPECT_NEAR(e.azimuth_rad, azimuth_rad, 0.05);
    }
    ASSERT_FALSE(s.cells.empty());
    const MovingCell& cell = s.cells.front();
    EXPECT_NEAR(cell.turn_rad, std::remainder(4 * M_PI * speed_m_per_s * chirp_s / radar_.wavelength_m(), 2 * M_PI),
                2 * M_PI / 128);
    // Its channels are the array response, each slot later on its way.
    for (int k = 1; k < 8; ++k) {
      const double across = -2 * M_PI * radar_.virtual_element_m(k).y() * std::sin(azimuth_rad) / radar_.wavelength_m();
      const double expected = across + cell.turn_rad * (k / 4);
      EXPECT_NEAR(std::remainder(std::arg(cell.channels[k] / cell.channels[0]) - expected, 2 * M_PI), 0, 0.25) << k;
    }
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
