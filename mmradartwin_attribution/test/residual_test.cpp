#include "mmradartwin_attribution/residual.h"

#include <gtest/gtest.h>

#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;
using synthetic::Target;

class ResidualTest : public ::testing::Test {
 protected:
  RadarConfig radar_ = paperRadar();
  SignalChain chain_{radar_};
  EvaluationField field_{AttributionConfig(), radar_, chain_.axes()};
  const Target anchor_{3.0, 0, 0};  // in both branches, at a region: what the others are relative to

  static ResponseRegion region(const std::string& actor, double range_m, double azimuth_deg) {
    ResponseRegion r;
    r.actor = actor;
    r.material = "Wood";
    r.range_m = range_m;
    r.azimuth_rad = azimuth_deg * kDegree;
    return r;
  }

  PoseAttribution compare(std::vector<Target> measured, std::vector<Target> simulated,
                          std::vector<ResponseRegion> regions) {
    measured.push_back(anchor_);
    simulated.push_back(anchor_);
    regions.push_back(region("anchor", anchor_.range_m, anchor_.azimuth_deg));
    return attributePose(field_, synthetic::map(radar_, measured), synthetic::map(radar_, simulated), regions, {});
  }

  // The only residual.
  static Residual only(const PoseAttribution& pose) {
    EXPECT_EQ(pose.residuals.size(), 1u);
    return pose.residuals.empty() ? Residual() : pose.residuals.front();
  }
};

TEST_F(ResidualTest, AgreementLeavesNone) {
  const auto pose = compare({{5, 30, -5}}, {{5.1, 32, -12}}, {region("tv", 5, 30)});
  EXPECT_TRUE(pose.residuals.empty());
  EXPECT_TRUE(pose.regions[0].measured_strong);
  EXPECT_TRUE(pose.regions[0].simulated_strong);
  EXPECT_EQ(pose.central.active[2] + pose.central.active[1], 2);
  EXPECT_EQ(pose.central.recalled[2] + pose.central.recalled[1], 2);
}

TEST_F(ResidualTest, NothingInTheWideWindowIsC1) {
  const Residual r = only(compare({{5, 30, -5}}, {}, {region("tv", 5, 30)}));
  EXPECT_EQ(r.residual_class, ResidualClass::kMissingSupport);
  EXPECT_TRUE(r.measured_stronger);
  EXPECT_EQ(r.actor, "tv");
  EXPECT_EQ(r.material, "Wood");
  EXPECT_NEAR(r.range_m, 5, 0.05);
  EXPECT_NEAR(r.measured_db, -5, 1.5);
}

TEST_F(ResidualTest, AResponseBelowTheWeakThresholdIsC1AsWell) {
  EXPECT_EQ(only(compare({{5, 30, -5}}, {{5, 30, -28}}, {region("tv", 5, 30)})).residual_class,
            ResidualClass::kMissingSupport);
}

TEST_F(ResidualTest, AWeakResponseInTheTightWindowIsC2) {
  const Residual r = only(compare({{5, 30, -5}}, {{5, 30, -20}}, {region("tv", 5, 30)}));
  EXPECT_EQ(r.residual_class, ResidualClass::kWeakSupport);
  EXPECT_TRUE(materialChangeAdmissible(r.residual_class));
}

TEST_F(ResidualTest, AStrongResponseInTheRegionsTightWindowIsAMatch) {
  // 0.34 m apart, beyond the tight window around either response, but both in the region's: no weak support, no
  // material.
  const auto pose = compare({{4.83, 30, -5}}, {{5.17, 30, -5}}, {region("tv", 5, 30)});
  EXPECT_TRUE(pose.regions[0].simulated_strong);
  for (const Residual& r : pose.residuals) EXPECT_FALSE(r.measured_stronger);
}

