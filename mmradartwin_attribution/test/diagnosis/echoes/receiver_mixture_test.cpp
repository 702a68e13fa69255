#include "diagnosis/echoes/receiver_mixture.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

const std::vector<double> kNoErrors;

/// A radar that faces a corner of two cupboards at 45 degrees each, 4 m and 3 m away.
class TwoEchoes : public ::testing::Test {
 protected:
  TwoEchoes() : room_(1) {
    pose_ = room_.data.poses[0].pose;
    pose_.T_map_radar = Eigen::Isometry3d(Eigen::AngleAxisd(0.25 * M_PI, Eigen::Vector3d::UnitZ()));
    room_.twin->setStrongestAmplitude(kStrongest);
  }
  /// What `receiver` makes of the paths beside their own tones, [M][N] spectra.
  Eigen::MatrixXcd besideTones(const Twin& receiver, const Twin& linear, const std::vector<PathRecord>& paths) const {
    const ComplexGrid x = receiver.weigh(pose_.T_map_radar, paths, pose_.stamp_ns).grid.x -
                          linear.weigh(pose_.T_map_radar, paths, pose_.stamp_ns).grid.x;
    return SignalChain(room_.data.radar).rangeSpectra(x) / (0.5 * static_cast<double>(x.cols()));
  }
  /// Sum over groups of what they expect in a bin, over the channels.
  double powerIn(const std::vector<std::shared_ptr<const EchoGroup>>& groups, int bin) const {
    const int channels = room_.data.radar.channels();
    double sum = 0;
    for (const auto& group : groups) {
      const auto cell = group->bins.at(bin, static_cast<std::size_t>(channels * (channels + 1) / 2));
      for (int k = 0; cell && k < channels; ++k) sum += cell->power[k * (k + 3) / 2].real();
    }
    return sum;
  }
  std::vector<std::shared_ptr<const EchoGroup>> mixed(const Twin& twin, const Twin& linear, std::size_t receiver,
                                                      std::size_t call) {
    EchoCollector collector(room_.data.radar, 0, beams_, kNoErrors);
    ReceiverMixture mixture(twin, linear, receiver, pose_, cache_, call);
    std::vector<PathRecord> paths = linear.trace(pose_.T_map_radar);
    mixture.scaleTones(paths, collector);
    tones_ = paths;
    mixture.addTo(collector);
    return collector.take();
  }

  static constexpr double kStrongest = 1e-4;
  MadeRoom room_;
  Pose pose_;
  std::vector<EchoBeam> beams_;
  ReceiverMixture::Cache cache_;
  std::vector<PathRecord> tones_;
};

TEST_F(TwoEchoes, OfASquareLawStandAtTwiceTheirRangesAndAtTheSum) {
  std::vector<NamedParameters> mechanisms = firstOrder();
  const Twin linear = room_.twin->changed(mechanisms);
  mechanisms.push_back(mechanismWith("second_harmonic", {{"level_db", -15.0}}));
  const Twin twin = room_.twin->changed(mechanisms);
  const auto groups = mixed(twin, linear, 1, 1);
  ASSERT_EQ(groups.size(), 3U);
  const Eigen::MatrixXcd want = besideTones(twin, linear, linear.trace(pose_.T_map_radar));
  for (double range_m : {6.0, 7.0, 8.0}) {
    const int bin = static_cast<int>(std::lround(range_m / room_.data.radar.range_bin_m()));
    EXPECT_NEAR(powerIn(groups, bin) / want.col(bin).squaredNorm(), 1, 0.05) << range_m << " m";
  }
  // Products have the errors of the actors of both paths.
  for (const auto& group : groups) EXPECT_EQ(group->actors.size(), 2U);
}

TEST_F(TwoEchoes, OfAMixerWithAnImageStandInTheMirroredBins) {
  std::vector<NamedParameters> mechanisms = firstOrder();
  const Twin linear = room_.twin->changed(mechanisms);
  mechanisms.push_back(mechanismWith("iq_imbalance", {{"image_db", -12.0}}));
  const Twin twin = room_.twin->changed(mechanisms);
  const auto groups = mixed(twin, linear, 2, 1);
  const Eigen::MatrixXcd want = besideTones(twin, linear, linear.trace(pose_.T_map_radar));
  for (double range_m : {3.0, 4.0}) {
    const int mirrored =
        room_.data.radar.samples_per_chirp - static_cast<int>(std::lround(range_m / room_.data.radar.range_bin_m()));
    EXPECT_NEAR(powerIn(groups, mirrored) / want.col(mirrored).squaredNorm(), 1, 0.05) << range_m << " m";
  }
}

TEST_F(TwoEchoes, OfALinearReceiverAreTheirTonesAlone) {
  const Twin linear = room_.twin->changed(firstOrder());
  const auto groups = mixed(linear, linear, 3, 1);
  EXPECT_TRUE(groups.empty());
  std::vector<PathRecord> traced = linear.trace(pose_.T_map_radar);
  double before = 0, after = 0;
  for (const PathRecord& r : traced) before += r.amplitude * r.amplitude;
  for (const PathRecord& r : tones_) after += r.amplitude * r.amplitude;
  EXPECT_NEAR(after / before, 1, 1e-9);
}

TEST_F(TwoEchoes, AreCollectedOnceForEachReceiver) {
  std::vector<NamedParameters> mechanisms = firstOrder();
  const Twin linear = room_.twin->changed(mechanisms);
  mechanisms.push_back(mechanismWith("second_harmonic", {{"level_db", -15.0}}));
  const Twin twin = room_.twin->changed(mechanisms);
  const auto first = mixed(twin, linear, 1, 1), again = mixed(twin, linear, 1, 2);
  ASSERT_EQ(again.size(), first.size());
  for (const auto& group : again) EXPECT_EQ(std::count(first.begin(), first.end(), group), 1);
  for (const auto& group : mixed(twin, linear, 9, 3)) EXPECT_EQ(std::count(first.begin(), first.end(), group), 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
