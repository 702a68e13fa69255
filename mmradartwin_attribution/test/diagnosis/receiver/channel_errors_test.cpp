#include "diagnosis/receiver/channel_errors.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "diagnosis/channels/drawn_channels.h"

namespace mmradartwin::diagnosis {
namespace {

/// Echoes at drawn places of several poses, each from one direction, through channels with drawn errors.
class ChannelErrorsTest : public ::testing::Test {
 protected:
  ChannelData draw(const Eigen::VectorXcd& factors, int poses = 8, double noise_power = 1e-9) {
    std::uniform_real_distribution<double> sine(-0.7, 0.7), phase(-M_PI, M_PI), jitter(-0.1, 0.1);
    std::normal_distribution<double> noise(0, std::sqrt(0.5 * noise_power * 32 * 32 / 24.0));
    std::vector<ComplexGrid> grids;
    for (int i = 0; i < poses; ++i) {
      ComplexGrid x = ComplexGrid::Zero(8, 64);
      for (double range_m : {1.2, 2.4, 3.6, 4.8, 6.0}) {
        addTone(radar_, range_m + jitter(random_),
                std::polar(0.02, phase(random_)) * arrayResponse(radar_, sine(random_)), x);
      }
      x = factors.asDiagonal() * x;
      for (std::complex<double>& v : x.reshaped()) v += std::complex<double>(noise(random_), noise(random_));
      grids.push_back(x);
    }
    return sessionOf(radar_, grids, noise_power);
  }
  static Eigen::VectorXcd none() { return Eigen::VectorXcd::Ones(8); }
  /// Less the mean slope over the array, and relative to channel 0.
  static Eigen::VectorXd withoutSlope(const Eigen::VectorXd& phase) {
    const Eigen::VectorXd k = Eigen::VectorXd::LinSpaced(8, -3.5, 3.5);
    const Eigen::VectorXd rest = phase - k * (k.dot(phase) / k.squaredNorm());
    return rest.array() - rest[0];
  }
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{7};
};

TEST_F(ChannelErrorsTest, NoneOfChannelsThatHaveNone) {
  for (int i = 0; i < 5; ++i) {
    EXPECT_FALSE(findChannelErrors(draw(none())));
    EXPECT_FALSE(findChannelOrder(draw(none())));
  }
}

TEST_F(ChannelErrorsTest, TransmittersDifferByPhaseAndGain) {
  Eigen::VectorXcd factors = none();
  factors.tail(4) *= std::polar(std::pow(10.0, -1.5 / 20), 35 * M_PI / 180);
  const auto errors = findChannelErrors(draw(factors));
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->tie, ChannelTie::kTransmitters);
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(errors->phase_rad[k] * 180 / M_PI, k < 4 ? 0 : 35, 1.5) << k;
    EXPECT_NEAR(errors->gain_db[k], k < 4 ? 0 : -1.5, 0.2) << k;
  }
  EXPECT_NEAR(errors->phase_rad[7], 35 * M_PI / 180, 4 * errors->phase_error_rad[7] + 1e-3);
  EXPECT_GE(errors->groups, 8);
  EXPECT_GT(errors->held_out_gain, 8);
}

TEST_F(ChannelErrorsTest, ReceiversErrorsAreTheSameUnderAllTransmitters) {
  const double phase_deg[] = {0, 20, -15, 10}, gain_db[] = {0, 1, -1, 0.5};
  Eigen::VectorXcd factors(8);
  Eigen::VectorXd phase(8);
  for (int k = 0; k < 8; ++k) {
    phase[k] = phase_deg[k % 4] * M_PI / 180;
    factors[k] = std::polar(std::pow(10.0, gain_db[k % 4] / 20), phase[k]);
  }
  const auto errors = findChannelErrors(draw(factors));
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->tie, ChannelTie::kReceivers);
  const Eigen::VectorXd expected = withoutSlope(phase);
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(errors->phase_rad[k] * 180 / M_PI, expected[k] * 180 / M_PI, 1.5) << k;
    EXPECT_NEAR(errors->gain_db[k], gain_db[k % 4], 0.2) << k;
    EXPECT_NEAR(errors->gain_db[k], gain_db[k % 4], 4 * errors->gain_error_db[k] + 0.02) << k;
  }
  EXPECT_LT(errors->apart_rad, 0.1) << "nothing is left between transmitters";
}

TEST_F(ChannelErrorsTest, EveryChannelMayHaveItsOwnError) {
  const double phase_deg[] = {0, 25, -20, 15, -25, 5, 30, -10};
  Eigen::VectorXcd factors(8);
  Eigen::VectorXd phase(8);
  for (int k = 0; k < 8; ++k) {
    phase[k] = phase_deg[k] * M_PI / 180;
    factors[k] = std::polar(1.0, phase[k]);
  }
  const auto errors = findChannelErrors(draw(factors));
  ASSERT_TRUE(errors);
  EXPECT_EQ(errors->tie, ChannelTie::kFree);
  const Eigen::VectorXd expected = withoutSlope(phase);
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(errors->phase_rad[k] * 180 / M_PI, expected[k] * 180 / M_PI, 1.5) << k;
}

