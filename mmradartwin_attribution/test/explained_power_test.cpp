#include "mmradartwin_attribution/explained_power.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {
namespace {

class ExplainedPowerOfPaths : public ::testing::Test {
 protected:
  PathRecord path(double range_m, double azimuth_deg, double amplitude, double phase_rad) const {
    PathRecord record;
    const double sine = std::sin(azimuth_deg * M_PI / 180);
    const int channels = radar_.channels();
    record.length_m.assign(static_cast<std::size_t>(channels), 2 * range_m);
    const VirtualLine line = radar_.virtualLine();
    record.c.assign(static_cast<std::size_t>(channels), 0);
    for (std::size_t k = 0; k < line.channels.size(); ++k) {
      const double wave = 2 * M_PI * line.pitch_m / radar_.wavelength_m();
      record.c[static_cast<std::size_t>(line.channels[k])] =
          std::polar(amplitude, phase_rad - wave * line.places[k] * sine);
    }
    record.amplitude = amplitude;
    return record;
  }
  RangeAngleMap mapOf(const std::vector<PathRecord>& records) const {
    ReceiveGrid grid;
    grid.x = ComplexGrid::Zero(radar_.channels(), radar_.samples_per_chirp);
    accumulate(radar_, records, grid.x);
    grid.full_scale = 1;
    return chain_.map(grid);
  }

  const RadarConfig radar_ = loadRadarConfig(MMRADARTWIN_CONFIG_DIR "/radar.yaml");
  const SignalChain chain_{radar_};
  const EvaluationField field_{AttributionConfig(), radar_, chain_.axes()};
};

TEST_F(ExplainedPowerOfPaths, OnePathIsItsMap) {
  const std::vector<PathRecord> records = {path(3.07, 21, 0.01, 1)};
  const RangeAngleMap map = mapOf(records);
  const RealGrid expected = expectedPower(field_, radar_, records);
  double peak = 0;
  for (int r = 0; r < map.power_db.rows(); ++r) {
    for (int a = 0; a < map.power_db.cols(); ++a) {
      if (field_.field(r, a) == Field::kCentral) peak = std::max(peak, expected(r, a));
    }
  }
  for (int r = 0; r < map.power_db.rows(); ++r) {
    for (int a = 0; a < map.power_db.cols(); ++a) {
      if (field_.field(r, a) != Field::kCentral) continue;
      EXPECT_NEAR(std::pow(10, map.power_db(r, a) / 10), expected(r, a), 2e-3 * peak) << r << " " << a;
    }
  }
  const ExplainedPower sums = explainedPower(field_, map, map, expected);
  EXPECT_GT(sums.share(sums.amplitudeGain()), 0.999);
}

TEST_F(ExplainedPowerOfPaths, DoesNotDependOnPhasesNorOnTheGain) {
  const std::vector<PathRecord> together = {path(3, 10, 0.01, 0), path(3.05, 12, 0.01, 0)};
  const std::vector<PathRecord> against = {path(3, 10, 0.01, 0), path(3.05, 12, 0.01, M_PI)};
  EXPECT_TRUE(expectedPower(field_, radar_, together).isApprox(expectedPower(field_, radar_, against), 1e-9));
  const RangeAngleMap measured = mapOf(together);
  const RealGrid expected = expectedPower(field_, radar_, together), louder = 100 * expected;
  const ExplainedPower a = explainedPower(field_, measured, measured, expected),
                       b = explainedPower(field_, measured, measured, louder);
  EXPECT_NEAR(a.share(a.amplitudeGain()), b.share(b.amplitudeGain()), 1e-9);
}

TEST_F(ExplainedPowerOfPaths, CountsWhatIsMissing) {
  const PathRecord near = path(2, 0, 0.01, 0), far = path(5, 30, 0.01, 0);
  const RangeAngleMap measured = mapOf({near, far});
  const ExplainedPower half = explainedPower(field_, measured, measured, expectedPower(field_, radar_, {near}));
  EXPECT_NEAR(half.share(half.amplitudeGain()), 0.5, 0.05);
  const ExplainedPower nothing =
      explainedPower(field_, measured, measured, RealGrid::Zero(measured.power_db.rows(), kAngleBins));
  EXPECT_EQ(nothing.share(nothing.amplitudeGain()), 0);
  EXPECT_TRUE(std::isnan(ExplainedPower().share(1)));
}

}  // namespace
}  // namespace mmradartwin
