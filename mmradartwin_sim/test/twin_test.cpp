#include <tbb/parallel_for.h>

#include "closed_form.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_sim/simulate_session.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

class TwinTest : public SceneFiles {
 protected:
  /// A furnished room: rough walls, boxes, a slanted board; floor and ceiling.
  void addRoom(int n = 1) {
    addRectangle("floor", "Concrete", V(0, 0, 0), V(6, 0, 0), V(0, 5, 0), n);
    addRectangle("ceiling", "Concrete", V(0, 0, 2.8), V(6, 0, 0), V(0, 5, 0), n);
    addWall("south", "RoughConcrete", {0, 0}, {6, 0}, 0, 2.8, n);
    addWall("north", "RoughConcrete", {0, 5}, {6, 5}, 0, 2.8, n);
    addWall("west", "RoughConcrete", {0, 0}, {0, 5}, 0, 2.8, n);
    addWall("east", "RoughConcrete", {6, 0}, {6, 5}, 0, 2.8, n);
    addBox("cabinet", "Metal", V(4.6, 4.4, 0), V(5.8, 4.9, 1.6));
    addBox("desk", "Lossless", V(2, 0.2, 0.7), V(3.6, 0.9, 1.2));
    addWall("board", "Metal", {5.2, 0.5}, {5.7, 1.4}, 0.8, 1.8, n);
  }
  static double worst(const ComplexGrid& a, const ComplexGrid& b) { return (a - b).norm() / b.norm(); }
  /// First-order amplitude of a small plate as seen by a twin.
  double plateLevel(const std::string& mechanisms, double yaw_deg = 0) {
    return makeTwin(path("scene.yaml"), "  specular: {}\n" + mechanisms)
        .simulate(radarPose(0, 0, 0, yaw_deg))
        .records.at(0)
        .amplitude;
  }
  /// A plate of 10 cm at (range, azimuth) that faces the origin.
  void addPlate(double range, double azimuth_deg) {
    const double a = azimuth_deg * M_PI / 180;
    const Eigen::Vector2d at(range * std::cos(a), range * std::sin(a)), side(-0.05 * std::sin(a), 0.05 * std::cos(a));
    addWall("plate", "Metal", at - side, at + side, -0.05, 0.05);
    writeScene();
  }
};

TEST_F(TwinTest, LeavesRecordsThatAddUpToTheGrid) {
  addRoom();
  const RadarConfig radar = paperRadar();
  const Simulation s = makeTwin(writeScene()).simulate(radarPose(2, 2.5, 1, 30));
  ASSERT_GT(s.records.size(), 1000u);
  EXPECT_TRUE(s.propagation_only);
  EXPECT_TRUE(s.check.ok()) << s.check.worst_amplitude_error << " " << s.check.grid_error;
  // Rebuilt here, sample by sample, from the sum over records of docs/reference/contracts.md.
  ComplexGrid rebuilt = ComplexGrid::Zero(radar.channels(), radar.samples_per_chirp);
  for (const PathRecord& r : s.records) {
    double power = 0;
    for (int k = 0; k < radar.channels(); ++k) {
      power += std::norm(r.c[k]);
      for (int n = 0; n < radar.samples_per_chirp; ++n) {
        const double phase = 2 * M_PI * radar.slope_hz_per_s * r.length_m[k] / kSpeedOfLight_m_per_s *
                             (radar.sample_time_s(n) - radar.window_center_s());
        rebuilt(k, n) += r.c[k] * std::polar(1.0, phase);
      }
    }
    EXPECT_NEAR(power / (radar.channels() * r.amplitude * r.amplitude), 1, 1e-12);
    EXPECT_EQ(r.actors.size(), r.vertices.size());
    EXPECT_EQ(r.actors.size(), static_cast<std::size_t>(r.bounces));
  }
  expectForm("4.10 sum of records against the grid", "1", 0, worst(s.grid.x, rebuilt), 1e-12);
}