TEST_F(ResidualTest, AResponseInTheWideWindowAloneIsC4OnBothSides) {
  const auto pose = compare({{5, 30, -5}}, {{5.45, 30, -5}}, {region("tv", 5, 30)});
  ASSERT_EQ(pose.residuals.size(), 2u);
  EXPECT_EQ(pose.residuals[0].residual_class, ResidualClass::kShiftedResponse);
  EXPECT_TRUE(pose.residuals[0].measured_stronger);
  EXPECT_EQ(pose.residuals[1].residual_class, ResidualClass::kShiftedResponse);
  EXPECT_FALSE(pose.residuals[1].measured_stronger);
  EXPECT_EQ(pose.central.class_count, (std::array<int, 5>{0, 0, 0, 2, 0}));
}

TEST_F(ResidualTest, AWeakResponseInTheWideWindowAloneIsC4) {
  EXPECT_EQ(only(compare({{5, 30, -5}}, {{5.45, 30, -20}}, {region("tv", 5, 30)})).residual_class,
            ResidualClass::kShiftedResponse);
}

TEST_F(ResidualTest, MeasuredAtNoRegionIsC5) {
  const Residual r = only(compare({{5, 30, -5}}, {}, {}));
  EXPECT_EQ(r.residual_class, ResidualClass::kMissingMechanism);
  EXPECT_TRUE(r.actor.empty());
  EXPECT_EQ(r.region, -1);
}

TEST_F(ResidualTest, AnotherRegionsResponseDoesNotCount) {
  // The response at 5.5 m is the shelf's: the tv behind which nothing is simulated stays without support.
  const auto pose =
      compare({{5, 30, -5}, {5.5, 30, -5}}, {{5.5, 30, -5}}, {region("tv", 5, 30), region("shelf", 5.5, 30)});
  EXPECT_EQ(only(pose).residual_class, ResidualClass::kMissingSupport);
  EXPECT_EQ(only(pose).actor, "tv");
}

TEST_F(ResidualTest, AResponseInBothTightWindowsCountsForBoth) {
  const auto pose = compare({{5.1, 30, -5}}, {{5.1, 30, -20}}, {region("tv", 5.05, 30), region("wall", 5.15, 30)});
  EXPECT_EQ(only(pose).residual_class, ResidualClass::kWeakSupport);
}

TEST_F(ResidualTest, TheLowestClassOfSeveralRegionsWins) {
  // 5.75 m lies in the wide window of 5.3 m alone: C4 there, C1 at 5 m.
  const auto regions = {region("far", 5.3, 30), region("near", 5.0, 30)};
  const auto pose = compare({{5.15, 30, -5}}, {{5.75, 30, -20}}, regions);
  EXPECT_EQ(only(pose).residual_class, ResidualClass::kMissingSupport);
  EXPECT_EQ(only(pose).actor, "near");
}

TEST_F(ResidualTest, SimulatedAtNoRegionIsC3) {
  const Residual r = only(compare({}, {{7, -30, -3}}, {}));
  EXPECT_EQ(r.residual_class, ResidualClass::kUnsupportedAnchor);
  EXPECT_FALSE(r.measured_stronger);
  EXPECT_EQ(r.region, -1);
}

TEST_F(ResidualTest, SimulatedAtARegionWithoutMeasurementIsThatActorsC3) {
  const Residual r = only(compare({}, {{7, -30, -3}}, {region("sofa", 7.3, -30)}));
  EXPECT_EQ(r.residual_class, ResidualClass::kUnsupportedAnchor);
  EXPECT_EQ(r.actor, "sofa");
}

TEST_F(ResidualTest, ThePeakThatNormalisesIsC3EvenNearAMeasuredResponse) {
  const auto regions = {region("desk", 1.4, -20)};
  auto pose = compare({{1.4, -20, -8}}, {{1.4, -20, -8}, {0.95, -20, -5}}, regions);
  EXPECT_EQ(only(pose).residual_class, ResidualClass::kShiftedResponse) << "below the peak it is a shifted response";
  pose = compare({{1.4, -20, -8}}, {{1.4, -20, -8}, {0.95, -20, 3}}, regions);
  EXPECT_EQ(only(pose).residual_class, ResidualClass::kUnsupportedAnchor);
}

