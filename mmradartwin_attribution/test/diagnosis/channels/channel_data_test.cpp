#include "diagnosis/channels/channel_data.h"

#include <gtest/gtest.h>

#include <random>

#include "diagnosis/channels/drawn_channels.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr int kFrames = 40;
constexpr double kNoise = 8;  // rms of I and of Q, counts

/// A recording in memory: every pose a sum of tones, with noise.
class ChannelDataTest : public ::testing::Test {
 protected:
  using Change = std::function<void(int frame, ComplexGrid& x)>;

  void SetUp() override {
    recording_.source = "drawn";
    recording_.radar = radar_;
    for (int i = 0; i < 3; ++i) addPose(i);
    recording_.forEachFrame = [this](const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
      for (const AdcCube& cube : cubes_.at(pose.name)) visit(cube);
    };
  }
  void addPose(int number) {
    Pose pose;
    pose.name = "p" + std::to_string(number);
    pose.location = number < 2 ? "near" : "far";
    pose.stamp_ns = 10'000'000'000LL * number;
    recording_.poses.push_back(pose);
    measure(pose.name, {{bin_ * radar_.range_bin_m(), 0.2, amplitude_}});
  }
  void measure(const std::string& pose, const std::vector<DrawnTone>& tones, const Change& change = {}) {
    std::normal_distribution<double> noise(0, noise_);
    const ComplexGrid still = gridOf(radar_, tones);
    std::vector<AdcCube>& cubes = cubes_[pose];
    cubes.clear();
    for (int f = 0; f < kFrames; ++f) {
      ComplexGrid x = still;
      if (change) change(f, x);
      AdcCube cube;
      cube.sequence = static_cast<std::uint32_t>(f);
      cube.stamp_ns = 50'000'000LL * f;
      for (const Pose& p : recording_.poses) {
        if (p.name == pose) cube.stamp_ns += p.stamp_ns;
      }
      cube.chirps = 2;
      cube.samples = 64;
      cube.receivers = 4;
      cube.chirp_valid.assign(2, 1);
      for (int slot = 0; slot < 2; ++slot) {
        for (int n = 0; n < 64; ++n) {
          for (int r = 0; r < 4; ++r) {
            const std::complex<double> v = x(4 * slot + r, n);
            cube.data.push_back(static_cast<std::int16_t>(std::lround(v.real() + noise(random_))));
            cube.data.push_back(static_cast<std::int16_t>(std::lround(v.imag() + noise(random_))));
          }
        }
      }
      cubes.push_back(std::move(cube));
    }
  }
  ChannelData read(const std::function<void(AdcCube&)>& repair = {}) {
    FrameExaminer examiner(radar_);
    return readChannels(recording_, examiner, {}, repair);
  }

  RadarConfig radar_ = paperRadar();
  const int bin_ = 20;
  const std::complex<double> amplitude_ = std::polar(2000.0, 0.7);
  Recording recording_;
  std::map<std::string, std::vector<AdcCube>> cubes_;
  std::mt19937_64 random_{1};
  double noise_ = kNoise;
};

TEST_F(ChannelDataTest, TonesHaveTheirAmplitudeOverFullScale) {
  const ChannelData data = read();
  ASSERT_EQ(data.poses.size(), 3u);
  EXPECT_TRUE(data.problems.empty());
  const Eigen::VectorXcd expected = amplitude_ / 32768.0 * arrayResponse(radar_, 0.2);
  for (const PoseChannels& p : data.poses) {
    // Bin r of exp(2 pi j r (n - N/2)/N) is (-1)^r.
    // Frames are turned by what noise makes of a common turn: some milliradians of the mean.
    EXPECT_LT((p.range_spectra.col(bin_) - expected).norm(), 0.01 * expected.norm());
    EXPECT_EQ(p.shots, kFrames);
    EXPECT_TRUE(p.unsteadiness.empty());
    EXPECT_LT((p.uncorrected_average.x - p.grid.x).norm(), 0.01 * p.grid.x.norm());
  }
}