// The samples of docs/reference/contracts.md section 3 for one exactly known delay, including the residual video phase.
TEST_F(TwinTest, MakesTheSamplesOfTheConvention) {
  addWall("wall", "Metal", {3, -10}, {3, 10}, -5, 5);
  const RadarConfig radar = paperRadar();
  const Simulation s = makeTwin(writeScene(), "  specular: {}\n").simulate(radarPose(0, 0, 0));
  ASSERT_EQ(s.records.size(), 1u);
  const double tau = s.records[0].length_m[5] / kSpeedOfLight_m_per_s;
  const std::complex<double> first = s.grid.x(5, 0);
  for (int n = 0; n < radar.samples_per_chirp; ++n) {
    const double t = radar.sample_time_s(n), t0 = radar.sample_time_s(0);
    const std::complex<double> expected = first * std::polar(1.0, 2 * M_PI * radar.slope_hz_per_s * tau * (t - t0));
    EXPECT_LT(std::abs(s.grid.x(5, n) - expected), 1e-12 * std::abs(first));
  }
  // From channel to channel: 2 pi (f_c tau + mu tau t - mu tau^2/2).
  const auto phase = [&](int k) {
    const double d = s.records[0].length_m[k] / kSpeedOfLight_m_per_s;
    const double turns =
        radar.carrier_hz * d + radar.slope_hz_per_s * d * radar.sample_time_s(0) - 0.5 * radar.slope_hz_per_s * d * d;
    return 2 * M_PI * (turns - std::floor(turns));
  };
  for (int k = 1; k < 8; ++k) {
    EXPECT_NEAR(std::remainder(std::arg(s.grid.x(k, 0) / s.grid.x(0, 0)) - (phase(k) - phase(0)), 2 * M_PI), 0, 1e-8);
  }
}

TEST_F(TwinTest, ShowsAPlateAtTheRightBinOnTheRightSide) {
  for (double azimuth : {30.0, -45.0, 10.0}) {
    addPlate(3.2, azimuth);
    const Simulation s = makeTwin(path("scene.yaml"), "  specular: {}\n").simulate(radarPose(0, 0, 0));
    const SignalChain chain(paperRadar());
    const auto peak = [&](const ComplexGrid& x) {
      ReceiveGrid grid = s.grid;
      grid.x = x;
      const RangeAngleMap map = chain.map(grid);
      Eigen::Index r, a;
      map.power_db.maxCoeff(&r, &a);
      return std::make_pair(map.axes.range_m[r], map.axes.azimuth_rad[a] * 180 / M_PI);
    };
    const auto [range, angle] = peak(s.grid.x);
    EXPECT_NEAR(range, 3.2, 0.08);
    EXPECT_NEAR(angle, azimuth, 2.5) << "positive to the left";
    const auto mirrored = peak(s.grid.x.conjugate());
    EXPECT_NEAR(mirrored.second, -azimuth, 2.5);
  }
}

TEST_F(TwinTest, DoesNotCareWhereTheRoomStands) {
  addRoom();
  writeScene("here");
  addRoom();
  writeScene("there", ", xyz_m: [100, -70, 1.5], rpy_deg: [0, 0, 37]");
  const Eigen::Isometry3d move = Eigen::Translation3d(100, -70, 1.5) * Eigen::AngleAxisd(37 * M_PI / 180, V::UnitZ());
  Twin here = makeTwin(path("here.yaml")), there = makeTwin(path("there.yaml"));
  for (const Eigen::Isometry3d& T :
       {radarPose(2, 2.5, 1, 30), radarPose(3.1, 1.7, 1.2, -100), radarPose(1, 4, 0.8, 200)}) {
    const Simulation a = here.simulate(T), b = there.simulate(move * T);
    EXPECT_EQ(a.records.size(), b.records.size());
    expectForm("4.10 room and radar moved 122 m and 37 deg together", "1", 0, worst(b.grid.x, a.grid.x), 1e-6);
  }
}