TEST_F(ResidualTest, SimulatedWhereTheMeasurementIsNotWeakIsNoResidual) {
  EXPECT_TRUE(compare({{7, -30, -20}}, {{7, -30, -3}}, {}).residuals.empty());
}

TEST_F(ResidualTest, TheOuterFieldIsNotRouted) {
  const auto pose = compare({{5, 68, -5}}, {}, {region("tv", 5, 68)});
  EXPECT_TRUE(pose.residuals.empty());
}

TEST_F(ResidualTest, RecordsAreThoseOfTheCell) {
  const double d = radar_.virtual_pitch_m();
  // A far-field path: TX slot t at 4d, receiver r at d, departure and arrival of their own.
  const auto record = [&](double range_m, double departure_deg, double arrival_deg, double amplitude) {
    PathRecord r;
    r.length_m.assign(8, 2 * range_m);
    r.amplitude = amplitude;
    for (int k = 0; k < 8; ++k) {
      const double path = 4 * (k / 4) * std::sin(departure_deg * kDegree) + (k % 4) * std::sin(arrival_deg * kDegree);
      r.c.push_back(std::polar(amplitude, 0.4 - 2 * M_PI * d / radar_.wavelength_m() * path));
    }
    return r;
  };
  // 0.01 is 34 dB below the strongest in the cell, beyond the 20 dB that records reach down; 5.3 m is two bins off.
  const std::vector<PathRecord> records = {record(5.02, 31, 31, 0.2), record(5.3, 30, 30, 1), record(4.95, 29, 29, 0.5),
                                           record(5, 60, 60, 1), record(5, 30, 30, 0.01)};
  EXPECT_EQ(recordsInCell(field_, records, 5, 30 * kDegree), (std::vector<int>{2, 0}));
  // Departure -40, arrival 20 deg: the mean direction, -9 deg, is a null; what it puts into the map lies elsewhere.
  const std::vector<PathRecord> ghost = {record(5, -40, 20, 1)};
  double strongest_deg = 0, strongest = 0;
  for (double a = -60; a <= 60; a += 1) {
    const double share = field_.recordShare(ghost[0], 5, a * kDegree);
    if (share > strongest) strongest = share, strongest_deg = a;
  }
  EXPECT_EQ(recordsInCell(field_, ghost, 5, strongest_deg * kDegree).size(), 1u);
  EXPECT_GT(std::abs(strongest_deg - -9), 5);
}

TEST_F(ResidualTest, ConjugationIsNoticed) {
  const std::vector<Target> targets = {{3, 25, 0}, {5, -40, -4}};
  const RangeAngleMap simulated = synthetic::map(radar_, targets);
  const ConventionCheck right = checkConvention(field_, synthetic::map(radar_, targets), simulated);
  EXPECT_FALSE(right.conjugatedBetter());
  EXPECT_NEAR(right.as_recorded, 1, 1e-9);
  const ConventionCheck iq = checkConvention(field_, chain_.map(synthetic::grid(radar_, targets, true)), simulated);
  EXPECT_TRUE(iq.conjugatedBetter());
  EXPECT_GT(iq.iq_conjugated, 0.98);
  std::vector<Target> mirrored = targets;
  for (Target& t : mirrored) t.azimuth_deg = -t.azimuth_deg;
  const ConventionCheck channels = checkConvention(field_, synthetic::map(radar_, mirrored), simulated);
  EXPECT_TRUE(channels.conjugatedBetter());
  EXPECT_GT(channels.channel_conjugated, 0.98);
}

// Maps of single cells, so that every figure can be worked out by hand.
class MetricTest : public ResidualTest {
 protected:
  RangeAngleMap flat(double level_db) const {
    RangeAngleMap map;
    map.axes = chain_.axes();
    map.power_db = RealGrid::Constant(64, kAngleBins, level_db);
    return map;
  }
  int evaluatedCells() const {
    int angles = 0;
    for (double a : chain_.axes().azimuth_rad) angles += std::abs(a) <= 60 * kDegree;
    return 62 * angles;  // range bins 2 to 63
  }
};

