#include "diagnosis/echoes/echo_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "diagnosis/channels/echo_beam.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis {
namespace {

const std::string kEvent = "specular";
const std::vector<double> kNoErrors;
const std::vector<EchoBeam> kNoBeams;

PathRecord echoAt(const RadarConfig& radar, const PerInteraction<int>& actors, double range_m, double azimuth_rad,
                  double amplitude) {
  PathRecord r;
  r.event = &kEvent;
  r.actors = actors;
  r.bounces = std::max(1, static_cast<int>(actors.size()));
  r.departure = r.arrival = {std::cos(azimuth_rad), std::sin(azimuth_rad), 0};
  for (int k = 0; k < radar.channels(); ++k) {
    r.length_m.push_back(2 * range_m - radar.virtual_element_m(k).y() * std::sin(azimuth_rad));
  }
  setContribution(radar, amplitude, r);
  return r;
}

/// Spectra [M][N] of one path's samples, a tone's own amplitude.
Eigen::MatrixXcd spectraOf(const RadarConfig& radar, const PathRecord& record) {
  ComplexGrid x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  accumulate(radar, {record}, x);
  return SignalChain(radar).rangeSpectra(x) / (0.5 * radar.samples_per_chirp);
}

/// A packed field as the matrix that it stands for.
Eigen::MatrixXcd unpacked(const std::complex<float>* field, int channels) {
  Eigen::MatrixXcd m(channels, channels);
  for (int k = 0; k < channels; ++k) {
    for (int l = 0; l <= k; ++l) {
      m(k, l) = std::complex<double>(*field++);
      m(l, k) = std::conj(m(k, l));
    }
  }
  return m;
}

class OneEcho : public ::testing::Test {
 protected:
  std::shared_ptr<const EchoGroup> collected(const PathRecord& record, double angle_error_rad, double strongest,
                                             const std::vector<double>& errors_m = kNoErrors) const {
    EchoCollector collector(radar_, angle_error_rad, beams_, errors_m);
    return collector.addTones({&record}, strongest);
  }

