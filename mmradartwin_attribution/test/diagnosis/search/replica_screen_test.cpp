#include "diagnosis/search/replica_screen.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

NamedParameters replica(double behind_m, double level_db, const std::string& actor) {
  NamedParameters m = mechanismWith("echo_replica", {{"behind_m", behind_m}, {"level_db", level_db}});
  m.values.set("actor", actor);
  return m;
}

/// Looks at a hypothesis by how near its distance is to one, and notes what was asked for.
struct Look {
  double wanted_m;
  std::vector<Hypothesis> asked = {};
  Screened operator()(const Hypothesis& h) {
    asked.push_back(h);
    const double off_m = h.mechanism.values.number("behind_m") - wanted_m;
    return {h, 40 - 100 * std::abs(off_m), {{1.0}}};
  }
};

TEST(ReplicaScreen, FindsHowFarBehindAllEchoesTheyStand) {
  MadeRoom room(10);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(replica(0.9, -12, ""));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  Look look{0.9};
  const std::vector<Screened> found =
      screenReplicas(*room.twin, fitted.model, fitted.null, fitted.everyPose(), 8, std::ref(look));
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].hypothesis.subject, "");
  EXPECT_NEAR(found[0].hypothesis.mechanism.values.number("behind_m"), 0.9, 0.05);
  // The distance is then a number to be fitted, from where it was found.
  ASSERT_EQ(found[0].hypothesis.coordinates.size(), 2U);
  EXPECT_EQ(found[0].hypothesis.coordinates[1].parameter, "behind_m");
  EXPECT_EQ(found[0].starts[0], (std::vector<double>{1, 0}));
}

TEST(ReplicaScreen, FindsWhoseEchoesTheyFollow) {
  MadeRoom room(10);
  std::vector<NamedParameters> truth = firstOrder();
  truth.push_back(replica(-0.7, -8, "north"));
  room.measure(truth);
  FittedRoom fitted(room, firstOrder());
  Look look{-0.7};
  const std::vector<Screened> found =
      screenReplicas(*room.twin, fitted.model, fitted.null, fitted.everyPose(), 8, std::ref(look));
  bool of_north = false;
  for (const Screened& s : found) {
    if (s.hypothesis.subject.empty() || s.screened_nats < 30) continue;
    EXPECT_EQ(s.hypothesis.subject, "north");
    EXPECT_NEAR(s.hypothesis.mechanism.values.number("behind_m"), -0.7, 0.05);
    of_north = true;
  }
  EXPECT_TRUE(of_north);
}

TEST(ReplicaScreen, AsksNothingOfDistancesWhereNoneStand) {
  MadeRoom room(10);
  room.measure(firstOrder());
  FittedRoom fitted(room, firstOrder());
  Look look{0};
  screenReplicas(*room.twin, fitted.model, fitted.null, fitted.everyPose(), 8, std::ref(look));
  // Second faces within the main lobe are looked at for each actor whatever the distances say.
  for (const Hypothesis& h : look.asked)
    EXPECT_LT(h.mechanism.values.number("behind_m"), room.data.radar.range_bin_m());
}

TEST(ReplicaScreen, SecondFacesNeedMoreThanDistances) {
  MadeRoom room(6);
  room.measure(firstOrder());
  FittedRoom fitted(room, firstOrder());
  const auto promising = [&](double nats) {
    return screenReplicas(*room.twin, fitted.model, fitted.null, fitted.everyPose(), 8,
                          [nats](const Hypothesis& h) {
                            return Screened{h, nats, {{1.0}}};
                          })
        .size();
  };
  EXPECT_EQ(promising(49), 0U);
  EXPECT_EQ(promising(51), 1U);
}

TEST(ReplicaScreen, LooksForNoFurtherOneBesideOneThatIsKnown) {
  MadeRoom room(4);
  std::vector<NamedParameters> mechanisms = firstOrder();
  mechanisms.push_back(replica(0.9, -12, ""));
  room.measure(mechanisms);
  FittedRoom fitted(room, mechanisms);
  Look look{0.9};
  EXPECT_TRUE(screenReplicas(*room.twin, fitted.model, fitted.null, fitted.everyPose(), 8, std::ref(look)).empty());
  EXPECT_TRUE(look.asked.empty());
}

}  // namespace
}  // namespace mmradartwin::diagnosis
