#include "diagnosis/frames/frame_examiner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <iostream>
#include <random>
#include <set>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "synthetic_map.h"

namespace mmradartwin::diagnosis {
namespace {

using Complex = std::complex<double>;

constexpr int kFrames = 60;
constexpr double kNoise_counts = 6;  // rms of I and of Q

/// MMRADARTWIN_FRAME_SEED, for other sessions than the usual ones.
unsigned seedOfThisRun() {
  const char* seed = std::getenv("MMRADARTWIN_FRAME_SEED");
  return seed ? static_cast<unsigned>(std::strtoul(seed, nullptr, 10)) : 20261122u;
}

/// A room of fixed points around six poses that look at its middle, measured by exact delays
/// (docs/reference/contracts.md section 3).
class FrameEvidenceTest : public ::testing::Test {
 protected:
  FrameEvidenceTest() : seed_(seedOfThisRun()), random_(seed_), radar_(paperRadar()) {
    std::cout << "seed " << seed_ << std::endl;
    std::uniform_real_distribution<double> x(-3, 3), y(-2.5, 2.5);
    for (int i = 0; i < 25; ++i) points_.emplace_back(x(random_), y(random_), 1.0);
    for (int i = 0; i < 6; ++i) {
      const double angle = i * M_PI / 3;
      Pose pose;
      pose.name = "p" + std::to_string(i);
      pose.location = "l" + std::to_string(i);
      pose.stamp_ns = 1000000000LL * 10 * i;
      pose.T_map_radar = Eigen::Translation3d(4 * std::cos(angle), 4 * std::sin(angle), 1.0) *
                         Eigen::AngleAxisd(angle + M_PI, Eigen::Vector3d::UnitZ());
      poses_.push_back(pose);
    }
  }

  /// Adds the echo of a point in map to x [M][N].
  void addEcho(const Pose& pose, const Eigen::Vector3d& point, double amplitude, ComplexGrid& x) const {
    for (int k = 0; k < radar_.channels(); ++k) {
      const auto tx = static_cast<std::size_t>(k / radar_.receivers()),
                 rx = static_cast<std::size_t>(k % radar_.receivers());
      const double tau = ((point - pose.T_map_radar * radar_.tx_position_m[tx]).norm() +
                          (point - pose.T_map_radar * radar_.rx_position_m[rx]).norm()) /
                         kSpeedOfLight_m_per_s;
      for (int n = 0; n < radar_.samples_per_chirp; ++n) {
        const double cycles = radar_.carrier_hz * tau + radar_.slope_hz_per_s * tau * radar_.sample_time_s(n) -
                              0.5 * radar_.slope_hz_per_s * tau * tau;
        x(k, n) += amplitude * std::polar(1.0, 2 * M_PI * std::fmod(cycles, 1.0));
      }
    }
  }

  using FrameEffect = std::function<void(const Pose&, int frame, ComplexGrid& x)>;
  using PayloadEffect = std::function<void(const Pose&, std::vector<std::uint8_t>& payload)>;

