#include "mmradartwin_attribution/place_explanation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "mmradartwin_dsp/input_error.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;
using synthetic::Target;

class PlaceExplanationTest : public ::testing::Test {
 protected:
  static ResponseRegion region(const std::string& actor, double range_m, double azimuth_deg) {
    ResponseRegion r;
    r.actor = actor;
    r.material = "Wood";
    r.range_m = range_m;
    r.azimuth_rad = azimuth_deg * kDegree;
    return r;
  }

  /// A path there and back, as a line array far away sees it.
  PathRecord path(const std::string& event, double range_m, double azimuth_deg, double level_db) const {
    static std::vector<std::unique_ptr<std::string>> names;
    names.push_back(std::make_unique<std::string>(event));
    PathRecord r;
    r.event = names.back().get();
    r.amplitude = std::pow(10.0, level_db / 20);
    r.arrival = {std::cos(azimuth_deg * kDegree), std::sin(azimuth_deg * kDegree), 0};
    for (int k = 0; k < radar_.channels(); ++k) {
      r.length_m.push_back(2 * range_m);
      r.c.push_back(std::polar(r.amplitude, -2 * M_PI * radar_.virtual_pitch_m() * k * std::sin(azimuth_deg * kDegree) /
                                                radar_.wavelength_m()));
    }
    return r;
  }

  /// The strongest echo of both maps, at 3 m ahead, is 0 dB.
  PlaceExplanation explain(std::vector<Target> measured, std::vector<Target> simulated,
                           std::vector<ResponseRegion> regions, double range_m, double azimuth_deg,
                           const std::vector<PathRecord>& records = {}) {
    measured.push_back({3, 0, 0});
    simulated.push_back({3, 0, 0});
    regions.push_back(region("anchor", 3, 0));
    pose_ =
        attributePose(field_, synthetic::map(radar_, measured), synthetic::map(radar_, simulated), regions, records);
    return explainPlace(field_, pose_, records, range_m, azimuth_deg * kDegree);
  }

  RadarConfig radar_ = paperRadar();
  EvaluationField field_{AttributionConfig(), radar_, SignalChain(radar_).axes()};
  PoseAttribution pose_;
};

TEST_F(PlaceExplanationTest, WeakSupportIsSeenButWeak) {
  const PlaceExplanation p = explain({{5, 30, -6}}, {{5, 30, -21}}, {region("cabinet_north", 5, 30)}, 5.1, 29);
  EXPECT_EQ(kindName(p, pose_), "C2");
  EXPECT_EQ(p.sentence, "measured −6 dB here, the twin has −21 dB: the cabinet north is seen but weak");
  EXPECT_EQ(p.actor, "cabinet_north");
  EXPECT_EQ(p.material, "Wood");
  EXPECT_EQ(p.action, classAction(ResidualClass::kWeakSupport));
  EXPECT_NEAR(p.range_m, 5, 0.05);
}

TEST_F(PlaceExplanationTest, MissingSupportTellsWhetherThereIsNoPath) {
  const PlaceExplanation without_paths = explain({{5, 30, -6}}, {}, {region("tv", 5, 30)}, 5, 30);
  EXPECT_EQ(kindName(without_paths, pose_), "C1");
  EXPECT_NE(without_paths.sentence.find("the tv should be seen here, and the twin has no echo of it"),
            std::string::npos);
  const PlaceExplanation with_paths =
      explain({{5, 30, -6}}, {}, {region("tv", 5, 30)}, 5, 30, {path("specular", 3, 0, 0)});
  EXPECT_NE(with_paths.sentence.find("no path of the twin comes from it"), std::string::npos);
}

TEST_F(PlaceExplanationTest, AnUnsupportedAnchorIsNotMeasured) {
  const PlaceExplanation p = explain({}, {{5, 30, -6}}, {region("wall;floor", 5, 30)}, 5, 30);
  EXPECT_EQ(kindName(p, pose_), "C3");
  EXPECT_NE(p.sentence.find("the twin's echo of the wall and the floor is not measured"), std::string::npos);
  const PlaceExplanation nowhere = explain({}, {{5, 30, -6}}, {}, 5, 30);
  EXPECT_EQ(kindName(nowhere, pose_), "C3");
  EXPECT_NE(nowhere.sentence.find("where the scene lets none be expected"), std::string::npos);
}

TEST_F(PlaceExplanationTest, TheTwinsStrongestEchoIsToldToBeIt) {
  const PlaceExplanation p = explain({}, {{5, 30, 6}}, {region("tv", 5, 30)}, 5, 30);
  EXPECT_EQ(kindName(p, pose_), "C3");
  EXPECT_NE(p.sentence.find("the twin's strongest echo, from the tv, is not measured"), std::string::npos);
}

