#include "diagnosis/frames/frame_stack.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "diagnosis/frames/drawn_frames.h"

namespace mmradartwin::diagnosis {
namespace {

class FrameStackTest : public ::testing::Test {
 protected:
  FrameStackTest() { radar_.loops_per_frame = 2; }
  FrameStack draw(int frames, double noise_rms, const DrawnFrames::Signal& signal, unsigned seed = 1) {
    return DrawnFrames(radar_, seed).stack(frames, noise_rms, signal);
  }
  std::complex<double> standing(const SamplePlace& at) const {
    return echoSample(radar_, 2000, 2.3, 0.4, at) + echoSample(radar_, 800, 4.1, -0.3, at);
  }
  /// A wave over `length` samples from sample `from` on, at all receivers.
  static std::complex<double> burst(const SamplePlace& at, int from, int length, double amplitude) {
    const int n = at.sample - from;
    return n < 0 || n >= length ? 0 : std::polar(amplitude, 0.3 * n * n + 0.9 * at.receiver);
  }
  RadarConfig radar_ = paperRadar();
};

TEST_F(FrameStackTest, PutsEveryValueInItsPlace) {
  const auto code = [](const SamplePlace& at) {
    return std::complex<double>(at.frame * 1000 + at.loop * 500 + at.slot * 100 + at.receiver * 10, at.sample);
  };
  const FrameStack stack = draw(3, 0, code);
  ASSERT_EQ(stack.shots(), 6);
  ASSERT_EQ(stack.channels(), 8);
  for (int f = 0; f < 3; ++f) {
    for (int loop = 0; loop < 2; ++loop) {
      for (int k = 0; k < 8; ++k) {
        for (int n = 0; n < 64; ++n) {
          const std::size_t i = stack.at(2 * f + loop, k, n);
          EXPECT_EQ(std::complex<double>(stack.x[i]), code({f, loop, k / 4, k % 4, n}));
          EXPECT_EQ(stack.use[i], 1);
        }
      }
    }
  }
}

TEST_F(FrameStackTest, ValuesOfLostChirpsAreZeroAndNotUsed) {
  DrawnFrames drawn(radar_);
  std::vector<AdcCube> cubes = drawn.cubes(2, 0, [](const SamplePlace&) { return 7.0; });
  cubes[1].chirp_valid[3] = 0;  // loop 1, slot 1
  const std::vector<int> order = payloadOrder(radar_);
  const FrameStack stack(radar_, toPayload(cubes, order), order);
  for (int shot = 0; shot < 4; ++shot) {
    for (int k = 0; k < 8; ++k) {
      const bool lost = shot == 3 && k >= 4;
      EXPECT_EQ(stack.use[stack.at(shot, k, 20)], lost ? 0 : 1);
      EXPECT_EQ(stack.x[stack.at(shot, k, 20)], std::complex<float>(lost ? 0 : 7));
    }
  }
  EXPECT_EQ(meanShot(stack)[stack.at(0, 5, 20)], std::complex<float>(7)) << "the mean is over what is used";
}

TEST_F(FrameStackTest, MedianShotIgnoresAFewWildShots) {
  const FrameStack stack = draw(20, 0, [&](const SamplePlace& at) {
    return std::round(standing(at).real()) + (at.frame < 4 ? std::complex<double>(9000, -9000) : 0.0);
  });
  const auto median = medianShot(stack), mean = meanShot(stack);
  for (int n = 0; n < 64; ++n) {
    const double truth = std::round(standing({0, 0, 0, 2, n}).real());
    EXPECT_EQ(median[stack.at(0, 2, n)], std::complex<float>(static_cast<float>(truth), 0));
    EXPECT_NEAR(mean[stack.at(0, 2, n)].imag(), -9000 * 0.2, 0.1);
  }
}

TEST_F(FrameStackTest, CommonGainsAreThoseOfTheShots) {
  const auto gain = [](int frame) { return std::polar(1 + 0.1 * frame, 0.2 * frame); };
  const FrameStack stack = draw(4, 3, [&](const SamplePlace& at) { return gain(at.frame) * standing(at); });
  std::vector<std::complex<float>> average(stack.values());
  for (int k = 0; k < 8; ++k) {
    for (int n = 0; n < 64; ++n) average[stack.at(0, k, n)] = std::complex<float>(standing({0, 0, k / 4, k % 4, n}));
  }
  const auto gains = commonGains(stack, average, 2 * 9.0);
  ASSERT_EQ(gains.size(), 8u);
  for (int shot = 0; shot < 8; ++shot) {
    EXPECT_LT(std::abs(std::complex<double>(gains[static_cast<std::size_t>(shot)]) - gain(shot / 2)), 1e-3) << shot;
  }
  // An average that is no more than its noise tells no gain.
  for (auto& v : average) v *= 1e-4f;
  for (const auto& g : commonGains(stack, average, 2 * 9.0)) EXPECT_EQ(g, std::complex<float>(1));
}

TEST_F(FrameStackTest, DifferenceVarianceIsThatOfTheNoiseWhateverMoves) {
  for (double speed : {0.0, 0.9}) {
    const FrameStack stack = draw(30, 8, [&](const SamplePlace& at) {
      return standing(at) + std::polar(1.0, speed * at.frame) * echoSample(radar_, 300, 3.0, 0, at);
    });
    // A mover of 28 dB over the noise adds less than a tenth.
    EXPECT_NEAR(differenceVariance(stack) / (2 * 64), 1, speed > 0 ? 0.1 : 0.05) << speed;
  }
  EXPECT_NEAR(differenceVariance(draw(5, 0, [](const SamplePlace&) { return 100.0; })), 1.0 / 6, 1e-12) << "rounding";
}

TEST_F(FrameStackTest, TurnsFramesByTheirNumber) {
  FrameStack stack = draw(5, 0, [](const SamplePlace&) { return 100.0; });
  turnFrames(0.3, stack);
  for (int shot = 0; shot < 10; ++shot) {
    EXPECT_LT(std::abs(stack.x[stack.at(shot, 3, 9)] - std::polar(100.0f, 0.3f * (shot / 2))), 1e-3f) << shot;
  }
}

TEST_F(FrameStackTest, PileUpIsWhatNoSineHas) {
  // P(sine of amplitude A in a code) = (acos(lower/A) - acos(upper/A)) / pi.
  const double amplitude = 1000, samples = 1e5;
  const auto inCode = [&](double below) {
    return samples * (std::acos((amplitude - below - 1) / amplitude) - std::acos((amplitude - below) / amplitude)) /
           M_PI;
  };
  double inside = 0;
  for (int i = 1; i <= 16; ++i) inside += inCode(i) / 16;
  EXPECT_EQ(pileUp({1000, inCode(0), inCode(1)}), 0) << "its own outermost code against the next";
  EXPECT_GT(pileUp({1000, 10 * inCode(0), inside}), 100);
  EXPECT_EQ(pileUp({1000, 1, 0}) > 1, false) << "one lone sample proves nothing";
  EXPECT_EQ(pileUp({1000, 1e6, std::numeric_limits<double>::infinity()}), 0) << "too few codes to say";
}

TEST_F(FrameStackTest, FindsTheConvertersLimit) {
  const double limit = 1500;
  const auto clipped = [&](const SamplePlace& at) {
    const std::complex<double> v = standing(at);
    return std::complex<double>(std::clamp(v.real(), -limit, limit), std::clamp(v.imag(), -limit, limit));
  };
  const FrameStack stack = draw(10, 0, clipped),
                   whole = draw(10, 5, [&](const SamplePlace&at) { return standing(at); });
  const Rails rails = countRails(stack);
  EXPECT_EQ(rails.high.code, 1500);
  EXPECT_EQ(rails.low.code, -1500);
  EXPECT_NEAR(rails.samples, 2 * 8 * 64, 1e-9) << "the same sample of all frames is one";
  double beyond = 0;
  for (int k = 0; k < 8; ++k) {
    for (int n = 0; n < 64; ++n) {
      const std::complex<double> v = standing({0, 0, k / 4, k % 4, n});
      beyond += (std::round(v.real()) >= limit) + (std::round(v.real()) <= -limit) + (std::round(v.imag()) >= limit) +
                (std::round(v.imag()) <= -limit);
    }
  }
  EXPECT_NEAR(rails.high.at_code + rails.low.at_code, beyond, 1e-9);
  EXPECT_GT(pileUp(rails.high), 10);
  EXPECT_EQ(pileUp(countRails(whole).high), 0);
  const ClippedValues values = clippedValues(rails, stack);
  EXPECT_EQ(values.limit, 1500);
  double count = 0;
  for (const auto& [at, of_both] : values.at) count += of_both;
  EXPECT_NEAR(count / 20, beyond, 1e-9);
  EXPECT_TRUE(clippedValues(countRails(whole), whole).at.empty());
}

TEST_F(FrameStackTest, StandingClippedValuesLeaveTheOthers) {
  FrameStack stack = draw(10, 0, [](const SamplePlace& at) {
    if (at.sample == 5) return std::complex<double>(1500, 0);                   // always clipped
    if (at.sample == 9 && at.frame == 2) return std::complex<double>(1500, 0);  // once
    return std::complex<double>(20.0 * (at.sample % 50) - 500, 5.0 * at.receiver - 9);
  });
  Rails rails;
  rails.high = {1500, 1000, 0};
  const ClippedValues clipped = clippedValues(rails, stack);
  const auto means = clippedMeans(clipped, stack);
  ASSERT_EQ(means.size(), 2u * 8) << "two samples of eight channels";
  for (const auto& [place, mean] : means) EXPECT_EQ(mean, std::complex<float>(1500, 0));
  dropStandingClipped(clipped, meanShot(stack), stack);
  for (int shot = 0; shot < 20; ++shot) {
    EXPECT_EQ(stack.use[stack.at(shot, 1, 5)], 0);
    EXPECT_EQ(stack.use[stack.at(shot, 1, 9)], 1);
  }
  Bursts none;
  none.hit.assign(40, 0);
  const ClippedCount count = countClipped(clipped, none, stack);
  EXPECT_NEAR(count.clipped, (20 * 8 + 2 * 8) / 20.0, 1e-9) << "I values per shot";
  EXPECT_NEAR(count.counted, 2 * 8 * 64, 1e-9);
  EXPECT_EQ(stack.use[stack.at(4, 1, 9)], 0);
  Bursts hit = none;
  hit.hit.assign(40, 1);
  EXPECT_EQ(countClipped(clipped, hit, stack).clipped, 0) << "what a burst drove there is not counted";
}

TEST_F(FrameStackTest, TakesOutChirpsWithABurstAlone) {
  FrameStack stack = draw(30, 6, [&](const SamplePlace& at) {
    const bool hit =
        (at.frame == 7 && at.loop == 1 && at.slot == 0) || (at.frame == 21 && at.loop == 0 && at.slot == 1);
    return standing(at) + (hit ? burst(at, 30, 12, 400) : 0.0);
  });
  const Bursts bursts = dropBursts(medianShot(stack), 2 * 36.0, stack);
  EXPECT_EQ(bursts.frames, 30);
  EXPECT_EQ(bursts.hit_frames, 2);
  EXPECT_GT(bursts.log_likelihood_gain, 1000);
  for (int shot = 0; shot < 60; ++shot) {
    for (int slot = 0; slot < 2; ++slot) {
      const bool hit = (shot == 15 && slot == 0) || (shot == 42 && slot == 1);
      EXPECT_EQ(bursts.hit[static_cast<std::size_t>(2 * shot + slot)] == 1, hit) << shot << " " << slot;
      EXPECT_EQ(stack.use[stack.at(shot, 4 * slot + 2, 50)] == 0, hit);
    }
  }
}

TEST_F(FrameStackTest, NoiseMoversAndFaultyReceiversAreNoBursts) {
  const std::vector<DrawnFrames::Signal> signals{
      [&](const SamplePlace& at) { return standing(at); },
      [&](const SamplePlace& at) {
        return standing(at) + std::polar(1.0, 1.3 * at.frame) * echoSample(radar_, 600, 3.0, 0.1, at);
      },
      [&](const SamplePlace& at) {
        const bool wild = at.receiver == 1 && at.frame == 5 && at.sample > 20 && at.sample < 30;
        return standing(at) + (wild ? std::polar(400.0, 2.0 * at.sample * at.sample) : 0.0);
      }};
  for (const auto& signal : signals) {
    FrameStack stack = draw(30, 6, signal);
    EXPECT_EQ(dropBursts(medianShot(stack), 2 * 36.0, stack).hit_frames, 0) << &signal - signals.data();
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