TEST_F(TwinTest, DoesNotCareHowWallsAreTessellated) {
  addRoom(1);
  writeScene("coarse");
  addRoom(100);  // 20,000 triangles a wall
  writeScene("fine");
  const std::string mechanisms = "  specular: {}\n  corner: {}\n";
  Twin coarse = makeTwin(path("coarse.yaml"), mechanisms), fine = makeTwin(path("fine.yaml"), mechanisms);
  EXPECT_EQ(coarse.scene().facets.size(), fine.scene().facets.size());
  double step_db = 0;
  for (const Eigen::Isometry3d& T :
       {radarPose(2, 2.5, 1, 30), radarPose(3.1, 1.7, 1.2, -100), radarPose(1, 4, 0.8, 200)}) {
    const Simulation a = coarse.simulate(T), b = fine.simulate(T);
    ASSERT_EQ(a.records.size(), b.records.size());
    for (std::size_t i = 0; i < a.records.size(); ++i) {
      step_db = std::max(step_db, std::abs(db(a.records[i].amplitude) - db(b.records[i].amplitude)));
      EXPECT_NEAR(a.records[i].length_m[0], b.records[i].length_m[0], 1e-9);
    }
    EXPECT_LT(worst(b.grid.x, a.grid.x), 1e-4);
  }
  expectForm("4.10 walls of 2 and of 20,000 triangles, worst path", "dB", 0, step_db, 1e-3);
}

TEST_F(TwinTest, GivesTheSameBitsOnAnyThread) {
  addRoom();
  Twin twin = makeTwin(writeScene());
  const Simulation alone = twin.simulate(radarPose(2, 2.5, 1, 30));
  std::vector<int> same(8, 0);
  tbb::parallel_for(0, 8, [&](int i) {
    const Simulation s = twin.simulate(radarPose(2, 2.5, 1, 30));
    same[i] = s.grid.x == alone.grid.x;
    twin.simulate(radarPose(1 + 0.3 * i, 2.5, 1, 30 * i));
  });
  for (int s : same) EXPECT_TRUE(s);
}

TEST_F(TwinTest, RefusesImpossiblePoses) {
  addRoom();
  Twin twin = makeTwin(writeScene());
  EXPECT_NE(errorOf([&] { twin.simulate(radarPose(5, 4.6, 1)); }).find("cabinet"), std::string::npos);
  EXPECT_NE(errorOf([&] { twin.simulate(radarPose(NAN, 2, 1)); }).find("not a number"), std::string::npos);
}

// Mechanisms, each against the closed form of its law on one plate 3 m ahead.
TEST_F(TwinTest, PatternsFallOffAsCosines) {
  addPlate(3, 40);
  EXPECT_NEAR(db(plateLevel("  element_pattern: {cos_exponent: 2.1}\n") / plateLevel("")),
              2.1 * db(std::cos(40 * M_PI / 180)), 1e-6);
  EXPECT_NEAR(db(plateLevel("  elevation_pattern: {cos_exponent: 3}\n") / plateLevel("")), 0, 1e-6);
}

TEST_F(TwinTest, OffsetsMoveTheRadarAsTheCausesSay) {
  addPlate(3, 40);
  const auto look = [&](const std::string& m) {
    const PathRecord r =
        makeTwin(path("scene.yaml"), "  specular: {}\n" + m).simulate(radarPose(0, 0, 0)).records.at(0);
    return std::make_pair(r.length_m[0] / 2, std::atan2(r.departure.y(), r.departure.x()) * 180 / M_PI);
  };
  EXPECT_NEAR(look("  radar_yaw_offset: {yaw_deg: 14}\n").second, 26, 1e-6) << "turned left, things move right";
  EXPECT_NEAR(look("  radar_position_offset: {forward_m: 0.05}\n").first, 3 - 0.05 * std::cos(40 * M_PI / 180), 1e-9);
  EXPECT_NEAR(look("  radar_position_offset: {left_m: 0.01}\n").first, 3 - 0.01 * std::sin(40 * M_PI / 180), 1e-9);
  EXPECT_NEAR(look("  range_bias: {range_m: 0.031}\n").first, 3.031, 1e-9);
  EXPECT_NEAR(look("  range_scale: {scale: 0.01}\n").first, 3.03, 1e-9);
  EXPECT_NEAR(look("  range_bias: {range_m: 0.031}\n").second, 40, 1e-6);
}