TEST_F(ChannelDataTest, NoisePowerIsThatOfEmptyCells) {
  // Variance v of a sample, over 40 shots, through Hann: v sum w^2 / (sum w)^2 = v (3N/8) / (N/2)^2.
  const double expected = (2 * kNoise * kNoise + 1.0 / 6) * (3 * 64 / 8.0) / (32.0 * 32.0) / 32768 / 32768 / kFrames;
  const ChannelData data = read();
  double power = 0;
  for (const PoseChannels& p : data.poses) {
    EXPECT_NEAR(p.noise_power / expected, 1, 0.1);
    for (int b = 30; b < 60; ++b) power += p.range_spectra.col(b).squaredNorm() / 8 / 30 / 3;
  }
  EXPECT_NEAR(power / expected, 1, 0.15);
}

TEST_F(ChannelDataTest, RoundingOfFramesThatAreAlikeDoesNotAverageOut) {
  // Noise of a hundredth of a count dithers nothing: 40 frames tell no more than one of them.
  noise_ = 0.01;
  for (int i = 0; i < 3; ++i) {
    measure("p" + std::to_string(i),
            {{20.37 * radar_.range_bin_m(), 0.2, {611.3, 105.1}}, {9.71 * radar_.range_bin_m(), -0.3, {97.7, 30.9}}});
  }
  const double of_one = (1.0 / 6) * (3 * 64 / 8.0) / (32.0 * 32.0) / 32768 / 32768;
  const ChannelData data = read();
  double power = 0;
  for (const PoseChannels& p : data.poses) {
    EXPECT_NEAR(p.noise_power / of_one, 1, 0.02);
    for (int b = 40; b < 60; ++b) power += p.range_spectra.col(b).squaredNorm() / 8 / 20 / 3;
  }
  EXPECT_NEAR(10 * std::log10(power / of_one), 0, 3);
  // Noise of 0.37 counts in I and in Q leaves 2 exp(-4 pi^2 0.137) / (2 pi^2) = 0.00045 of the rounding.
  noise_ = 0.37;
  for (int i = 0; i < 3; ++i) measure("p" + std::to_string(i), {{20.37 * radar_.range_bin_m(), 0.2, {611.3, 105.1}}});
  const double expected = of_one * 6 * ((2 * 0.137 + 1.0 / 6) / kFrames + 0.00045);
  EXPECT_NEAR(read().poses[0].noise_power / expected, 1, 0.1);
}

TEST_F(ChannelDataTest, NumbersLocationsInOrderOfAppearance) {
  ChannelData data = read();
  EXPECT_EQ(data.locations, (std::vector<std::string>{"near", "far"}));
  EXPECT_EQ(data.poses[0].location, 0);
  EXPECT_EQ(data.poses[1].location, 0);
  EXPECT_EQ(data.poses[2].location, 1);
  data.poses.erase(data.poses.begin(), data.poses.begin() + 2);
  numberLocations(data);
  EXPECT_EQ(data.locations, std::vector<std::string>{"far"});
  EXPECT_EQ(data.poses[0].location, 0);
}

TEST_F(ChannelDataTest, LeavesOutPosesThatCannotBeUsedAndSaysWhy) {
  for (AdcCube& cube : cubes_["p1"]) std::fill(cube.data.begin(), cube.data.end(), std::int16_t{0});
  cubes_["p2"].clear();
  const ChannelData data = read();
  ASSERT_EQ(data.poses.size(), 1u);
  ASSERT_EQ(data.problems.size(), 2u);
  EXPECT_EQ(data.problems[0].pose, "p1");
  EXPECT_EQ(data.problems[0].message, "pose 'p1': all its samples are zero; check the capture");
  EXPECT_NE(data.problems[1].message.find("holds no frame"), std::string::npos);
  cubes_["p0"].clear();
  EXPECT_THROW(read(), InputError);
}

TEST_F(ChannelDataTest, RepairsFramesBeforeAnythingLooksAtThem) {
  const ChannelData data = read([](AdcCube& frame) {
    for (std::size_t i = 1; i < frame.data.size(); i += 2) frame.data[i] = static_cast<std::int16_t>(-frame.data[i]);
  });
  // A conjugated tone stands at the mirrored bin with the conjugated channels.
  const Eigen::VectorXcd expected = std::conj(amplitude_) / 32768.0 * arrayResponse(radar_, -0.2);
  EXPECT_LT((data.poses[0].range_spectra.col(64 - bin_) - expected).norm(), 0.01 * expected.norm());
}