TEST_F(MetricTest, EnergiesAndDifferencesOfHandMadeMaps) {
  RangeAngleMap m = flat(-80), s = flat(-45);
  m.power_db(20, 32) = 0;  // both strong, in a region: Q3 = 0
  s.power_db(20, 32) = 0;
  m.power_db(21, 32) = -3;  // both strong, in the region: -7
  s.power_db(21, 32) = -10;
  m.power_db(40, 20) = -10;  // Q1: measured strong, simulated weak
  m.power_db(50, 40) = -40;  // Q2: simulated strong, measured weak
  s.power_db(50, 40) = -5;
  m.power_db(60, 30) = -12;  // both strong, at no region
  s.power_db(60, 30) = -12;
  ResponseRegion expected = region("wall", chain_.axes().range_m[20], 0);
  const PoseAttribution pose = attributePose(field_, m, s, {expected}, {});
  const int rest = evaluatedCells() - 5;
  const double m_all = 1 + std::pow(10, -0.3) + 0.1 + 1e-4 + std::pow(10, -1.2) + rest * 1e-5;
  const double s_all =
      1 + 0.1 + std::pow(10, -4.5) + std::pow(10, -0.5) + std::pow(10, -1.2) + rest * std::pow(10, -4.5);
  EXPECT_NEAR(pose.central.q1_energy, 0.1 / m_all, 1e-12);
  EXPECT_NEAR(pose.central.q2_energy, std::pow(10, -0.5) / s_all, 1e-12);
  EXPECT_EQ(pose.central.q1_cells, 1);
  EXPECT_EQ(pose.central.q2_cells, 1);
  ASSERT_EQ(pose.central.q3_db.size(), 2u);
  EXPECT_DOUBLE_EQ(pose.central.q3_db[0], 0);
  EXPECT_DOUBLE_EQ(pose.central.q3_db[1], -7);
  EXPECT_EQ(pose.central.q4_cells, rest);
  EXPECT_NEAR(pose.central.q4_sum_db / rest, 5, 1e-9) << "-45 against -80 clipped to -50";
  EXPECT_DOUBLE_EQ(pose.residual_db(40, 20), -35);
  EXPECT_TRUE(std::isnan(pose.residual_db(1, 32)));
  EXPECT_TRUE(std::isnan(pose.residual_db(30, 63)));
}

TEST_F(MetricTest, TopKCountsAgreementWithinItsWindow) {
  // Measured by strength: A, B, C. Simulated: B' near B, then X, then A' near A.
  const std::vector<Target> measured = {{3, 0, 0}, {5, 20, -4}, {7, -30, -8}};
  const std::vector<Target> simulated = {{5.3, 24, 0}, {1.5, 40, -4}, {3.2, -8, -8}};
  const PoseAttribution pose =
      attributePose(field_, synthetic::map(radar_, measured), synthetic::map(radar_, simulated), {}, {});
  EXPECT_EQ(pose.central.top_count[0], 1);
  EXPECT_EQ(pose.central.top_hits[0], 0);
  EXPECT_EQ(pose.central.top_count[1], 3);
  EXPECT_EQ(pose.central.top_hits[1], 2);
}

TEST_F(MetricTest, RecallByBand) {
  const std::vector<Target> measured = {{1.0, 0, -3}, {3.0, 20, 0}, {3.5, -25, -6}, {6.0, 10, -6}};
  const std::vector<Target> simulated = {{1.0, 0, -3}, {3.0, 20, 0}, {6.0, 10, -20}};
  const PoseAttribution pose = attributePose(
      field_, synthetic::map(radar_, measured), synthetic::map(radar_, simulated),
      {region("a", 1, 0), region("b", 3, 20), region("c", 3.5, -25), region("d", 6, 10), region("e", 8, 0)}, {});
  EXPECT_EQ(pose.central.active, (std::array<int, 3>{1, 2, 1}));
  EXPECT_EQ(pose.central.recalled, (std::array<int, 3>{1, 1, 0}));
}

}  // namespace
}  // namespace mmradartwin
