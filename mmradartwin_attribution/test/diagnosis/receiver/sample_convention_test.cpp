#include "diagnosis/receiver/sample_convention.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/drawn_channels.h"
#include "diagnosis/receiver/cabinet_room.h"
#include "diagnosis/receiver/receiver_findings.h"

namespace mmradartwin::diagnosis {
namespace {

const std::vector<double> kOrder{4, 6, 5, 7, 0, 2, 1, 3};  // order[i] is the true channel that stands in place i

SampleConvention convention(const std::string& name, const std::vector<double>& order = {}) {
  SampleConvention c{{name, {}}, 0, {}};
  if (!order.empty()) c.mechanism.values.set("order", order);
  return c;
}

class SampleConventionTest : public ::testing::Test {
 protected:
  /// Echoes from everywhere and what leaks from transmitters into receivers.
  ChannelData draw(int poses = 8) {
    std::uniform_real_distribution<double> sine(-0.7, 0.7), phase(-M_PI, M_PI), range_m(0.6, 6);
    Eigen::VectorXcd leakage(8);
    for (int k = 0; k < 8; ++k) leakage[k] = std::polar(0.01, 1.9 * k * k);
    std::vector<ComplexGrid> grids;
    for (int i = 0; i < poses; ++i) {
      ComplexGrid x = ComplexGrid::Zero(8, 64);
      for (int e = 0; e < 6; ++e) {
        addTone(radar_, range_m(random_), std::polar(0.02, phase(random_)) * arrayResponse(radar_, sine(random_)), x);
      }
      addTone(radar_, 0.07, leakage, x);
      for (std::complex<double>& v : x.reshaped()) v += std::polar(1e-5, phase(random_));
      grids.push_back(x);
    }
    return sessionOf(radar_, grids, 1e-9);  // skirts of echoes are below the least power of an echo
  }
  static void deliver(ChannelData& data, const std::function<ComplexGrid(const ComplexGrid&)>& how) {
    for (PoseChannels& p : data.poses) {
      p.grid.x = how(p.grid.x);
      p.range_spectra = spectraOf(p.grid);
    }
  }
  static ComplexGrid permuted(const ComplexGrid& x) {
    ComplexGrid y(x.rows(), x.cols());
    for (std::size_t i = 0; i < 8; ++i) {
      y.row(static_cast<Eigen::Index>(i)) = x.row(static_cast<Eigen::Index>(kOrder[i]));
    }
    return y;
  }
  RadarConfig radar_ = paperRadar();
  std::mt19937_64 random_{11};
};

TEST_F(SampleConventionTest, EachIsUndoneInAllPoses) {
  const ChannelData truth = draw(2);
  const auto expectTruth = [&](const ChannelData& data) {
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LT((data.poses[i].grid.x - truth.poses[i].grid.x).norm(), 1e-12);
      EXPECT_LT((data.poses[i].range_spectra - truth.poses[i].range_spectra).norm(), 1e-9) << "spectra follow";
    }
  };
  ChannelData conjugated = truth;
  deliver(conjugated, [](const ComplexGrid& x) { return ComplexGrid(x.conjugate()); });
  undoSampleConvention(convention("iq_conjugation"), conjugated);
  expectTruth(conjugated);
  ChannelData exchanged = truth;
  deliver(exchanged, permuted);
  undoSampleConvention(convention("channel_permutation", kOrder), exchanged);
  expectTruth(exchanged);
  // Conjugated channels: directions are mirrored, ranges stay: x(-n)*, modulo N.
  ChannelData mirrored = truth;
  deliver(mirrored, [](const ComplexGrid& x) {
    ComplexGrid y(x.rows(), x.cols());
    for (int n = 0; n < 64; ++n) y.col(n) = x.col((64 - n) % 64).conjugate();
    return y;
  });
  undoSampleConvention(convention("channel_conjugation"), mirrored);
  expectTruth(mirrored);
}

TEST_F(SampleConventionTest, MovingCellsAreUndoneToo) {
  ChannelData data = draw(1);
  MovingCell cell;
  cell.bin = 10;
  cell.turn_rad = 0.4;
  cell.channels = Eigen::VectorXcd::LinSpaced(8, 1, 8) * std::polar(1.0, 0.3);
  data.poses[0].moving = {cell};
  ChannelData conjugated = data;
  undoSampleConvention(convention("iq_conjugation"), conjugated);
  EXPECT_EQ(conjugated.poses[0].moving[0].bin, 54);
  EXPECT_EQ(conjugated.poses[0].moving[0].turn_rad, -0.4);
  EXPECT_EQ(conjugated.poses[0].moving[0].channels[2], std::conj(cell.channels[2]));
  undoSampleConvention(convention("channel_permutation", kOrder), data);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(data.poses[0].moving[0].channels[static_cast<Eigen::Index>(kOrder[i])],
              cell.channels[static_cast<Eigen::Index>(i)]);
  }
}