  /// Frames of a pose; `peak` is the largest I or Q of the standing echoes in counts.
  std::vector<AdcCube> measure(const Pose& pose, double peak, const FrameEffect& effect, const PayloadEffect& bytes) {
    ComplexGrid still = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
    for (const auto& p : points_) addEcho(pose, p, 1 / (pose.T_map_radar.translation() - p).squaredNorm(), still);
    const double largest = std::max(still.real().cwiseAbs().maxCoeff(), still.imag().cwiseAbs().maxCoeff());
    still *= peak / largest;
    std::normal_distribution<double> noise(0, noise_counts_);
    std::vector<AdcCube> cubes(static_cast<std::size_t>(frames_));
    std::vector<std::uint8_t> payload;
    for (int f = 0; f < frames_; ++f) {
      ComplexGrid x = still;
      if (effect) effect(pose, f, x);
      AdcCube& cube = cubes[static_cast<std::size_t>(f)];
      cube.sequence = static_cast<std::uint32_t>(f);
      cube.chirps = radar_.chirps_per_frame();
      cube.samples = radar_.samples_per_chirp;
      cube.receivers = radar_.receivers();
      cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
      for (int slot = 0; slot < radar_.slots(); ++slot) {
        for (int n = 0; n < radar_.samples_per_chirp; ++n) {
          for (int r = 0; r < radar_.receivers(); ++r) {
            const Complex v = x(slot * radar_.receivers() + r, n);
            for (double part : {v.real(), v.imag()}) {
              cube.data.push_back(
                  static_cast<std::int16_t>(std::lround(std::clamp(part + noise(random_), -32768.0, 32767.0))));
            }
          }
        }
      }
      const auto encoded = encodeFrame(radar_, cube.data);
      payload.insert(payload.end(), encoded.begin(), encoded.end());
    }
    if (bytes) bytes(pose, payload);
    payload.resize(cubes.size() * radar_.bytes_per_frame());
    for (int f = 0; f < frames_; ++f) {
      decodeFrame(radar_, &payload[static_cast<std::size_t>(f) * radar_.bytes_per_frame()],
                  cubes[static_cast<std::size_t>(f)].data);
    }
    return cubes;
  }

  FrameExaminer examine(double peak, const FrameEffect& effect = {}, const PayloadEffect& bytes = {}) {
    FrameExaminer examiner(radar_);
    for (const Pose& p : poses_) examiner.addPose(p, measure(p, peak, effect, bytes));
    return examiner;
  }

  static std::vector<std::string> causes(const std::vector<FrameFinding>& findings) {
    std::vector<std::string> names;
    for (const auto& f : findings) {
      names.push_back(f.cause);
      // Each is fit to stand in findings.json.
      Finding whole;
      whole.cause = f.cause;
      whole.parameters = f.parameters;
      whole.evidence = {f.log_likelihood_gain, f.false_alarm_rate, {}, {}};
      whole.where = f.where;
      EXPECT_NO_THROW(toJson(whole));
    }
    std::sort(names.begin(), names.end());
    return names;
  }
  static double value(const FrameFinding& f, const std::string& name) {
    for (const auto& p : f.parameters) {
      if (p.name == name) return std::get<double>(p.value);
    }
    ADD_FAILURE() << f.cause << " has no " << name;
    return NAN;
  }

  FrameEffect burst(std::vector<int>& hit) {
    return [this, &hit](const Pose&, int, ComplexGrid& x) {
      if (std::uniform_real_distribution<double>()(random_) >= 0.1) return;
      ++hit[0];
      std::uniform_int_distribution<int> start(0, radar_.samples_per_chirp - 12);
      const int from = start(random_);
      for (int n = from; n < from + 12; ++n) {
        for (int r = 0; r < radar_.receivers(); ++r)
          x(r, n) += std::polar(2e4, 0.3 * (n - from) * (n - from) + 0.9 * r);
      }
    };
  }
  static FrameEffect drift(double rad_per_frame) {
    return [rad_per_frame](const Pose&, int f, ComplexGrid& x) { x *= std::polar(1.0, rad_per_frame * f); };
  }
  PayloadEffect loss(long long& lost, long long& packets) {
    return [this, &lost, &packets](const Pose&, std::vector<std::uint8_t>& payload) {
      for (std::size_t at = 0; at < payload.size(); at += 1456) {
        ++packets;
        if (std::uniform_real_distribution<double>()(random_) >= 0.05) continue;
        ++lost;
        std::fill_n(payload.begin() + static_cast<long>(at), std::min<std::size_t>(1456, payload.size() - at), 0);
      }
    };
  }