TEST_F(TwinTest, RangeMechanismsKeepTheAngle) {
  addPlate(3, 40);
  const SignalChain chain(paperRadar());
  for (const char* m : {"  range_scale: {scale: 0.02}\n", "  range_bias: {range_m: 0.06}\n"}) {
    const ComplexGrid x =
        makeTwin(path("scene.yaml"), std::string("  specular: {}\n") + m).simulate(radarPose(0, 0, 0)).grid.x;
    const ComplexGrid base = makeTwin(path("scene.yaml"), "  specular: {}\n").simulate(radarPose(0, 0, 0)).grid.x;
    // At the window's centre only a phase common to the channels has changed.
    const auto slope = [](const ComplexGrid& g) { return std::arg(g(7, 32) / g(0, 32)); };
    EXPECT_NEAR(slope(x), slope(base), 1e-3) << m;
  }
}

TEST_F(TwinTest, MaterialsGetStrongerPerInteraction) {
  addWall("wall", "Concrete", {3, -3}, {3, 3});
  addWall("fin", "Metal", {2, 1}, {3, 1});
  writeScene();
  const auto level = [&](const std::string& m, const std::string& event) {
    return of(makeTwin(path("scene.yaml"), "  specular: {}\n  corner: {}\n" + m).simulate(radarPose(0, 0, 0)), event)
        .at(0)
        .amplitude;
  };
  EXPECT_NEAR(
      db(level("  material_reflectivity: {material: Concrete, delta_db: -10}\n", "specular") / level("", "specular")),
      -10, 1e-9);
  EXPECT_NEAR(db(level("  material_reflectivity: {actor: wall, delta_db: -10}\n", "corner") / level("", "corner")), -10,
              1e-9);
  EXPECT_NEAR(db(level("  material_reflectivity: {actor: fin, delta_db: 4}\n", "specular") / level("", "specular")), 0,
              1e-9);
}

TEST_F(TwinTest, ActorsGoAndMoveWithTheirShadows) {
  addWall("wall", "Metal", {4, -3}, {4, 3});
  addWall("screen", "Metal", {2, -0.5}, {2, 0.5}, -0.5, 0.5);
  writeScene();
  const auto names = [&](const std::string& m) {
    Twin twin = makeTwin(path("scene.yaml"), "  specular: {max_bounces: 1}\n" + m);
    std::vector<std::string> names;
    for (const PathRecord& r : twin.simulate(radarPose(0, 0, 0)).records)
      names.push_back(twin.scene().actors[r.actors[0]].name);
    return names;
  };
  EXPECT_EQ(names(""), std::vector<std::string>{"screen"});
  EXPECT_EQ(names("  actor_absent: {actor: screen}\n"), std::vector<std::string>{"wall"});
  EXPECT_EQ(names("  actor_moved: {actor: screen, dy_m: 3}\n"), std::vector<std::string>{"wall"});
  Twin moved =
      makeTwin(path("scene.yaml"), "  specular: {max_bounces: 1}\n  actor_moved: {actor: screen, dx_m: 0.5}\n");
  EXPECT_NEAR(moved.simulate(radarPose(0, 0, 0)).records.at(0).length_m[0], 5, 1e-9);
  EXPECT_NEAR(moved.scene().actors[1].vertices[0].x(), 2, 1e-9) << "the described scene stays";
}

