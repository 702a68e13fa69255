#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <random>

#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/diagnosis_report.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin {
namespace {

/// A recording in memory: at each of eight places other echoes in thermal noise, and a tone that belongs to the radar.
class RoomWithoutScene : public ::testing::Test {
 protected:
  static constexpr int kPoses = 8, kFrames = 20;
  static constexpr double kNoise_counts = 6;  // rms of I and of Q

  void addTone(double range_m, double azimuth_rad, std::complex<double> amplitude, ComplexGrid& x) const {
    for (int k = 0; k < radar_.channels(); ++k) {
      const double path = -2 * M_PI * radar_.virtual_element_m(k).y() * std::sin(azimuth_rad) / radar_.wavelength_m();
      for (int n = 0; n < radar_.samples_per_chirp; ++n) {
        const double turns = range_m / radar_.range_bin_m() * n / radar_.samples_per_chirp;
        x(k, n) += amplitude * std::polar(1.0, path + 2 * M_PI * turns);
      }
    }
  }
  /// own: the radar's tone [M] at 0.3 m, in counts.
  Recording record(const Eigen::VectorXcd& own) {
    Recording recording;
    recording.radar = radar_;
    recording.source = "memory";
    std::mt19937 random(3);
    std::uniform_real_distribution<double> range_m(1.5, 8), azimuth_rad(-0.9, 0.9), phase(0, 2 * M_PI);
    std::normal_distribution<double> noise(0, kNoise_counts);
    for (int i = 0; i < kPoses; ++i) {
      Pose pose;
      pose.name = pose.location = std::to_string(i);
      pose.stamp_ns = 10000000000LL * i;
      pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(i, 0, 1));
      recording.poses.push_back(pose);
      recording.pose_names.push_back(pose.name);
      ComplexGrid x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
      for (int e = 0; e < 8; ++e)
        addTone(range_m(random), azimuth_rad(random), std::polar(400.0 / (1 + e), phase(random)), x);
      for (int k = 0; k < radar_.channels(); ++k) {
        for (int n = 0; n < radar_.samples_per_chirp; ++n) {
          x(k, n) += own[k] * std::polar(1.0, 2 * M_PI * 0.3 / radar_.range_bin_m() * n / radar_.samples_per_chirp);
        }
      }
      for (int f = 0; f < kFrames; ++f) {
        AdcCube cube;
        cube.sequence = static_cast<std::uint32_t>(f);
        cube.stamp_ns = pose.stamp_ns + radar_.frame_offset_ns(f);
        cube.chirps = radar_.chirps_per_frame();
        cube.samples = radar_.samples_per_chirp;
        cube.receivers = radar_.receivers();
        cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
        for (int slot = 0; slot < radar_.slots(); ++slot) {
          for (int n = 0; n < radar_.samples_per_chirp; ++n) {
            for (int r = 0; r < radar_.receivers(); ++r) {
              const std::complex<double> v = x(slot * radar_.receivers() + r, n);
              for (double part : {v.real(), v.imag()}) {
                cube.data.push_back(static_cast<std::int16_t>(std::lround(part + noise(random))));
              }
            }
          }
        }
        frames_[pose.name].push_back(cube);
      }
    }
    recording.forEachFrame = [this](const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
      for (const AdcCube& cube : frames_.at(pose.name)) visit(cube);
    };
    return recording;
  }

  RadarConfig radar_ = paperRadar();
  std::map<std::string, std::vector<AdcCube>> frames_;
};

TEST_F(RoomWithoutScene, NothingIsFoundWhereNothingIsWrong) {
  const Diagnosis diagnosis = diagnoseReceiver(record(Eigen::VectorXcd::Zero(radar_.channels())), {});
  EXPECT_EQ(diagnosis.findings.verdict(), "none") << diagnosisText(diagnosis);
  EXPECT_FALSE(diagnosis.has_twin);
  EXPECT_EQ(diagnosis.findings.poses, kPoses);
  EXPECT_EQ(diagnosis.findings.locations, kPoses);
  EXPECT_TRUE(diagnosis.plan.walls.empty());
  ASSERT_EQ(diagnosis.plan.stations.size(), static_cast<std::size_t>(kPoses));
  EXPECT_EQ(diagnosis.plan.stations[3].at_m.x(), 3);
  EXPECT_TRUE(diagnosis.problems.empty());
}

TEST_F(RoomWithoutScene, AToneThatIsTheSameAtEveryPlaceIsLeakage) {
  Eigen::VectorXcd own(radar_.channels());
  for (int k = 0; k < radar_.channels(); ++k) own[k] = std::polar(100.0, 1.3 * k * k);
  const Diagnosis diagnosis = diagnoseReceiver(record(own), {});
  ASSERT_EQ(diagnosis.findings.findings.size(), 1u);
  const Finding& finding = diagnosis.findings.findings[0];
  EXPECT_EQ(finding.cause, "tx_rx_leakage");
  ASSERT_NE(finding.parameter("range_m"), nullptr);
  EXPECT_LT(std::abs(std::get<double>(finding.parameter("range_m")->value) - 0.3), radar_.range_bin_m());
  ASSERT_EQ(diagnosis.extended.mechanisms.size(), 1u);
  EXPECT_EQ(diagnosis.extended.mechanisms[0].mechanism, "tx_rx_leakage");
  EXPECT_TRUE(finding.gain);
}

TEST_F(RoomWithoutScene, APoseOfZerosIsLeftOut) {
  Recording recording = record(Eigen::VectorXcd::Zero(radar_.channels()));
  for (AdcCube& cube : frames_["2"]) std::fill(cube.data.begin(), cube.data.end(), std::int16_t{0});
  const Diagnosis diagnosis = diagnoseReceiver(recording, {});
  EXPECT_EQ(diagnosis.findings.poses, kPoses - 1);
  ASSERT_EQ(diagnosis.problems.size(), 1u);
  EXPECT_EQ(diagnosis.problems[0].pose, "2");
}

TEST_F(RoomWithoutScene, ACancelledDiagnosisStops) {
  DiagnosisOptions options;
  options.cancelled = [] { return true; };
  EXPECT_THROW(diagnoseReceiver(record(Eigen::VectorXcd::Zero(radar_.channels())), options), DiagnosisCancelled);
}

}  // namespace
}  // namespace mmradartwin
