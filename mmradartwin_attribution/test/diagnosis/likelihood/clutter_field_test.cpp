#include "diagnosis/likelihood/clutter_field.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>

#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kWidth_m = 8, kDepth_m = 5;

/// A room without anything in it but its bounds, and radars that look along x.
class EmptyRoom : public ::testing::Test {
 protected:
  void SetUp() override {
    data_.radar = paperRadar();
    Actor walls;
    walls.bounds =
        Eigen::AlignedBox3d(Eigen::Vector3d(0, -0.5 * kDepth_m, -2), Eigen::Vector3d(kWidth_m, 0.5 * kDepth_m, 2));
    scene_.actors.push_back(walls);
    for (double x : {0.0, 1.0})
      data_.poses.emplace_back().pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(x, 0, 0));
    expectClutter(scene_, data_);
  }
  Eigen::MatrixXcd field(std::size_t pose, int bin) const {
    const int channels = data_.radar.channels();
    const std::complex<float>* packed =
        data_.poses[pose].clutter.at(bin, static_cast<std::size_t>(channels * (channels + 1) / 2));
    Eigen::MatrixXcd m(channels, channels);
    for (int k = 0; k < channels; ++k) {
      for (int l = 0; l <= k; ++l) {
        m(k, l) = std::complex<double>(*packed++);
        m(l, k) = std::conj(m(k, l));
      }
    }
    return m;
  }
  /// Power in a cell that comes from nowhere in particular.
  double elsewhere(int bin) const { return 0.05 * std::pow(std::max(0.3, bin * data_.radar.range_bin_m()) / 3, -3); }

  ChannelData data_;
  Scene scene_;
};

TEST_F(EmptyRoom, MeanPowerAtThreeMetresIsOne) {
  double sum = 0;
  int count = 0;
  for (int bin = 0; bin < data_.radar.samples_per_chirp; ++bin) {
    if (std::abs(bin * data_.radar.range_bin_m() - 3) > 0.5) continue;
    for (std::size_t pose : {0U, 1U}) sum += field(pose, bin)(0, 0).real() - elsewhere(bin);
    count += 2;
  }
  EXPECT_NEAR(sum / count, 1, 1e-4);
}

TEST_F(EmptyRoom, IsTheCovarianceOfThingsThatLieAnywhere) {
  // Drawn things at the heights that the field has, each with power by r^-4 in the bins of its response.
  std::mt19937 random(4);
  std::uniform_real_distribution<double> along(0, kWidth_m), across(-0.5 * kDepth_m, 0.5 * kDepth_m);
  const RadarConfig& radar = data_.radar;
  const int channels = radar.channels(), near = 18, far = 45;
  Eigen::MatrixXcd drawn_near = Eigen::MatrixXcd::Zero(channels, channels), drawn_far = drawn_near;
  const double heights_m[] = {-0.6, 0, 0.6};
  for (int i = 0; i < 600000; ++i) {
    const Eigen::Vector3d p(along(random), across(random), heights_m[i % 3]);
    const double r = p.norm(), place = r / radar.range_bin_m();
    if (r < 0.3 || p.x() <= 0 || std::abs(p.z()) > std::sin(20 * M_PI / 180) * r) continue;
    for (int bin : {near, far}) {
      const double d = std::abs(bin - place);
      if (d > 2) continue;
      const double w = d < 1e-9 ? 1 : std::abs(d - 1) < 1e-9 ? 0.5 : std::sin(M_PI * d) / (M_PI * d * (1 - d * d));
      Eigen::VectorXcd v(channels);
      for (int k = 0; k < channels; ++k) {
        v[k] = std::polar(w * std::pow(r, -2),
                          -2 * M_PI / radar.wavelength_m() * radar.virtual_element_m(k).y() * p.y() / r);
      }
      (bin == near ? drawn_near : drawn_far) += v * v.adjoint();
    }
  }
  const auto inRoom = [&](int bin) -> Eigen::MatrixXcd {
    return field(0, bin) - elsewhere(bin) * Eigen::MatrixXcd::Identity(channels, channels);
  };
  EXPECT_NEAR(inRoom(near)(0, 0).real() / inRoom(far)(0, 0).real(), drawn_near(0, 0).real() / drawn_far(0, 0).real(),
              0.1 * drawn_near(0, 0).real() / drawn_far(0, 0).real());
  EXPECT_LT((inRoom(near) / inRoom(near)(0, 0).real() - drawn_near / drawn_near(0, 0).real()).norm(), 0.1 * channels);
}

TEST_F(EmptyRoom, NoBinIsLeftWithout) {
  const int channels = data_.radar.channels(), last = data_.radar.samples_per_chirp - 1;
  ASSERT_GT((last - 3) * data_.radar.range_bin_m(), std::hypot(kWidth_m, 0.5 * kDepth_m) + 0.7);
  EXPECT_LT((field(0, last) - elsewhere(last) * Eigen::MatrixXcd::Identity(channels, channels)).norm(),
            1e-6 * elsewhere(last));
  for (int bin = 0; bin <= last; ++bin) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> solver(field(1, bin));
    EXPECT_GT(solver.eigenvalues().minCoeff(), 0) << "bin " << bin;
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