TEST_F(TwinTest, LeakageStandsOverTheStrongestEchoAfterTheFilter) {
  addPlate(3, 0);
  const double echo = plateLevel("");
  for (const std::string& filter : {std::string(), std::string("  if_highpass: {corner_hz: 500.0e+3}\n")}) {
    Twin twin =
        makeTwin(path("scene.yaml"), "  specular: {}\n  tx_rx_leakage: {range_m: 0.6, level_db: 0.3}\n" + filter);
    const Simulation a = twin.simulate(radarPose(0, 0, 0)), b = twin.simulate(radarPose(0, 0, 0, 5));
    const auto leak = of(a, "tx_rx_leakage");
    ASSERT_EQ(leak.size(), 1u);
    EXPECT_TRUE(a.check.ok());
    EXPECT_EQ(leak[0].c, of(b, "tx_rx_leakage")[0].c) << "fixed to the body";
    EXPECT_NEAR(leak[0].length_m[0], 1.2, 1e-12);
    // |H|^2 = 1/((1 + f1^2/f^2)(1 + 4 f1^2/f^2)), f1 = 0.41881 of the corner (root of 4x^2 + 5x - 1).
    const auto gain = [&](double length) {
      if (filter.empty()) return 1.0;
      const double q = std::pow(0.41881 * 500e3 / (75e12 * length / kSpeedOfLight_m_per_s), 2);
      return 1 / std::sqrt((1 + q) * (1 + 4 * q));
    };
    EXPECT_NEAR(db(leak[0].amplitude * gain(1.2)) - db(echo * gain(6)), 0.3, 1e-3);
    EXPECT_EQ(a.propagation_only, filter.empty());
  }
}

TEST_F(TwinTest, LeakageTakesAVectorOverTheChannels) {
  addPlate(3, 0);
  Twin twin =
      makeTwin(path("scene.yaml"),
               "  specular: {}\n  tx_rx_leakage: {range_m: 0.1, level_db: -6, phase_deg: [0, 20, 40, 60, 80, 100, 120, "
               "140], gain_db: [0, 3, 0, 0, 0, 0, 0, 0]}\n");
  const auto leak = of(twin.simulate(radarPose(0, 0, 0)), "tx_rx_leakage");
  ASSERT_EQ(leak.size(), 1u);
  EXPECT_NEAR(std::arg(leak[0].c[3] / leak[0].c[0]) * 180 / M_PI, 60, 1e-9);
  EXPECT_NEAR(db(std::abs(leak[0].c[1] / leak[0].c[0])), 3, 1e-9);
  double power = 0;
  for (const auto& c : leak[0].c) power += std::norm(c);
  EXPECT_NEAR(db(std::sqrt(power / 8) / plateLevel("")), -6, 1e-9);
}

TEST_F(TwinTest, HighPassHasItsCorner) {
  addPlate(3, 0);
  // A tone at 500 kHz per metre of range: corner at the plate's beat frequency loses 3.01 dB.
  const double beat = 75e12 * 6 / kSpeedOfLight_m_per_s;
  const auto rms = [&](const std::string& m) {
    return makeTwin(path("scene.yaml"), "  specular: {}\n" + m).simulate(radarPose(0, 0, 0)).grid.x.norm();
  };
  EXPECT_NEAR(db(rms("  if_highpass: {corner_hz: " + std::to_string(beat) + "}\n") / rms("")), -3.0103, 1e-3);
}

