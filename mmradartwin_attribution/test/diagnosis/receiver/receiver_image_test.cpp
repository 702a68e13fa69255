#include "diagnosis/receiver/receiver_image.h"

#include <gtest/gtest.h>

#include <random>

#include "diagnosis/channels/drawn_channels.h"

namespace mmradartwin::diagnosis {
namespace {

class ReceiverImageTest : public ::testing::Test {
 protected:
  /// x + beta conj(x): strong echoes near, weak ones where images fall.
  ChannelData draw(int poses, std::complex<double> beta, double weak = 1e-6) {
    return draw(poses, Eigen::Vector4cd::Constant(beta), weak);
  }
  ChannelData draw(int poses, const Eigen::Vector4cd& beta, double weak = 1e-6) {
    std::uniform_real_distribution<double> sine(-0.7, 0.7), phase(-M_PI, M_PI);
    std::vector<ComplexGrid> grids;
    for (int i = 0; i < poses; ++i) {
      std::vector<DrawnTone> tones;
      for (double range_m : {0.6, 1.3, 2.1, 2.9}) {
        tones.push_back({range_m, sine(random_), std::polar(0.02, phase(random_))});
        tones.push_back({radar_.max_range_m() - range_m, sine(random_), std::polar(weak, phase(random_))});
      }
      const ComplexGrid x = gridOf(radar_, tones);
      ComplexGrid with = x;
      for (int k = 0; k < 8; ++k) with.row(k) += beta[k % 4] * x.row(k).conjugate();
      grids.push_back(with);
    }
    return sessionOf(radar_, grids, 1e-12);
  }
  static Finding imbalance() {
    Finding f;
    f.cause = "iq_imbalance";
    f.mechanism = NamedParameters{"iq_imbalance", {}};
    f.mechanism->values.set("image_db", -40.0);
    f.mechanism->values.set("phase_deg", 0.0);
    f.parameters = {{"image_db", "dB", -40.0, {{-41.0, -39.0}}}};
    return f;
  }
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{2};
};

TEST_F(ReceiverImageTest, HasItsLevelAndPhase) {
  for (double image_db : {-30.0, -22.0}) {
    Finding f = imbalance();
    ASSERT_TRUE(measureImage(draw(6, std::polar(std::pow(10.0, image_db / 20), 1.9)), f));
    EXPECT_NEAR(f.mechanism->values.number("image_db"), image_db, 0.1);
    EXPECT_NEAR(f.mechanism->values.number("phase_deg"), 1.9 * 180 / M_PI, 1);
    EXPECT_NEAR(std::get<double>(f.parameters[0].value), image_db, 0.1);
    EXPECT_LT(f.parameters[0].ci95[0][0], image_db);
    EXPECT_GT(f.parameters[0].ci95[0][1], image_db);
  }
}

TEST_F(ReceiverImageTest, IsToldReceiverByReceiverWhereTheyDiffer) {
  const double level_db[] = {-36.5, -34.7, -28.5, -37.7}, phase_rad[] = {0.2, -1.4, 2.8, 1};
  Eigen::Vector4cd beta;
  for (int r = 0; r < 4; ++r) beta[r] = std::polar(std::pow(10.0, level_db[r] / 20), phase_rad[r]);
  Finding f = imbalance();
  const ChannelData with = draw(8, beta, 1e-5);
  ASSERT_TRUE(measureImage(with, f));
  ASSERT_EQ(f.parameters.size(), 2u);
  const FindingParameter &level = *f.parameter("image_db"), &phase = *f.parameter("phase_deg");
  for (std::size_t r = 0; r < 4; ++r) {
    EXPECT_NEAR(std::get<std::vector<double>>(level.value)[r], level_db[r], 0.3);
    EXPECT_LE(level.ci95[r][0], level_db[r]);
    EXPECT_GE(level.ci95[r][1], level_db[r]);
    EXPECT_NEAR(std::get<std::vector<double>>(phase.value)[r], phase_rad[r] * 180 / M_PI, 2);
  }
  ChannelData rest = with;
  subtractImage(*f.mechanism, rest);
  EXPECT_FALSE(readImage(draw(8, std::polar(0.03, 1.0), 1e-5))->differ);
  EXPECT_LT(readImage(rest)->beta.norm(), 0.05 * beta.norm());
}

TEST_F(ReceiverImageTest, EchoesAtTheMirroredPlaceWidenItsError) {
  const std::complex<double> beta = std::polar(std::pow(10.0, -26.0 / 20), -0.6);
  Finding clean = imbalance(), disturbed = imbalance();
  ASSERT_TRUE(measureImage(draw(8, beta), clean));
  ASSERT_TRUE(measureImage(draw(8, beta, 2e-4), disturbed));
  const auto width = [](const Finding& f) { return f.parameters[0].ci95[0][1] - f.parameters[0].ci95[0][0]; };
  EXPECT_GT(width(disturbed), 2 * width(clean));
  EXPECT_LT(std::abs(disturbed.mechanism->values.number("image_db") + 26), width(disturbed));
}

TEST_F(ReceiverImageTest, SaysNothingOfFewLocations) {
  Finding f = imbalance();
  EXPECT_FALSE(measureImage(draw(2, 0.05), f));
  EXPECT_EQ(f.mechanism->values.number("image_db"), -40.0);
}

TEST_F(ReceiverImageTest, IsTakenOutOfTheData) {
  const std::complex<double> beta = std::polar(std::pow(10.0, -30.0 / 20), 0.8);
  ChannelData with = draw(3, beta);
  random_.seed(2);
  const ChannelData without = draw(3, 0);
  NamedParameters stated = *imbalance().mechanism;
  stated.values.set("image_db", -30.0);
  stated.values.set("phase_deg", 0.8 * 180 / M_PI);
  subtractImage(stated, with);
  for (std::size_t i = 0; i < 3; ++i) {
    // The image's own image is left: beta squared.
    EXPECT_LT((with.poses[i].range_spectra - without.poses[i].range_spectra).norm(),
              1.1 * std::norm(beta) * without.poses[i].range_spectra.norm());
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
