#include "diagnosis/search/hiding_places.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

/// Radar at many places; echoes of the east front are taken out by hand where their way passes y = 0 within 0.3 m.
class ShadedRoom : public ::testing::Test {
 protected:
  static constexpr double kHalf_m = 0.3;

  /// Number of poses whose echo is hidden.
  int measure(bool shaded) {
    room_.measure(firstOrder());
    int hidden = 0;
    const Twin twin = room_.twin->changed(firstOrder());
    const RadarConfig& radar = room_.data.radar;
    for (PoseChannels& p : room_.data.poses) {
      ComplexGrid x = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
      std::vector<PathRecord> gone;
      for (PathRecord& r : twin.trace(p.pose.T_map_radar, p.pose.stamp_ns)) {
        const bool east = r.vertices.size() == 1 && std::abs(r.vertices[0].x() - 4) < 1e-6;
        if (shaded && east && std::abs(r.vertices[0].y()) < kHalf_m) gone.push_back(std::move(r));
      }
      hidden += gone.empty() ? 0 : 1;
      accumulate(radar, gone, x);
      p.range_spectra -= SignalChain(radar).rangeSpectra(x) / (0.5 * radar.samples_per_chirp);
    }
    return hidden;
  }
  std::vector<HidingPlace> places() {
    const FittedRoom fitted(room_, firstOrder());
    const Twin twin = room_.twin->changed(firstOrder());
    std::vector<MeasuredPose> measured;
    for (const int pose : fitted.everyPose()) {
      measured.push_back(measurePaths(twin, fitted.model, fitted.null, pose, 0, observables(room_.data.radar)));
    }
    return hidingPlaces(twin.scene(), fitted.model, fitted.null, fitted.everyPose(), measured);
  }

  MadeRoom room_{24};
};

TEST_F(ShadedRoom, ThePlaceLiesBeforeTheEchoesThatAreNotThere) {
  ASSERT_GE(measure(true), 3);
  const std::vector<HidingPlace> found = places();
  ASSERT_FALSE(found.empty());
  EXPECT_GT(found[0].screened_nats, 8);
  EXPECT_LT(std::abs(found[0].y_m), kHalf_m);
  EXPECT_GT(found[0].x_m, 0);
}

TEST_F(ShadedRoom, ThereIsNoneWhereAllEchoesAreSeen) {
  ASSERT_EQ(measure(false), 0);
  for (const HidingPlace& place : places()) EXPECT_LT(place.screened_nats, 1);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