TEST_F(TwinTest, ChannelErrorsTurnTheReceivedGridOnly) {
  addPlate(3, 20);
  const Simulation base = makeTwin(path("scene.yaml"), "  specular: {}\n").simulate(radarPose(0, 0, 0));
  const Simulation s = makeTwin(path("scene.yaml"),
                                "  specular: {}\n  channel_phase_error: {phase_deg: [0, 10, 20, 30, 40, 50, 60, 70], "
                                "gain_db: [0, 1, 0, 0, 0, 0, 0, -2]}\n"
                                "  tx_imbalance: {phase_deg: 15, gain_db: 1}\n")
                           .simulate(radarPose(0, 0, 0));
  EXPECT_FALSE(s.propagation_only);
  EXPECT_TRUE(s.check.ok());
  EXPECT_EQ(s.records[0].c, base.records[0].c);
  const std::complex<double> f7 = s.grid.x(7, 9) / base.grid.x(7, 9), f1 = s.grid.x(1, 9) / base.grid.x(1, 9);
  EXPECT_NEAR(std::arg(f7) * 180 / M_PI, 85, 1e-9);
  EXPECT_NEAR(db(std::abs(f7)), -1, 1e-9);
  EXPECT_NEAR(db(std::abs(f1)), 1, 1e-9);
}

TEST_F(TwinTest, AnErrorThatTheMeasurementIsCorrectedByIsRefused) {
  addPlate(3, 20);
  const ChannelCorrection correction{"channels.yaml", {0, 12, -8, 5, 20, -15, 9, -4}, std::vector<double>(8, 0.0)};
  const auto error = [&](const std::string& mechanisms) {
    write("twin.yaml", "mechanisms:\n  specular: {}\n" + mechanisms);
    const TwinDescription twin = loadTwin(path("twin.yaml"), path("scene.yaml"), paperRadar());
    return errorOf([&] { refuseSameChannelError(twin, correction); });
  };
  EXPECT_EQ(error(""), "");
  const std::string same = error("  channel_phase_error: {phase_deg: [0, 12, -8, 5, 20, -15, 9, -4]}\n");
  for (const char* part : {"channels.yaml", "twin.yaml", "channel_phase_error", "twice"}) {
    EXPECT_NE(same.find(part), std::string::npos) << same;
  }
  // The same but for what another calibration of the same radar comes to.
  EXPECT_NE(error("  channel_phase_error: {phase_deg: [0, 10, -5, 7, 18, -17, 11, -1], gain_db: [0, 0.3, 0, 0, 0.2, "
                  "0, 0, 0]}\n"),
            "");
  // What a diagnosis still finds in corrected data is another error.
  EXPECT_EQ(error("  channel_phase_error: {phase_deg: [0, -2, -3, 1, -2, 2, -1, 3]}\n"), "");
}

TEST_F(TwinTest, WeighsTracedRecordsAgain) {
  addRoom();
  const std::string scene = writeScene();
  Twin base = makeTwin(scene);
  const Eigen::Isometry3d T = radarPose(2, 2.5, 1, 30);
  const auto traced = base.trace(T);
  Twin extended = makeTwin(scene,
                           "  specular: {}\n  corner: {}\n  diffuse: {}\n  element_pattern: {cos_exponent: 2}\n"
                           "  material_reflectivity: {material: RoughConcrete, delta_db: -3}\n");
  expectForm("4.10 records weighed again against traced again", "1", 0,
             worst(extended.weigh(T, traced).grid.x, extended.simulate(T).grid.x), 1e-12);
}