TEST_F(SampleConventionTest, FramesAreUndoneSampleBySample) {
  AdcCube frame;
  frame.chirps = 2;
  frame.samples = 64;
  frame.receivers = 4;
  frame.chirp_valid = {1, 0};
  const auto place = [](int channel, int n, int part) {
    return static_cast<std::size_t>(((channel / 4 * 64 + n) * 4 + channel % 4) * 2 + part);
  };
  frame.data.resize(2 * 64 * 4 * 2);
  for (int k = 0; k < 8; ++k) {
    for (int n = 0; n < 64; ++n) {
      frame.data[place(k, n, 0)] = static_cast<std::int16_t>(100 * k + n);
      frame.data[place(k, n, 1)] = static_cast<std::int16_t>(-1000 - 100 * k - n);
    }
  }
  AdcCube conjugated = frame;
  conjugated.data[1] = INT16_MIN;
  undoSampleConvention(convention("iq_conjugation"), radar_, conjugated);
  EXPECT_EQ(conjugated.data[place(3, 7, 0)], 307);
  EXPECT_EQ(conjugated.data[place(3, 7, 1)], 1307);
  EXPECT_EQ(conjugated.data[1], INT16_MAX) << "no int16 is the negative of the least one";
  AdcCube exchanged = frame;
  undoSampleConvention(convention("channel_permutation", kOrder), radar_, exchanged);
  for (int i = 0; i < 8; ++i) {
    const int k = static_cast<int>(kOrder[static_cast<std::size_t>(i)]);
    EXPECT_EQ(exchanged.data[place(k, 9, 0)], 100 * i + 9);
    EXPECT_EQ(exchanged.data[place(k, 9, 1)], -1000 - 100 * i - 9);
  }
  EXPECT_EQ(exchanged.chirp_valid, (std::vector<std::uint8_t>{0, 1})) << "a lost chirp goes with its transmitter";
  AdcCube reversed = frame;
  undoSampleConvention(convention("channel_conjugation"), radar_, reversed);
  EXPECT_EQ(reversed.data[place(7, 9, 0)], 9) << "as the reversed order";
}

TEST_F(SampleConventionTest, LeakageAndEchoesTellItWithoutAScene) {
  EXPECT_TRUE(findSampleConventionByEchoes(draw()).empty());
  ChannelData conjugated = draw();
  deliver(conjugated, [](const ComplexGrid& x) { return ComplexGrid(x.conjugate()); });
  const auto first = findSampleConventionByEchoes(conjugated);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].mechanism.mechanism, "iq_conjugation");
  EXPECT_GT(first[0].gain, 12);
  ChannelData exchanged = draw();
  deliver(exchanged, permuted);
  const auto second = findSampleConventionByEchoes(exchanged);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].mechanism.mechanism, "channel_permutation");
  std::vector<double> mirrored;
  for (double k : kOrder) mirrored.push_back(7 - k);
  EXPECT_EQ(second[0].mechanism.values.numbers("order"), mirrored) << "of mirrored orders, that of lanes alone";
  const Finding finding = findingOf(second[0], radar_);
  ASSERT_EQ(finding.candidates.size(), 2u) << "the mirrored order is as likely";
  for (const CauseProbability& candidate : finding.candidates) {
    EXPECT_EQ(candidate.cause, "channel_permutation");
    EXPECT_NEAR(candidate.probability, 0.5, 0.01);
  }
  EXPECT_EQ(std::get<std::vector<double>>(finding.candidates[0].parameters.at(0).value), mirrored);
  EXPECT_EQ(std::get<std::vector<double>>(finding.candidates[1].parameters.at(0).value), kOrder);
  EXPECT_TRUE(finding.experiment);
  ChannelData both = draw();
  deliver(both, [](const ComplexGrid& x) { return permuted(x.conjugate()); });
  const auto third = findSampleConventionByEchoes(both);
  ASSERT_EQ(third.size(), 2u);
  EXPECT_EQ(third[0].mechanism.mechanism, "iq_conjugation") << "in the order in which they are undone";
}

/// Poses before the cabinet, as the twin has it, with noise.
class SampleConventionOfATwin : public SampleConventionTest {
 protected:
  ChannelData measure() {
    std::vector<ComplexGrid> grids;
    std::vector<Eigen::Isometry3d> places;
    std::normal_distribution<double> noise(0, 1e-5);
    for (int i = 0; i < 6; ++i) {
      places.push_back(Eigen::Translation3d(0.2 * i, 0.15 * i - 0.4, 0) *
                       Eigen::AngleAxisd(0.1 * i - 0.2, Eigen::Vector3d::UnitZ()));
      ComplexGrid x = twin_.simulate(places.back()).grid.x;
      for (std::complex<double>& v : x.reshaped()) v += std::complex<double>(noise(random_), noise(random_));
      grids.push_back(x);
    }
    ChannelData data = sessionOf(radar_, grids, 2e-10 * 24 / (32 * 32));
    for (std::size_t i = 0; i < places.size(); ++i) {
      PoseChannels& p = data.poses[i];
      p.pose.T_map_radar = places[i];
      p.clutter.bins = 64;  // alike in all bins and directions
      p.clutter.packed.assign(64 * 36, {});
      for (int b = 0; b < 64; ++b) {
        for (int k = 0; k < 8; ++k) p.clutter.at(b, 36)[k * (k + 3) / 2] = 1;
      }
    }
    return data;
  }
  CabinetRoom room_;
  Twin twin_{loadTwin("", room_.sceneFile(), radar_)};
};

TEST_F(SampleConventionOfATwin, IsTheOneThatFitsTheRoom) {
  EXPECT_FALSE(findSampleConvention(twin_, measure()));
  ChannelData conjugated = measure();
  deliver(conjugated, [](const ComplexGrid& x) { return ComplexGrid(x.conjugate()); });
  const auto first = findSampleConvention(twin_, conjugated);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->mechanism.mechanism, "iq_conjugation");
  ChannelData exchanged = measure();
  deliver(exchanged, permuted);
  const auto second = findSampleConvention(twin_, exchanged);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->mechanism.mechanism, "channel_permutation");
  EXPECT_EQ(second->mechanism.values.numbers("order"), kOrder);
  EXPECT_GT(second->gain, 2 * 6);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
