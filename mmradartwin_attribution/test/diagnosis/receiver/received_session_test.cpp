#include "diagnosis/receiver/received_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "diagnosis/channels/drawn_channels.h"
#include "mmradartwin_attribution/diagnosis_options.h"

namespace mmradartwin::diagnosis {
namespace {

/// Six poses of echoes from everywhere and one leakage, 12 frames each.
class ReceivedSessionTest : public ::testing::Test {
 protected:
  Recording record(bool conjugated) {
    Recording recording;
    recording.source = "drawn";
    recording.radar = radar_;
    std::uniform_real_distribution<double> sine(-0.7, 0.7), phase(-M_PI, M_PI), range_m(0.6, 6);
    std::normal_distribution<double> noise(0, 5);
    Eigen::VectorXcd leakage(8);
    for (int k = 0; k < 8; ++k) leakage[k] = std::polar(800.0, 1.9 * k * k);
    for (int i = 0; i < 6; ++i) {
      Pose pose;
      pose.name = "p" + std::to_string(i);
      pose.location = pose.name;
      recording.poses.push_back(pose);
      ComplexGrid x = ComplexGrid::Zero(8, 64);
      for (int e = 0; e < 6; ++e) {
        addTone(radar_, range_m(random_), std::polar(1500.0, phase(random_)) * arrayResponse(radar_, sine(random_)), x);
      }
      addTone(radar_, 0.07, leakage, x);
      for (int f = 0; f < 12; ++f) {
        AdcCube cube;
        cube.sequence = static_cast<std::uint32_t>(f);
        cube.chirps = 2;
        cube.samples = 64;
        cube.receivers = 4;
        cube.chirp_valid = {1, 1};
        for (int slot = 0; slot < 2; ++slot) {
          for (int n = 0; n < 64; ++n) {
            for (int r = 0; r < 4; ++r) {
              const std::complex<double> v = x(4 * slot + r, n);
              cube.data.push_back(static_cast<std::int16_t>(std::lround(v.real() + noise(random_))));
              const double imaginary = (conjugated ? -1 : 1) * v.imag() + noise(random_);
              cube.data.push_back(static_cast<std::int16_t>(std::lround(imaginary)));
            }
          }
        }
        cubes_[pose.name].push_back(std::move(cube));
      }
      truth_.push_back(x / 32768.0);
    }
    recording.forEachFrame = [this](const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
      for (const AdcCube& cube : cubes_.at(pose.name)) visit(cube);
    };
    return recording;
  }
  void expectTruth(const ChannelData& data) const {
    ASSERT_EQ(data.poses.size(), truth_.size());
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      ReceiveGrid grid;
      grid.x = truth_[i];
      grid.full_scale = 1;
      const Eigen::MatrixXcd expected = spectraOf(grid);
      EXPECT_LT((data.poses[i].range_spectra - expected).norm(), 0.01 * expected.norm()) << i;
    }
  }
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{6};
  std::map<std::string, std::vector<AdcCube>> cubes_;
  std::vector<ComplexGrid> truth_;
};

TEST_F(ReceivedSessionTest, IsReadAsItOughtToHaveBeenDelivered) {
  const ReceivedSession session = receiveSession(record(true), true, {});
  ASSERT_EQ(session.conventions.size(), 1u);
  EXPECT_EQ(session.conventions[0].mechanism.mechanism, "iq_conjugation");
  expectTruth(session.data);
  EXPECT_TRUE(session.frames.empty());
}

TEST_F(ReceivedSessionTest, StaysAsItIsWhereNothingIsWrong) {
  const ReceivedSession session = receiveSession(record(false), true, {});
  EXPECT_TRUE(session.conventions.empty());
  expectTruth(session.data);
}

TEST_F(ReceivedSessionTest, IsNotLookedAtWhereNobodyAsks) {
  const ReceivedSession session = receiveSession(record(true), false, {});
  EXPECT_TRUE(session.conventions.empty());
  // A conjugated tone of bin r stands at N - r.
  EXPECT_LT((session.data.poses[0].range_spectra.col(44).conjugate() -
             [&] {
               ReceiveGrid grid;
               grid.x = truth_[0];
               grid.full_scale = 1;
               return Eigen::VectorXcd(spectraOf(grid).col(20));
             }())
                .norm(),
            1e-3);
}

TEST(ReadingProgress, TellsTheStageAndStopsWhereCancelled) {
  DiagnosisOptions options;
  std::vector<double> shares;
  options.on_progress = [&](const DiagnosisProgress& progress) {
    EXPECT_EQ(progress.stage, "reading");
    shares.push_back(progress.share);
  };
  const ReadingProgress progress = readingProgress(options, "reading");
  progress(1, 4);
  progress(4, 4);
  EXPECT_EQ(shares, (std::vector<double>{0.25, 1}));
  options.cancelled = [] { return true; };
  EXPECT_THROW(progress(1, 4), DiagnosisCancelled);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