TEST_F(TwinTest, ReadsTwinsStrictly) {
  addPlate(3, 0);
  const auto error = [&](const std::string& text) {
    write("twin.yaml", text);
    return errorOf([&] { Twin(loadTwin(path("twin.yaml"), path("scene.yaml"), paperRadar())); });
  };
  EXPECT_EQ(error("mechanisms: {specular: {max_bounces: 2}, corner: {}}\n"), "");
  EXPECT_NE(error("mechanisms: {specula: {}}\n").find("element_pattern"), std::string::npos) << "lists what is known";
  EXPECT_NE(error("mechanisms: {range_bias: {range: 0.1}}\n").find("range_m (m, -5 to 5)"), std::string::npos);
  EXPECT_NE(error("mechanisms: {range_bias: {}}\n").find("range_m"), std::string::npos);
  EXPECT_NE(error("mechanisms: {range_bias: {range_m: 50}}\n").find("50"), std::string::npos);
  EXPECT_NE(error("mechanisms: {actor_absent: {actor: tv}}\n").find("plate"), std::string::npos);
  EXPECT_NE(error("mechanisms: {channel_phase_error: {phase_deg: [1, 2]}}\n").find("8"), std::string::npos);
  EXPECT_NE(error("mechanisms: {material_reflectivity: {delta_db: 1}}\n").find("actor"), std::string::npos);
  EXPECT_NE(error("mechanism: {specular: {}}\n").find("mechanism"), std::string::npos);
  EXPECT_NE(errorOf([] { loadTwin("", std::nullopt, paperRadar()); }).find("scene"), std::string::npos);
  // What a twin resolves to reads back as the same.
  write("twin.yaml",
        "mechanisms: {specular: {}, element_pattern: {cos_exponent: 2.1}, actor_absent: {actor: plate},"
        " material_reflectivity: {material: Metal, delta_db: -3}}\n");
  const std::string resolved = loadTwin(path("twin.yaml"), path("scene.yaml"), paperRadar()).toYaml();
  write("again.yaml", resolved);
  EXPECT_EQ(loadTwin(path("again.yaml"), std::nullopt, paperRadar()).toYaml(), resolved);
}

TEST_F(TwinTest, HasAMechanismForSeveralThings) {
  addRoom();
  const std::string scene = writeScene();
  const Eigen::Isometry3d T = radarPose(2, 2.5, 1, 30);
  const std::string near = "{material: RoughConcrete, delta_db: -3}", far = "{material: Metal, delta_db: -5}";
  const Twin both = makeTwin(scene, "  specular: {}\n  material_reflectivity: [" + near + ", " + far + "]\n");
  const auto factors = [&](const std::string& one) {
    const Twin with = makeTwin(scene, "  specular: {}\n  material_reflectivity: " + one + "\n");
    const auto base = makeTwin(scene, "  specular: {}\n").simulate(T).records, changed = with.simulate(T).records;
    std::vector<double> factor;
    for (std::size_t i = 0; i < base.size(); ++i) factor.push_back(changed[i].amplitude / base[i].amplitude);
    return factor;
  };
  const std::vector<double> first = factors(near), second = factors(far),
                            together = factors("[" + near + ", " + far + "]");
  ASSERT_FALSE(together.empty());
  double least = 1;
  for (std::size_t i = 0; i < together.size(); ++i) {
    EXPECT_NEAR(together[i], first[i] * second[i], 1e-12);
    least = std::min({least, first[i]});
  }
  EXPECT_LT(least, 0.9) << "or nothing is shown";
  const std::string resolved = both.description().toYaml();
  write("again.yaml", resolved);
  EXPECT_EQ(loadTwin(path("again.yaml"), std::nullopt, paperRadar()).toYaml(), resolved);
  const auto error = [&](const std::string& text) {
    write("twin.yaml", "mechanisms: {" + text + "}\n");
    return errorOf([&] { loadTwin(path("twin.yaml"), path("scene.yaml"), paperRadar()); });
  };
  EXPECT_EQ(error("actor_unmodelled: [{x_m: 1, y_m: 1, size_m: 0.2}, {x_m: 2, y_m: 1, size_m: 0.2}]"), "");
  EXPECT_NE(error("range_bias: [{range_m: 0.1}, {range_m: 0.2}]").find("range_bias: stands once"), std::string::npos);
  EXPECT_NE(error("material_reflectivity: [" + near + ", " + near + "]").find("RoughConcrete"), std::string::npos);
  EXPECT_NE(error("material_reflectivity: []").find("empty list"), std::string::npos);
  EXPECT_NE(error("material_reflectivity: [{material: Metal, delta: 1}]").find("material_reflectivity[0].delta"),
            std::string::npos);
}