TEST_F(ChannelDataTest, TakesOutChannelErrorsThatACalibrationFound) {
  ChannelCorrection correction;
  for (int k = 0; k < 8; ++k) {
    correction.phase_deg.push_back(10.0 * k);
    correction.gain_db.push_back(k % 2 ? 6.0 : 0.0);
  }
  recording_.channels = correction;
  const ChannelData data = read();
  for (int k = 0; k < 8; ++k) {
    const std::complex<double> error = std::polar(k % 2 ? std::pow(10.0, 0.3) : 1.0, 10.0 * k * M_PI / 180);
    const std::complex<double> expected = amplitude_ / 32768.0 * arrayResponse(radar_, 0.2)[k] / error;
    EXPECT_LT(std::abs(data.poses[0].range_spectra(k, bin_) - expected), 0.01 * std::abs(expected)) << k;
  }
}

TEST_F(ChannelDataTest, ReportsItsProgressPoseByPose) {
  std::vector<std::size_t> done;
  FrameExaminer examiner(radar_);
  readChannels(recording_, examiner, [&](std::size_t pose, std::size_t all) {
    done.push_back(pose);
    EXPECT_EQ(all, 3u);
  });
  EXPECT_EQ(done, (std::vector<std::size_t>{1, 2, 3}));
}

TEST_F(ChannelDataTest, LeavesOutFramesInWhichTheRadarStillComesToRest) {
  // The first six frames are of a radar that rolls on: phases turn by two radians a frame.
  measure("p0", {{bin_ * radar_.range_bin_m(), 0.2, amplitude_}}, [](int frame, ComplexGrid& x) {
    if (frame < 6) x *= std::polar(1.0, 2.0 * (6 - frame));
  });
  EXPECT_EQ(read().poses[0].shots, kFrames) << "without a track nobody knows that it moved";
  for (int i = -40; i < 100; ++i) {
    StampedTransform t;
    t.stamp_ns = 50'000'000LL * i;
    t.T_map_radar = recording_.poses[0].T_map_radar;
    if (i < 0) t.T_map_radar.translation().x() -= 0.02 - 0.02 * i;
    recording_.track.push_back(t);
  }
  const ChannelData data = read();
  EXPECT_EQ(data.poses[0].shots, kFrames - 6);
  EXPECT_NEAR(std::abs(data.poses[0].range_spectra(0, bin_)), std::abs(amplitude_) / 32768,
              2e-3 * std::abs(amplitude_) / 32768);
}

TEST(ChangeBetween, IsNothingForTheSameAndOneForStrangers) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  ComplexGrid a(4, 500), b(4, 500);
  for (std::complex<double>& v : a.reshaped()) v = {normal(random), normal(random)};
  for (std::complex<double>& v : b.reshaped()) v = {normal(random), normal(random)};
  EXPECT_EQ(changeBetween(a, a), 0);
  EXPECT_NEAR(changeBetween(a, b), 1, 0.05);
  EXPECT_NEAR(changeBetween(a, -a), 2, 1e-12);
  EXPECT_EQ(changeBetween(ComplexGrid::Zero(2, 2), ComplexGrid::Zero(2, 2)), 0);
}

TEST(FrameSpectra, AreWindowedAndInCounts) {
  const RadarConfig radar = paperRadar();
  const ComplexGrid x = gridOf(radar, {{3.0, 0.1, 1000}});
  AdcCube cube;
  cube.chirps = 2;
  cube.samples = 64;
  cube.receivers = 4;
  cube.chirp_valid = {1, 1};
  for (int slot = 0; slot < 2; ++slot) {
    for (int n = 0; n < 64; ++n) {
      for (int r = 0; r < 4; ++r) {
        cube.data.push_back(static_cast<std::int16_t>(std::lround(x(4 * slot + r, n).real())));
        cube.data.push_back(static_cast<std::int16_t>(std::lround(x(4 * slot + r, n).imag())));
      }
    }
  }
  ReceiveGrid grid;
  grid.x = x;
  grid.full_scale = 1;
  const Eigen::MatrixXcd expected = 32 * spectraOf(grid);
  const SignalChain chain(radar);
  EXPECT_LT((frameSpectra(chain, cube) - expected).norm(), 2e-3 * expected.norm());
  cube.chirp_valid = {1, 0};
  EXPECT_EQ(frameSpectra(chain, cube).size(), 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