TEST_F(PlaceExplanationTest, AShiftedResponseIsNearBy) {
  const std::vector<Target> measured = {{5, 30, -5}}, simulated = {{5.45, 30, -5}};
  const PlaceExplanation here = explain(measured, simulated, {region("tv", 5, 30)}, 5, 30);
  EXPECT_EQ(kindName(here, pose_), "C4");
  EXPECT_NE(here.sentence.find("the twin has the echo of the tv near by, and not here"), std::string::npos);
  const PlaceExplanation there = explain(measured, simulated, {region("tv", 5, 30)}, 5.5, 30);
  EXPECT_EQ(kindName(there, pose_), "C4");
  EXPECT_NE(there.sentence.find("the measurement has the echo of the tv near by, and not here"), std::string::npos);
}

TEST_F(PlaceExplanationTest, AMissingMechanismHasNoActor) {
  const PlaceExplanation p = explain({{5, 30, -5}}, {}, {}, 5, 30);
  EXPECT_EQ(kindName(p, pose_), "C5");
  EXPECT_TRUE(p.actor.empty());
  EXPECT_EQ(p.region, -1);
  EXPECT_NE(p.sentence.find("where the scene lets none be expected, and what makes it is not in the twin"),
            std::string::npos);
  // The twin is as strong by the flank of an echo beside it.
  const PlaceExplanation flank = explain({{5, 30, -5}}, {{5.4, 30, 0}}, {}, 5, 30);
  EXPECT_EQ(kindName(flank, pose_), "C5");
  EXPECT_EQ(flank.sentence.find("is not in the twin") == std::string::npos,
            flank.simulated_db >= field_.config().strong_db);
}

TEST_F(PlaceExplanationTest, AMatchIsSeenByBoth) {
  const PlaceExplanation p = explain({{5, 30, -5}}, {{5.05, 30, -7}}, {region("tv", 5, 30)}, 5, 30);
  EXPECT_EQ(kindName(p, pose_), "matched");
  EXPECT_EQ(p.sentence, "measured −5 dB here, the twin has −7 dB: both see the tv");
  EXPECT_TRUE(p.action.empty());
  EXPECT_EQ(p.actor, "tv");
}

TEST_F(PlaceExplanationTest, CellsWithoutABoxAreToldByTheirLevels) {
  const PlaceExplanation quiet = explain({}, {}, {}, 7, -30);
  EXPECT_EQ(kindName(quiet, pose_), "quiet");
  EXPECT_NE(quiet.sentence.find("neither is strong, and nothing is expected"), std::string::npos);
  const PlaceExplanation unseen = explain({}, {}, {region("tv", 7, -30)}, 7, -30);
  EXPECT_EQ(kindName(unseen, pose_), "quiet");
  EXPECT_NE(unseen.sentence.find("the tv is here, and strong in neither map"), std::string::npos);
  // The flank of the measured echo at 30 degrees, outside of its box.
  const double flank_deg = 30 + 1.2 * field_.halfAzimuth_rad(field_.config().tight, 30 * kDegree) / kDegree;
  const PlaceExplanation measured = explain({{5, 30, 0}}, {}, {}, 5, flank_deg);
  EXPECT_EQ(kindName(measured, pose_), "measured") << measured.measured_db;
  const PlaceExplanation simulated = explain({}, {{5, 30, 0}}, {}, 5, flank_deg);
  EXPECT_EQ(kindName(simulated, pose_), "simulated") << simulated.simulated_db;
  const PlaceExplanation both = explain({{5, 30, 0}}, {{5, 30, 0}}, {}, 5, 30);
  EXPECT_EQ(kindName(both, pose_), "both");
}

TEST_F(PlaceExplanationTest, SharesOfPathsSumToOne) {
  const std::vector<PathRecord> records = {path("diffuse", 5, 30, -16), path("specular", 3, 0, 0),
                                           path("specular", 5, 30, -10), path("corner", 5.05, 31, -13)};
  const PlaceExplanation p = explain({{5, 30, -5}}, {{5, 30, -7}}, {region("tv", 5, 30)}, 5, 30, records);
  ASSERT_EQ(p.paths.size(), 3u);
  EXPECT_EQ(p.paths[0].record, 2);
  EXPECT_EQ(p.paths[1].record, 3);
  EXPECT_EQ(p.paths[2].record, 0);
  const double sum = std::accumulate(p.paths.begin(), p.paths.end(), 0.0,
                                     [](double s, const PathPart& part) { return s + part.share; });
  EXPECT_NEAR(sum, 1, 1e-12);
  // 6 dB between two paths of the very place: shares of four to one.
  EXPECT_NEAR(p.paths[0].share / p.paths[2].share, std::pow(10, 0.6), 0.05);
  EXPECT_NEAR(p.paths[0].level_db, -10, 0.3);
  EXPECT_NEAR(p.paths[0].delay_s, 2 * 5 / 299792458.0, 1e-12);
  EXPECT_NEAR(p.paths[0].range_m, 5, 1e-9);
  EXPECT_NEAR(p.paths[0].azimuth_rad, 30 * kDegree, 1e-9);
}

TEST_F(PlaceExplanationTest, APlaceThatIsNotComparedIsRefused) {
  EXPECT_THROW(explain({}, {}, {}, 3, 80), InputError);
  EXPECT_THROW(explain({}, {}, {}, 0.05, 0), InputError);
}

}  // namespace
}  // namespace mmradartwin
