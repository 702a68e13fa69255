#include "diagnosis/echoes/path_matching.h"

#include <gtest/gtest.h>

#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

const std::string kSpecular = "specular", kDiffuse = "diffuse";

PathRecord pathOf(const std::string& event, const PerInteraction<int>& facets, double amplitude, double range_m,
                  double azimuth_rad = 0) {
  PathRecord r;
  r.event = &event;
  r.facets = facets;
  r.actors = facets;  // one facet an actor
  r.bounces = static_cast<int>(facets.size());
  r.amplitude = amplitude;
  r.length_m = {2 * range_m, 2 * range_m};
  r.departure = r.arrival = {std::cos(azimuth_rad), std::sin(azimuth_rad), 0};
  return r;
}

std::vector<double> amplitudes(const std::vector<PathRecord>& records) {
  std::vector<double> all;
  for (const PathRecord& r : records) all.push_back(r.amplitude);
  return all;
}

TEST(PathMatching, SharedPathsAreThoseOfBothListsAsTheyAreThere) {
  const std::vector<PathRecord> here = {pathOf(kSpecular, {0}, 1, 3), pathOf(kSpecular, {1}, 2, 3)};
  const std::vector<PathRecord> there = {pathOf(kSpecular, {0}, 10, 3), pathOf(kSpecular, {2}, 30, 3),
                                         pathOf(kDiffuse, {1}, 40, 3)};
  std::vector<PathRecord> shared = {pathOf(kSpecular, {7}, 0.5, 1)};
  addShared(there, here, shared);
  // The first one is known in both; facet 1 is missing there and stays as it is here; others come new and are left out.
  EXPECT_EQ(amplitudes(shared), (std::vector<double>{0.5, 10, 2}));
}

TEST(PathMatching, ScatterPointsOfOneFacetStayAsTheyAre) {
  const std::vector<PathRecord> here = {pathOf(kDiffuse, {0}, 1, 3), pathOf(kDiffuse, {0}, 2, 3.1)};
  const std::vector<PathRecord> there = {pathOf(kDiffuse, {0}, 10, 3), pathOf(kDiffuse, {0}, 20, 3.1),
                                         pathOf(kDiffuse, {0}, 30, 3.2)};
  std::vector<PathRecord> shared;
  addShared(there, here, shared);
  EXPECT_EQ(amplitudes(shared), (std::vector<double>{1, 2}));
}

TEST(PathMatching, ShiftsAreOneWayAndToTheLeft) {
  const std::vector<PathRecord> here = {pathOf(kSpecular, {0}, 1, 3, 0.1), pathOf(kDiffuse, {1}, 1, 2),
                                        pathOf(kDiffuse, {1}, 1, 2.1)};
  const std::vector<PathRecord> there = {pathOf(kSpecular, {0}, 0.5, 3.2, 0.15), pathOf(kDiffuse, {1}, 1, 2.5),
                                         pathOf(kSpecular, {5}, 1, 4)};
  std::vector<PathShift> shifts;
  addShifts(4, there, here, shifts);
  ASSERT_EQ(shifts.size(), 1U);
  EXPECT_EQ(shifts[0].place, 4U);
  EXPECT_NEAR(shifts[0].range_m, 0.2, 1e-12);
  EXPECT_NEAR(shifts[0].azimuth_rad, 0.05, 1e-12);
  EXPECT_EQ(shifts[0].amplitude, 0.5);
}

TEST(PathMatching, MeanShiftsAreWeighedByAmplitudeAndOfSingleActors) {
  const std::vector<PathShift> shifts = {{0, &kSpecular, {0}, {0}, 1, 0.1, 0.01},
                                         {0, &kSpecular, {0}, {0}, 3, 0.2, 0.03},
                                         {1, &kSpecular, {1}, {1}, 2, -0.4, 0.05},
                                         {1, &kSpecular, {0, 1}, {0, 1}, 9, 7, 7},  // meets two
                                         {1, &kSpecular, {2}, {-1}, 9, 7, 7}};      // meets none
  const EchoShift mean = meanShift(shifts, 3, 2);
  EXPECT_NEAR(mean.range_m[0], 0.175, 1e-12);
  EXPECT_NEAR(mean.range_m[1], -0.4, 1e-12);
  EXPECT_EQ(mean.range_m[2], 0);
  EXPECT_NEAR(mean.azimuth_rad[0], 0.025, 1e-12);
  EXPECT_NEAR(mean.azimuth_rad[1], 0.05, 1e-12);
}

TEST(PathMatching, GroupsAreByTheActorsInOrder) {
  const std::vector<PathRecord> records = {pathOf(kSpecular, {0, 1}, 1, 3), pathOf(kSpecular, {1, 0}, 2, 3),
                                           pathOf(kDiffuse, {0, 1}, 3, 3)};
  const auto groups = byActors(records);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups.at({0, 1}).size(), 2U);
  EXPECT_EQ(groups.at({1, 0}).front()->amplitude, 2);
}

TEST(PathMatching, AMechanismIsFoundAmongThoseOfItsSubject) {
  const auto reflectivity = [](const std::string& material, double delta_db) {
    NamedParameters m = defaultMechanism("material_reflectivity");
    m.values.set("material", material);
    m.values.set("delta_db", delta_db);
    return m;
  };
  const std::vector<NamedParameters> one = {reflectivity("Metal", -1), reflectivity("Wood", -2),
                                            reflectivity("Metal", -3)};
  const std::vector<NamedParameters> other = {defaultMechanism("specular"), reflectivity("Metal", -5),
                                              reflectivity("Metal", -6)};
  EXPECT_EQ(sameInOtherList(one, 0, other)->values.number("delta_db"), -5);
  EXPECT_EQ(sameInOtherList(one, 2, other)->values.number("delta_db"), -6);
  EXPECT_EQ(sameInOtherList(one, 1, other), nullptr);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