  unsigned seed_;
  std::mt19937_64 random_;
  RadarConfig radar_;
  std::vector<Pose> poses_;
  std::vector<Eigen::Vector3d> points_;
  double noise_counts_ = kNoise_counts;
  int frames_ = kFrames;
};

TEST_F(FrameEvidenceTest, NothingOnCleanSessions) {
  // Usual, near full scale, and down to where few codes are left and rounding is most of what differs.
  for (double peak : {12000.0, 32600.0, 200.0, 20.0}) {
    noise_counts_ = kNoise_counts * std::min(1.0, peak / 12000);
    const FrameExaminer examiner = examine(peak);
    EXPECT_TRUE(causes(examiner.findings()).empty()) << peak << " " << causes(examiner.findings())[0];
    EXPECT_TRUE(examiner.unexplained().empty()) << peak << " " << examiner.unexplained()[0].description;
    ASSERT_EQ(examiner.poses().size(), poses_.size());
    // I and Q together, and what rounding adds.
    const double variance = 2 * noise_counts_ * noise_counts_ + 1.0 / 6;
    for (const PoseFrames& p : examiner.poses()) {
      EXPECT_EQ(p.shots, kFrames);
      if (noise_counts_ < 1) continue;
      for (double v : p.noise_variance) EXPECT_NEAR(v / variance, 1, 0.15);
    }
  }
}

TEST_F(FrameEvidenceTest, SilenceIsNothing) {
  FrameExaminer examiner(radar_);
  auto cubes = measure(poses_[0], 1000, {}, {});
  for (AdcCube& c : cubes) std::fill(c.data.begin(), c.data.end(), std::int16_t{0});
  for (const Pose& p : poses_) examiner.addPose(p, cubes);
  EXPECT_TRUE(examiner.findings().empty());
  cubes[0].data.pop_back();
  EXPECT_THROW(examiner.addPose(poses_[0], cubes), InputError);
  EXPECT_TRUE(FrameExaminer(radar_).findings().empty());
}

TEST_F(FrameEvidenceTest, ClippedSamples) {
  const auto found = examine(45000).findings();
  ASSERT_EQ(causes(found), std::vector<std::string>{"adc_saturation"});
  EXPECT_GT(value(found[0], "clipped_fraction"), 1e-4);
  EXPECT_LT(value(found[0], "clipped_fraction"), 0.2);
}

TEST_F(FrameEvidenceTest, WhatAlwaysClipsStaysAsDelivered) {
  const FrameExaminer whole = examine(30000), clipped = examine(45000);
  int at_limit = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const ComplexGrid &is = clipped.poses()[i].mean.x, ought = 1.5 * whole.poses()[i].mean.x;
    for (Eigen::Index k = 0; k < is.rows(); ++k) {
      for (Eigen::Index n = 0; n < is.cols(); ++n) {
        const bool beyond = std::max(std::abs(ought(k, n).real()), std::abs(ought(k, n).imag())) > 33500;
        if (!beyond) continue;
        ++at_limit;
        EXPECT_GT(std::abs(is(k, n)), 0.7 * std::abs(ought(k, n))) << i << " " << k << " " << n;
      }
    }
  }
  EXPECT_GT(at_limit, 10);
}

TEST_F(FrameEvidenceTest, ZeroedPackets) {
  long long lost = 0, packets = 0;
  const auto found = examine(12000, {}, loss(lost, packets)).findings();
  ASSERT_EQ(causes(found), std::vector<std::string>{"packet_loss"});
  EXPECT_NEAR(value(found[0], "lost_fraction"), static_cast<double>(lost) / static_cast<double>(packets), 1e-12);
}

TEST_F(FrameEvidenceTest, ZeroedPacketsOfFewFramesAmongWeakEchoes) {
  // Most bins tell little of how frames turn, and a turn that is not there leaves what looks like bursts.
  frames_ = 16;
  noise_counts_ = 30;
  std::uniform_real_distribution<double> place(-3, 3);
  std::vector<Eigen::Vector3d> weak;
  for (int i = 0; i < 60; ++i) weak.emplace_back(place(random_), place(random_), 1.0);
  points_.resize(1);
  long long lost = 0, packets = 0;
  const FrameExaminer examiner = examine(
      6500,
      [&](const Pose& pose, int, ComplexGrid& x) {
        for (const Eigen::Vector3d& point : weak) addEcho(pose, point, 12, x);
      },
      loss(lost, packets));
  EXPECT_EQ(causes(examiner.findings()), std::vector<std::string>{"packet_loss"});
}

TEST_F(FrameEvidenceTest, MissingPackets) {
  const auto found = examine(12000, {}, [&](const Pose& pose, std::vector<std::uint8_t>& payload) {
                       if (pose.name != "p3") return;
                       const int packet = std::uniform_int_distribution<int>(1, 40)(random_);
                       payload.erase(payload.begin() + packet * 1456, payload.begin() + (packet + 1) * 1456);
                       payload.resize(payload.size() + 1456, 77);
                     }).findings();
  ASSERT_EQ(causes(found), std::vector<std::string>{"packet_misalignment"});
  EXPECT_EQ(std::get<std::string>(found[0].parameters[0].value), "p3");
}

TEST_F(FrameEvidenceTest, EachMisalignedPoseIsAFinding) {
  const auto found = examine(12000, {}, [&](const Pose& pose, std::vector<std::uint8_t>& payload) {
                       if (pose.name != "p1" && pose.name != "p3") return;
                       payload.erase(payload.begin() + 7 * 1456, payload.begin() + 8 * 1456);
                       payload.resize(payload.size() + 1456, 77);
                     }).findings();
  ASSERT_EQ(causes(found), (std::vector<std::string>{"packet_misalignment", "packet_misalignment"}));
  const std::set<std::string> poses{std::get<std::string>(found[0].parameters[0].value),
                                    std::get<std::string>(found[1].parameters[0].value)};
  EXPECT_EQ(poses, (std::set<std::string>{"p1", "p3"}));
}

TEST_F(FrameEvidenceTest, Bursts) {
  std::vector<int> hit(1, 0);
  const FrameExaminer examiner = examine(12000, burst(hit));
  const auto found = examiner.findings();
  ASSERT_EQ(causes(found), (std::vector<std::string>{"interference"}));
  EXPECT_TRUE(examiner.unexplained().empty()) << examiner.unexplained()[0].description;
  EXPECT_NEAR(value(found[0], "frame_fraction") * kFrames * 6, hit[0], 1.5);
}

TEST_F(FrameEvidenceTest, Drift) {
  const auto found = examine(12000, drift(-0.02)).findings();
  ASSERT_EQ(causes(found), (std::vector<std::string>{"phase_drift"}));
  EXPECT_NEAR(value(found[0], "rad_per_frame"), -0.02, 1e-4);
}

TEST_F(FrameEvidenceTest, WalkerIsPutIntoTheMap) {
  // To and fro on a line through the middle, 0.6 m/s.
  std::uniform_real_distribution<double> draw(-1, 1);
  const Eigen::Vector3d middle(draw(random_), draw(random_), 1.0);
  const double heading = M_PI * draw(random_), reach_m = 0.3, speed_m_per_s = 0.6;
  const auto found = examine(12000, [&](const Pose& pose, int f, ComplexGrid& x) {
                       const double way =
                           (pose.stamp_ns * 1e-9 + f * radar_.frame_period_s) * speed_m_per_s / (4 * reach_m);
                       const double along = reach_m * (4 * std::abs(way - std::floor(way) - 0.5) - 1);
                       addEcho(pose, middle + along * Eigen::Vector3d(std::cos(heading), std::sin(heading), 0), 600, x);
                     }).findings();
  ASSERT_EQ(causes(found), std::vector<std::string>{"moving_target"});
  EXPECT_NEAR(value(found[0], "x_m"), middle.x(), 0.2);
  EXPECT_NEAR(value(found[0], "y_m"), middle.y(), 0.2);
  EXPECT_NEAR(value(found[0], "speed_m_per_s"), speed_m_per_s, 0.25);
  EXPECT_GE(found[0].poses.size(), 4u);
}

TEST_F(FrameEvidenceTest, LimbsOfAWalkerThatBeatAreNoBursts) {
  // Stronger than all that stands, and moving in every frame: frames differ by nothing but the walker.
  std::normal_distribution<double> draw;
  radar_.slope_hz_per_s *= 1.6;  // bins that tell limbs apart
  const Eigen::Vector3d middle(0.3, -0.4, 1.0);
  std::string pose_of_limbs;
  std::vector<std::pair<Eigen::Vector3d, Complex>> limbs;
  const FrameExaminer examiner = examine(3000, [&](const Pose& pose, int f, ComplexGrid& x) {
    if (pose.name != pose_of_limbs) {
      pose_of_limbs = pose.name;
      limbs.resize(4);
      for (auto& [where, weight] : limbs) {
        where = middle + Eigen::Vector3d(0.1 * draw(random_), 0.1 * draw(random_), 0.2 * draw(random_));
        weight = {draw(random_), draw(random_)};
      }
    }
    const double way = 0.4 * (pose.stamp_ns * 1e-9 + f * radar_.frame_period_s);
    const double along_m = 0.4 * (4 * std::abs(way - std::floor(way) - 0.5) - 1);
    for (const auto& [where, weight] : limbs) {
      ComplexGrid echo = ComplexGrid::Zero(x.rows(), x.cols());
      addEcho(pose, where + along_m * Eigen::Vector3d::UnitX(), 1500, echo);
      x += weight * echo;
    }
  });
  for (const PoseFrames& p : examiner.poses()) EXPECT_EQ(p.shots, kFrames) << p.pose;
  const auto found = examiner.findings();
  ASSERT_EQ(causes(found), std::vector<std::string>{"moving_target"});
  EXPECT_NEAR(value(found[0], "x_m"), middle.x(), 0.3);
  EXPECT_NEAR(value(found[0], "y_m"), middle.y(), 0.3);
}

TEST_F(FrameEvidenceTest, ToneOfTheRadarIsNoWalkerAndNoSlip) {
  // A strong one turns all samples from frame to frame, which packets in another order may look like.
  for (double level : {300.0, 9000.0}) {
    const FrameExaminer examiner = examine(12000, [&](const Pose&, int, ComplexGrid& x) {
      const double phase = std::uniform_real_distribution<double>(0, 2 * M_PI)(random_);
      for (int n = 0; n < radar_.samples_per_chirp; ++n) x.col(n).array() += std::polar(level, phase + 2.9 * n);
    });
    EXPECT_TRUE(causes(examiner.findings()).empty()) << level << ": " << causes(examiner.findings())[0];
    ASSERT_EQ(examiner.unexplained().size(), 1u) << level;
    const FrameFinding tone = examiner.unexplained()[0];
    EXPECT_EQ(tone.poses.size(), poses_.size());
    const double bin_hz = radar_.sample_rate_hz / radar_.samples_per_chirp;
    EXPECT_NEAR(tone.mechanism->values.number("beat_hz"), 2.9 / (2 * M_PI) * radar_.sample_rate_hz, 0.2 * bin_hz);
    EXPECT_NEAR(tone.mechanism->values.number("level_db"), 20 * std::log10(level), 1.5);
    EXPECT_NEAR(tone.mechanism->values.number("azimuth_deg"), 0, 1);
    for (const auto& [pose, nats] : tone.nats_by_pose) EXPECT_GT(nats, 10) << pose;
  }
}

TEST_F(FrameEvidenceTest, GainThatSettlesIsSaidWhateverItsSize) {
  for (double loss_db : {0.5, 13.0}) {
    const FrameExaminer examiner = examine(
        12000, [&](const Pose&, int f, ComplexGrid& x) { x *= std::pow(10.0, -loss_db * std::exp(-f / 8.0) / 20); });
    EXPECT_TRUE(causes(examiner.findings()).empty()) << loss_db << ": " << causes(examiner.findings())[0];
    ASSERT_EQ(examiner.unexplained().size(), 1u) << loss_db;
    const FrameFinding gain = examiner.unexplained()[0];
    EXPECT_NE(gain.description.find("lowest in frame 0"), std::string::npos) << gain.description;
    const std::vector<double> gain_db = gain.mechanism->values.numbers("gain_db");
    const double frames = static_cast<double>(gain_db.size());
    EXPECT_NEAR(gain_db.front() - gain_db.back(), -loss_db * (1 - std::exp(-(frames - 1) / 8)), 0.02 + 0.05 * loss_db);
    double nats = 0;
    for (const auto& [pose, own] : gain.nats_by_pose) nats += own;
    EXPECT_GT(nats, 0);
  }
}

TEST_F(FrameEvidenceTest, FramesThatTakeTurnsAreNobodyWhoWalks) {
  // Every second frame comes late and weak: all echoes change, in many places at once.
  const double late_m = 0.45;
  const FrameExaminer examiner = examine(12000, [&](const Pose&, int f, ComplexGrid& x) {
    for (int n = 0; f % 2 == 1 && n < radar_.samples_per_chirp; ++n) {
      const double cycles = radar_.slope_hz_per_s * 2 * late_m / kSpeedOfLight_m_per_s * radar_.sample_time_s(n);
      x.col(n) *= std::polar(0.6, 2 * M_PI * cycles);
    }
  });
  EXPECT_TRUE(causes(examiner.findings()).empty()) << causes(examiner.findings())[0];
  ASSERT_FALSE(examiner.unexplained().empty());
  EXPECT_EQ(examiner.unexplained()[0].cause, "unknown");
  EXPECT_NE(examiner.unexplained()[0].description.find("the radar itself changes"), std::string::npos);
}

TEST(FrameEvidenceOfRecordings, TwoPeopleWalkInOpposite) {
  const char* folder = std::getenv("MMRADARTWIN_DATA");
  const std::filesystem::path repository = std::filesystem::path(MMRADARTWIN_TEST_DIR).parent_path();
  const std::filesystem::path data = folder ? folder : repository.parent_path() / "shared" / "data";
  const auto capture = data / "openradar_indoor" / "xwr22xx_4lane_adc_data.bin";
  if (!std::filesystem::exists(capture)) {
    GTEST_SKIP() << capture << " is not here; set MMRADARTWIN_DATA to the folder with the real recordings";
  }
  const RadarConfig radar = loadRadarConfig((repository / "mmradartwin_dsp/test/data/openradar_indoor.yaml").string());
  const Recording recording = openCapture(capture.string(), radar);
  FrameExaminer examiner(radar);
  std::vector<AdcCube> cubes;
  recording.forEachFrame(recording.poses[0], [&](const AdcCube& c) { cubes.push_back(c); });
  examiner.addPose(recording.poses[0], cubes);
  const auto found = examiner.findings();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(examiner.unexplained().empty());
  for (const auto& f : found) {
    EXPECT_EQ(f.cause, "moving_target");
    EXPECT_LE((*f.where[0].range_m)[0], 3.0);  // both near 3 m, the data's README says
    EXPECT_GE((*f.where[0].range_m)[1], 2.9);
    const auto speed = std::get<double>(f.parameters[2].value);
    EXPECT_GT(speed, 0.3);
    EXPECT_LT(speed, 1.5);
  }
  EXPECT_NE(found[0].description.find("away") == std::string::npos,
            found[1].description.find("away") == std::string::npos)
      << "they walk in opposite directions";
}

}  // namespace
}  // namespace mmradartwin::diagnosis