class SimulateSessionTest : public TwinTest {
 protected:
  void writeSession(const std::string& poses) {
    std::filesystem::create_directories(path("session"));
    write("session/radar.yaml", toYaml(paperRadar()));
    write("session/poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\n" + poses);
    write("session/session.yaml",
          "format: mmradartwin_session/1\nradar: radar.yaml\nscene: ../scene.yaml\nposes: poses.csv\n"
          "captures: captures/{pose}.bin\n");
  }
  std::string bytes(const std::string& file) const {
    std::ifstream in(path(file), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
};

TEST_F(SimulateSessionTest, WritesASessionThatReadsBack) {
  addRoom();
  writeScene();
  writeSession(
      "a,1,100.0,2,2.5,1,0,0,0,1\nb,1,200.0,2.5,2.5,1,0,0,1,0\nbad,1,300.0,5,4.6,1,0,0,0,1\nnone,1,400.0,nan,2,1,0,0,0,"
      "1\n");
  SimulateOptions options;
  options.session = path("session");
  options.output = path("out");
  options.frames = 3;
  options.jobs = 1;
  options.noise = SimulatedNoise::kNone;
  const SimulateResult result = simulateSession(options);
  EXPECT_EQ(result.poses, 2);
  ASSERT_EQ(result.problems.size(), 2u) << "one inside the cabinet, one not a number";
  const Recording recording = openSession(path("out"));
  ASSERT_EQ(recording.poses.size(), 2u);
  ASSERT_TRUE(recording.scene_file);
  EXPECT_TRUE(std::filesystem::exists(*recording.scene_file));
  ASSERT_TRUE(recording.gain_db);
  EXPECT_NEAR(*recording.gain_db, result.gain_db, 1e-9);
  int strongest = 0, frames = 0;
  std::vector<std::int16_t> first;
  for (const Pose& pose : recording.poses) {
    recording.forEachFrame(pose, [&](const AdcCube& cube) {
      ++frames;
      for (std::int16_t v : cube.data) strongest = std::max(strongest, std::abs(int(v)));
      if (first.empty()) first = cube.data;
      if (pose.name == "a") {
        EXPECT_EQ(cube.data, first) << "frames repeat the same samples";
      }
    });
  }
  EXPECT_EQ(frames, 6);
  EXPECT_NEAR(20 * std::log10(strongest / 32768.0), -6, 0.001);
  // Samples are the grid's, by the gain.
  Twin twin = makeTwin(path("scene.yaml"));
  const Simulation s = twin.simulate(recording.poses[0].T_map_radar);
  const double scale = 32768 * std::pow(10, *recording.gain_db / 20);
  EXPECT_NEAR(first[0], s.grid.x(0, 0).real() * scale, 0.51);
  EXPECT_NEAR(first[1], s.grid.x(0, 0).imag() * scale, 0.51);
  EXPECT_NEAR(first[2 * (4 * 64 + 4 * 7 + 2)], s.grid.x(4 + 2, 7).real() * scale, 0.51)
      << "second slot, sample 7, rx 2";
  std::ifstream csv(path("out/paths/a.csv"));
  std::string header;
  std::getline(csv, header);
  EXPECT_EQ(header,
            "length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,"
            "bounces,event,actors,materials");

  options.output = path("out2");
  options.jobs = 2;
  simulateSession(options);
  EXPECT_EQ(bytes("out/captures/a.bin"), bytes("out2/captures/a.bin"));
  EXPECT_EQ(bytes("out/paths/b.csv"), bytes("out2/paths/b.csv"));
}

TEST_F(SimulateSessionTest, DoesNotOverwriteItsInput) {
  addRoom();
  writeScene();
  writeSession("a,1,100.0,2,2.5,1,0,0,0,1\n");
  SimulateOptions options;
  options.session = options.output = path("session");
  EXPECT_NE(errorOf([&] { simulateSession(options); }).find("session itself"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