TEST_F(ChannelErrorsTest, ARaisedSlotIsNotJudged) {
  // Echoes from above turn the raised slot's channels: no error of theirs.
  Eigen::VectorXcd turned = none();
  turned.tail(4) *= std::polar(1.0, 0.6);
  ChannelData data = draw(turned);
  EXPECT_TRUE(findChannelErrors(data));
  data.radar.tx_position_m[1].z() = 0.0019467;
  data.radar.angle_slots = {0};
  EXPECT_FALSE(findChannelErrors(data));
  EXPECT_FALSE(findChannelOrder(data));
  Eigen::VectorXcd echo = arrayResponse(radar_, 0.25);
  echo.tail(4) *= -1;
  EXPECT_LT(arrayShare(radar_, echo), 0.7);
  EXPECT_NEAR(arrayShare(data.radar, echo), 1, 1e-3) << "of the slots on the line";
}

TEST_F(ChannelErrorsTest, FewOrWeakEchoesSayNothing) {
  Eigen::VectorXcd factors = none();
  factors.tail(4) *= std::polar(1.0, 0.6);
  EXPECT_TRUE(findChannelErrors(draw(factors, 4)));
  EXPECT_FALSE(findChannelErrors(draw(factors, 1, 1e-4))) << "10 dB over the noise";
}

TEST_F(ChannelErrorsTest, FindsTheOrderOfChannels) {
  // order[i] is the true channel that stands in place i: lanes 1 and 2 exchanged, and transmitters.
  const std::vector<int> order{4, 6, 5, 7, 0, 2, 1, 3};
  ChannelData data = draw(none());
  for (PoseChannels& p : data.poses) {
    const ComplexGrid whole = p.grid.x;
    for (int i = 0; i < 8; ++i) p.grid.x.row(i) = whole.row(order[static_cast<std::size_t>(i)]);
    p.range_spectra = spectraOf(p.grid);
  }
  const auto found = findChannelOrder(data);
  ASSERT_TRUE(found);
  EXPECT_GT(found->gain, 20);
  // A mirrored order fits as well; without anything that moves the one that leaves transmitters in place is told.
  std::vector<int> mirrored;
  for (int k : order) mirrored.push_back(7 - k);
  EXPECT_EQ(found->order, mirrored);
  EXPECT_LT(found->margin, 1);
  ASSERT_EQ(found->alike.size(), 2u);
  EXPECT_EQ(found->alike[0].first, mirrored);
  EXPECT_EQ(found->alike[1].first, order);
}

TEST_F(ChannelErrorsTest, WhatMovesTellsMirroredOrdersApart) {
  const std::vector<int> order{4, 6, 5, 7, 0, 2, 1, 3};
  ChannelData data = draw(none());
  std::uniform_real_distribution<double> sine(-0.7, 0.7);
  for (PoseChannels& p : data.poses) {
    const ComplexGrid whole = p.grid.x;
    for (int i = 0; i < 8; ++i) p.grid.x.row(i) = whole.row(order[static_cast<std::size_t>(i)]);
    p.range_spectra = spectraOf(p.grid);
    for (int walker = 0; walker < 3; ++walker) {
      // Transmitters take turns: the true slot of a channel decides how far the walker had gone.
      const double turn_rad = 0.8;
      const Eigen::VectorXcd response = arrayResponse(radar_, sine(random_));
      MovingCell cell;
      cell.bin = 20 + 5 * walker;
      cell.power = 1e6;
      cell.channels.resize(8);
      cell.turn_rad = turn_rad;
      for (int i = 0; i < 8; ++i) {
        const int k = order[static_cast<std::size_t>(i)];
        cell.channels[i] = response[k] * std::polar(1.0, turn_rad * (k / 4));
      }
      p.moving.push_back(cell);
    }
  }
  const auto found = findChannelOrder(data);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->order, order);
  EXPECT_GT(found->margin, 10);
  EXPECT_EQ(found->alike.size(), 1u);
}

TEST_F(ChannelErrorsTest, ArrayShareIsOneForADirectionAndFallsBesideIt) {
  EXPECT_NEAR(arrayShare(radar_, arrayResponse(radar_, 0.25)), 1, 1e-3);
  // Two directions with half of the power each, and hardly more in between.
  const Eigen::VectorXcd two = arrayResponse(radar_, 0.5) + arrayResponse(radar_, -0.5);
  EXPECT_NEAR(arrayShare(radar_, two), 0.51, 0.02);
  Eigen::VectorXcd one = Eigen::VectorXcd::Zero(8);
  one[3] = 1;
  EXPECT_NEAR(arrayShare(radar_, one), 1.0 / 8, 1e-12);
}

// Tables of Student's t.
TEST(Student95, AgreesWithTables) {
  EXPECT_NEAR(student95(1), 12.706, 1e-3);
  EXPECT_NEAR(student95(4), 2.776, 1e-3);
  EXPECT_NEAR(student95(30), 2.042, 1e-3);
}

TEST_F(ChannelErrorsTest, WidensGainsToWhatEchoesSay) {
  Eigen::VectorXcd factors = none();
  factors.tail(4) *= std::polar(std::pow(10.0, -1.5 / 20), 0.6);
  const ChannelData data = draw(factors);
  const auto errors = findChannelErrors(data);
  ASSERT_TRUE(errors);
  Hypothesis hypothesis;
  hypothesis.coordinates = {{"gain_db", "dB", 5}, {"phase_deg", "deg", 5}, {"gain_db", "dB", 6}};
  std::vector<double> standard_error{1e-6, 1e-6, 5};
  widenGains(data, hypothesis, standard_error);
  EXPECT_EQ(standard_error[0], errors->gain_error_db[5]);
  EXPECT_EQ(standard_error[1], 1e-6) << "phases stay";
  EXPECT_EQ(standard_error[2], 5) << "never narrower";
}

}  // namespace
}  // namespace mmradartwin::diagnosis