  const RadarConfig radar_ = paperRadar();
  const int channels_ = radar_.channels();
  const std::size_t size_ = static_cast<std::size_t>(channels_ * (channels_ + 1) / 2);
  std::vector<EchoBeam> beams_;
};

TEST_F(OneEcho, HannResponseIsThatOfAWindowedTone) {
  // The sum over the window itself, about its middle, of many samples.
  const int samples = 4096;
  for (double offset : {0.0, 0.3, 0.5, 1.0, 1.4, 2.0, 2.6, -0.7}) {
    std::complex<double> sum = 0;
    for (int n = 0; n < samples; ++n) {
      const double w = 0.5 - 0.5 * std::cos(2 * M_PI * n / samples);
      sum += w * std::polar(1.0, 2 * M_PI * offset * (n - 0.5 * samples) / samples);
    }
    EXPECT_NEAR(hannResponse(offset), sum.real() / (0.5 * samples), 1e-6) << offset;
  }
}

TEST_F(OneEcho, FieldsAreTheOuterProductsOfItsSpectra) {
  const PathRecord record = echoAt(radar_, {0}, 3.17, 0.35, 0.02);
  const auto group = collected(record, 0, 0.02 * 0.02);
  const Eigen::MatrixXcd y = spectraOf(radar_, record);
  const int middle = static_cast<int>(std::lround(3.17 / radar_.range_bin_m()));
  const double peak = y.col(middle).squaredNorm();
  for (int bin = middle - 4; bin <= middle + 4; ++bin) {
    const Eigen::MatrixXcd want = y.col(bin) * y.col(bin).adjoint();
    // The table's response is that of many samples.
    EXPECT_LT((unpacked(group->bins.at(bin, size_)->power, channels_) - want).norm(), 5e-3 * peak) << "bin " << bin;
  }
}

// Power of each channel over that of the first, beside the echo, where the response is steep.
TEST_F(OneEcho, EachChannelHasItsOwnRange) {
  const double range_m = 3.17;
  PathRecord near = echoAt(radar_, {0}, range_m, 1.0, 0.02), apart = near;
  for (int k = channels_ / 2; k < channels_; ++k) apart.length_m[static_cast<std::size_t>(k)] += 0.1;
  for (const PathRecord& record : {near, apart}) {
    const auto group = collected(record, 0, 4e-4);
    const Eigen::MatrixXcd y = spectraOf(radar_, record);
    const int middle = static_cast<int>(std::lround(range_m / radar_.range_bin_m()));
    for (int bin : {middle - 1, middle + 1}) {
      const Eigen::MatrixXcd told = unpacked(group->bins.at(bin, size_)->power, channels_);
      double most = 0;
      for (int k = 1; k < channels_; ++k) {
        const double want = std::norm(y(k, bin) / y(0, bin));
        EXPECT_NEAR(told(k, k).real() / told(0, 0).real(), want, 5e-3 * want) << "bin " << bin << ", channel " << k;
        most = std::max(most, std::abs(want - 1));
      }
      EXPECT_GT(most, 0.05) << "channels differ";
    }
  }
}

TEST_F(OneEcho, SlopeAndCurvatureAreThoseOfALongerPath) {
  const double range_m = 3.17, step_m = 0.01;
  const auto here = collected(echoAt(radar_, {0}, range_m, 0.35, 0.02), 0, 4e-4);
  const auto power = [&](double by_m, int bin) {
    return unpacked(collected(echoAt(radar_, {0}, range_m + by_m, 0.35, 0.02), 0, 4e-4)->bins.at(bin, size_)->power,
                    channels_)
        .trace()
        .real();
  };
  const int middle = static_cast<int>(std::lround(range_m / radar_.range_bin_m()));
  const double peak = power(0, middle);
  for (int bin = middle - 2; bin <= middle + 2; ++bin) {
    const EchoGroup::Cell cell = *here->bins.at(bin, size_);
    const double slope = (power(step_m, bin) - power(-step_m, bin)) / (2 * step_m);
    EXPECT_NEAR(unpacked(cell.shift, channels_).trace().real(), slope, 0.02 * peak / radar_.range_bin_m()) << bin;
    // W'^2 of the amplitude W, whose derivative the square root of the power has.
    const double amplitude_slope = (std::sqrt(power(step_m, bin)) - std::sqrt(power(-step_m, bin))) / (2 * step_m);
    EXPECT_NEAR(unpacked(cell.curvature, channels_).trace().real(), amplitude_slope * amplitude_slope,
                0.03 * peak / std::pow(radar_.range_bin_m(), 2))
        << bin;
  }
}

TEST_F(OneEcho, AnUncertainDirectionTakesFromWhatChannelsShare) {
  const double azimuth_rad = 0.2, error_rad = 0.03;
  const PathRecord record = echoAt(radar_, {0}, 3.0, azimuth_rad, 0.02);
  const int bin = static_cast<int>(std::lround(3.0 / radar_.range_bin_m()));
  const Eigen::MatrixXcd known = unpacked(collected(record, 0, 4e-4)->bins.at(bin, size_)->power, channels_);
  const Eigen::MatrixXcd uncertain =
      unpacked(collected(record, error_rad, 4e-4)->bins.at(bin, size_)->power, channels_);
  // The mean over drawn directions, to first order in the sine.
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, error_rad * std::cos(azimuth_rad));
  Eigen::MatrixXcd mean = Eigen::MatrixXcd::Zero(channels_, channels_);
  const int draws = 40000;
  for (int i = 0; i < draws; ++i) {
    const double sine = normal(random);
    for (int k = 0; k < channels_; ++k) {
      for (int l = 0; l < channels_; ++l) {
        const double apart_m = radar_.virtual_element_m(k).y() - radar_.virtual_element_m(l).y();
        mean(k, l) += known(k, l) * std::polar(1.0 / draws, 2 * M_PI / radar_.wavelength_m() * apart_m * sine);
      }
    }
  }
  EXPECT_LT((uncertain - mean).norm(), 0.01 * known.norm());
  EXPECT_LT(std::abs(uncertain(channels_ - 1, 0)), 0.95 * std::abs(known(channels_ - 1, 0)));
  EXPECT_NEAR(uncertain(0, 0).real(), known(0, 0).real(), 1e-9);
}

TEST_F(OneEcho, BeamsHoldTheOuterProductsOfWhatTheyForm) {
  const PathRecord record = echoAt(radar_, {0}, 3.17, 0.35, 0.02), beside = echoAt(radar_, {0}, 3.3, 0.2, 0.01);
  beams_ = chooseBeams(radar_, {record}, 2);
  ASSERT_EQ(beams_.size(), 1U);
  for (const PathRecord& r : {record, beside}) {
    const auto group = collected(r, 0, 4e-4);
    const Eigen::VectorXcd formed = formBeam(beams_[0], spectraOf(radar_, r));
    const Eigen::MatrixXcd want = formed * formed.adjoint();
    EXPECT_LT((unpacked(group->beams.at(0, size_)->power, channels_) - want).norm(), 5e-3 * want.norm());
  }
}

TEST_F(OneEcho, AWeakEchoReachesItsMainLobeAloneAndAStrongOneAllBins) {
  const double strongest = 0.02 * 0.02;
  const auto cells = [&](double amplitude) {
    return collected(echoAt(radar_, {0}, 3.0, 0, amplitude), 0, strongest)->bins.cells;
  };
  EXPECT_EQ(cells(1e-4 * 0.02), 5);
  EXPECT_EQ(cells(0.03 * 0.02), 13);
  EXPECT_GE(cells(0.02), radar_.samples_per_chirp - 2);
}

