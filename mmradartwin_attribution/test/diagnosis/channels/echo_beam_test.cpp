#include "diagnosis/channels/echo_beam.h"

#include <gtest/gtest.h>

#include "diagnosis/channels/drawn_channels.h"

namespace mmradartwin::diagnosis {
namespace {

class EchoBeamTest : public ::testing::Test {
 protected:
  PathRecord path(double range_m, double sine, double amplitude) const {
    PathRecord r;
    r.amplitude = amplitude;
    const Eigen::VectorXcd response = arrayResponse(radar_, sine);
    for (int k = 0; k < radar_.channels(); ++k) {
      r.length_m.push_back(2 * range_m);
      r.c.push_back(amplitude * response[k]);
    }
    return r;
  }
  Eigen::MatrixXcd spectra(const std::vector<DrawnTone>& tones) const {
    ReceiveGrid grid;
    grid.x = gridOf(radar_, tones);
    grid.full_scale = 1;
    return spectraOf(grid);
  }
  RadarConfig radar_ = paperRadar();
};

TEST_F(EchoBeamTest, LooksAtTheStrongestPathFirst) {
  const auto beams = chooseBeams(radar_, {path(2.0, 0.1, 0.01), path(4.0, -0.4, 0.05)}, 2);
  ASSERT_EQ(beams.size(), 2u);
  // Eight bins about the path's own.
  const double bin = 4.0 / radar_.range_bin_m();
  EXPECT_NEAR(middleBin(beams[0], 8), bin, 1.5);
  EXPECT_NEAR(beams[0].weights.norm(), 1, 1e-12);
  EXPECT_EQ(beams[0].weights.size(), 8);
  EXPECT_EQ(beams[0].y.size(), 0);
  const Eigen::VectorXcd response = arrayResponse(radar_, -0.4);
  for (int k = 1; k < 8; ++k) {
    const std::complex<double> turn = beams[0].weights[k] / response[k];
    EXPECT_NEAR(std::arg(turn * response[0] / beams[0].weights[0]), 0, 1e-9);
  }
}

TEST_F(EchoBeamTest, TakesNoPathBesideAnother) {
  // The same place from another direction is another beam; the same direction a bin further is not.
  const double step_m = radar_.range_bin_m();
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(3 + step_m, 0.02, 0.9)}, 2).size(), 1u);
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(3, 0.6, 0.9)}, 2).size(), 2u);
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(3 + 2 * step_m, 0, 0.9)}, 2).size(), 2u);
}

TEST_F(EchoBeamTest, LeavesOutWeakPathsAndThoseBeyondTheBins) {
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(5, 0.5, 0.03)}, 2).size(), 1u) << "30 dB below";
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(0.1, 0.5, 1)}, 2).size(), 1u) << "before the first bin";
  EXPECT_EQ(chooseBeams(radar_, {path(3, 0, 1), path(40, 0.5, 1)}, 2).size(), 1u) << "beyond the last";
  std::vector<PathRecord> many;
  for (int i = 0; i < 14; ++i) many.push_back(path(1 + 0.5 * i, 0, 1));
  const auto beams = chooseBeams(radar_, many, 2);
  EXPECT_EQ(beams.size(), 10u);
  for (const EchoBeam& b : beams) {
    EXPECT_GE(b.first_bin, 2);
    EXPECT_LE(b.first_bin + 8, 64);
  }
  EXPECT_TRUE(chooseBeams(radar_, {}, 2).empty());
  radar_.rx_position_m.resize(1);  // two channels
  EXPECT_TRUE(chooseBeams(radar_, {path(3, 0, 1)}, 2).empty());
}

TEST_F(EchoBeamTest, TonesOfOneEchoHaveOnePhaseInAllBins) {
  for (double range_m : {3.0, 3.05, 3.11}) {
    const std::complex<double> amplitude = std::polar(0.02, 1.1);
    auto beam = chooseBeams(radar_, {path(range_m, 0.3, 0.02)}, 2).front();
    const Eigen::VectorXcd formed = formBeam(beam, spectra({{range_m, 0.3, amplitude}}));
    ASSERT_EQ(formed.size(), 8);
    Eigen::Index strongest = 0;
    const double peak = formed.cwiseAbs().maxCoeff(&strongest);
    for (Eigen::Index i = 0; i < 8; ++i) {
      const std::complex<double> ratio = formed[i] / formed[strongest];
      if (std::abs(formed[i]) > 0.01 * peak) {
        EXPECT_NEAR(ratio.imag(), 0, 1e-9) << i;
      }
    }
  }
}

TEST_F(EchoBeamTest, BeamHoldsItsEchoAndKeepsOtherDirectionsOut) {
  const int bin = 30;
  const double range_m = bin * radar_.range_bin_m();
  const EchoBeam beam = chooseBeams(radar_, {path(range_m, 0.3, 1)}, 2).front();
  const int middle = bin - beam.first_bin;
  const double own = std::abs(formBeam(beam, spectra({{range_m, 0.3, 0.02}}))[middle]);
  // The sum of the tapered weights.
  EXPECT_NEAR(own, 0.02 * beam.weights.cwiseAbs().sum(), 1e-9);
  const double other = std::abs(formBeam(beam, spectra({{range_m, -0.5, 0.02}}))[middle]);
  EXPECT_LT(other, 0.02 * own);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
