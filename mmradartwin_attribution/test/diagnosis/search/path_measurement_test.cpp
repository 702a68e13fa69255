#include "diagnosis/search/path_measurement.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

using Kind = Observable::Kind;

std::size_t placeOf(const std::vector<Observable>& observables, Kind kind) {
  std::size_t i = 0;
  while (observables[i].kind != kind) ++i;
  return i;
}

/// A measured room whose state is that of the truth; a test then changes the channels by hand.
class MeasuredRoom : public ::testing::Test {
 protected:
  void measure() {
    room_.measure(firstOrder(), 0, 1e-8);
    fitted_.emplace(room_, firstOrder());
  }
  std::vector<MeasuredPath> pathsAt(std::size_t pose) const {
    const Twin twin = room_.twin->changed(firstOrder());
    return measurePaths(twin, fitted_->model, fitted_->null, static_cast<int>(pose), 0, observables_).paths;
  }
  double off(const MeasuredPath& path, Kind kind) const { return path.off[placeOf(observables_, kind)]; }

  MadeRoom room_{5};
  std::optional<FittedRoom> fitted_;
  const std::vector<Observable> observables_ = observables(paperRadar());
};

TEST_F(MeasuredRoom, ALevelIsMeasuredInDecibels) {
  measure();
  const double before_db = off(pathsAt(0).at(0), Kind::kGain);
  room_.data.poses[0].range_spectra *= std::pow(10.0, 4.0 / 20);
  EXPECT_NEAR(off(pathsAt(0).at(0), Kind::kGain) - before_db, 4, 1e-6);
}

TEST_F(MeasuredRoom, ADelayIsMeasuredInMetresOneWay) {
  measure();
  room_.data.poses[0].range_spectra =
      room_.spectraOf({firstOrder()[0], mechanismWith("range_bias", {{"range_m", 0.04}})}, 0);
  EXPECT_NEAR(off(pathsAt(0).at(0), Kind::kDelay), 0.04, 0.005);
}

TEST_F(MeasuredRoom, ADirectionIsMeasuredToTheLeft) {
  measure();
  // The echo of the front square ahead, turned to the left by hand.
  const RadarConfig& radar = room_.data.radar;
  const double turned_deg = 1.5;
  const std::vector<MeasuredPath> before = pathsAt(0);
  for (int k = 0; k < radar.channels(); ++k) {
    room_.data.poses[0].range_spectra.row(k) *= std::polar(
        1.0, -2 * M_PI / radar.wavelength_m() * radar.virtual_element_m(k).y() * std::sin(turned_deg * M_PI / 180));
  }
  bool ahead = false;
  const std::vector<MeasuredPath> after = pathsAt(0);
  for (std::size_t i = 0; i < std::min(before.size(), after.size()); ++i) {
    if (std::abs(after[i].record.departure.y()) > 0.05) continue;
    ahead = true;
    EXPECT_NEAR(off(after[i], Kind::kAngle) - off(before[i], Kind::kAngle), turned_deg, 0.1);
  }
  EXPECT_TRUE(ahead);
}

TEST_F(MeasuredRoom, ATransmittersChannelsAreMeasuredAgainstTheOthers) {
  measure();
  const std::complex<double> factor = std::polar(std::pow(10.0, -3.0 / 20), 20 * M_PI / 180);
  for (int k : {4, 5, 6, 7}) room_.data.poses[0].range_spectra.row(k) *= factor;  // of the second transmitter
  const std::vector<MeasuredPath> paths = pathsAt(0);
  ASSERT_FALSE(paths.empty());
  for (std::size_t i = 0; i < observables_.size(); ++i) {
    if (observables_[i].channels != std::vector<double>{4, 5, 6, 7}) continue;
    const bool of_gain = observables_[i].kind == Kind::kChannelGain;
    EXPECT_NEAR(paths[0].off[i], of_gain ? -3 : 20, of_gain ? 0.3 : 2);
  }
}

TEST_F(MeasuredRoom, WhatAPosesHeadingIsOffByIsMeasuredOnce) {
  measure();
  fitted_->null.latents.yaw_rad[0] = 0.01;
  EXPECT_NEAR(off(pathsAt(0).at(0), Kind::kAngleOfPose), -0.01 * 180 / M_PI, 1e-9);
}

TEST(Observables, BeginWithTheGainAndGroupChannelsByAntenna) {
  const std::vector<Observable> all = observables(paperRadar());
  EXPECT_EQ(all.front().kind, Kind::kGain);
  std::vector<std::vector<double>> groups;
  for (const Observable& o : all) {
    if (o.kind == Kind::kChannelGain) groups.push_back(o.channels);
  }
  // The second transmitter's, and each receiver's under both.
  EXPECT_EQ(groups, (std::vector<std::vector<double>>{{4, 5, 6, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