TEST_F(OneEcho, TheSkirtOfANearEchoGoesOnInTheLastBins) {
  PathRecord near = echoAt(radar_, {0}, 0.3, 0, 0.02), apart = near;
  for (int k = channels_ / 2; k < channels_; ++k) apart.length_m[static_cast<std::size_t>(k)] += 0.1;
  for (const PathRecord& record : {near, apart}) {
    const auto group = collected(record, 0, 4e-4);
    const Eigen::MatrixXcd y = spectraOf(radar_, record);
    for (int bin : {radar_.samples_per_chirp - 1, radar_.samples_per_chirp - 3}) {
      const auto cell = group->bins.at(bin, size_);
      ASSERT_TRUE(cell.has_value());
      EXPECT_NEAR(cell->power[0].real() / std::norm(y(0, bin)), 1, 0.2);
    }
  }
}

TEST_F(OneEcho, KnownErrorsOfActorsStandInTheFields) {
  const std::vector<double> errors_m = {0.05, -0.02, 0.01};  // two actors, and what the scene lacks
  const PathRecord record = echoAt(radar_, {0, 1}, 3.0, 0.1, 0.02), farther = echoAt(radar_, {0, 1}, 3.03, 0.1, 0.02);
  const auto shifted = collected(record, 0, 4e-4, errors_m), moved = collected(farther, 0, 4e-4);
  EXPECT_DOUBLE_EQ(shifted->added_range_m, 0.03);
  const int bin = static_cast<int>(std::lround(3.0 / radar_.range_bin_m()));
  EXPECT_NEAR(shifted->bins.at(bin + 1, size_)->power[0].real(), moved->bins.at(bin + 1, size_)->power[0].real(),
              1e-5 * 4e-4);
}

TEST_F(OneEcho, AResponseThatTheReceiverChangedGivesItsOwnProducts) {
  beams_ = chooseBeams(radar_, {echoAt(radar_, {0}, 3.0, 0.1, 0.02)}, 2);
  std::mt19937 random(5);
  std::normal_distribution<double> normal(0, 1);
  const auto draw = [&] {
    Eigen::MatrixXcd m(channels_, radar_.samples_per_chirp);
    for (std::complex<double>& v : m.reshaped()) v = {normal(random), normal(random)};
    return m;
  };
  const Eigen::MatrixXcd y = draw(), slope = draw();
  EchoCollector collector(radar_, 0, beams_, kNoErrors);
  collector.add(echoAt(radar_, {2}, 3.0, 0.1, 0.02), y, slope);
  const auto group = collector.finishGroup();
  const auto expectProducts = [&](const EchoGroup::Cell& cell, const Eigen::VectorXcd& c, const Eigen::VectorXcd& d) {
    const double scale = c.squaredNorm() + d.squaredNorm();
    EXPECT_LT((unpacked(cell.power, channels_) - c * c.adjoint()).norm(), 1e-5 * scale);
    EXPECT_LT((unpacked(cell.shift, channels_) - c * d.adjoint() - d * c.adjoint()).norm(), 1e-5 * scale);
    EXPECT_LT((unpacked(cell.curvature, channels_) - d * d.adjoint()).norm(), 1e-5 * scale);
  };
  for (int bin : {0, 7, 40}) expectProducts(*group->bins.at(bin, size_), y.col(bin), slope.col(bin));
  expectProducts(*group->beams.at(0, size_), formBeam(beams_[0], y), formBeam(beams_[0], slope));
  EXPECT_EQ(group->actors, PerInteraction<int>{2});
}

TEST(EchoGroup, ErrorsOfWhatTheSceneLacksAreTheLast) {
  EXPECT_EQ(errorOf(0, 4), 0U);
  EXPECT_EQ(errorOf(2, 4), 2U);
  EXPECT_EQ(errorOf(-1, 4), 3U);
  EXPECT_EQ(errorOf(9, 4), 3U);  // an actor that a mechanism has added
  PathRecord bounced, direct;
  bounced.bounces = 1;
  EXPECT_EQ(actorsOf(bounced), PerInteraction<int>{-1});
  EXPECT_TRUE(actorsOf(direct).empty());
}

TEST(EchoGroup, SignaturesFollowAllThatEchoesFollowFrom) {
  const RadarConfig radar = paperRadar();
  const auto signatureOf = [](const PathRecord& r) {
    std::size_t signature = 0;
    addToSignature(r, signature);
    return signature;
  };
  const PathRecord record = echoAt(radar, {0}, 3.0, 0.1, 0.02);
  PathRecord of_another = record;
  of_another.actors = {1};
  EXPECT_EQ(signatureOf(record), signatureOf(of_another));
  EXPECT_NE(signatureOf(record), signatureOf(echoAt(radar, {0}, 3.0, 0.1, 0.021)));
  EXPECT_NE(signatureOf(record), signatureOf(echoAt(radar, {0}, 3.0001, 0.1, 0.02)));
  PathRecord turned = record;
  turned.arrival.y() += 1e-3;
  EXPECT_NE(signatureOf(record), signatureOf(turned));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
