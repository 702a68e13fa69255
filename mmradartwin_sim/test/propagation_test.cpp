#include <complex>

#include "closed_form.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/law_variable.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;
using V = Eigen::Vector3d;
constexpr double kDegree = M_PI / 180;
constexpr double kLambda77_m = kSpeedOfLight_m_per_s / 77e9;

Material dielectric(double permittivity, double conductivity, double thickness_m) {
  Material m;
  m.relative_permittivity = permittivity;
  m.conductivity_s_per_m = conductivity;
  m.thickness_m = thickness_m;
  return m;
}

// P.2040 section 2.2.2.2: half a wave inside reflects nothing, a quarter wave of eps 4 has |R| = 0.6, |T| = 0.8.
TEST(SlabTest, IsTheFilmOfHalfAndQuarterWaves) {
  const Slab half = slab(dielectric(4, 0, kLambda77_m / 4), 1, 77e9),
             quarter = slab(dielectric(4, 0, kLambda77_m / 8), 1, 77e9);
  EXPECT_LT(std::abs(half.reflection.te), 1e-9);
  expectForm("4.5 slab of half a wave, abs(T)", "1", 1, std::abs(half.transmission.te), 1e-9);
  expectForm("4.5 slab of a quarter wave, abs(R)", "1", 0.6, std::abs(quarter.reflection.te), 1e-9);
  expectForm("4.5 slab of a quarter wave, abs(T)", "1", 0.8, std::abs(quarter.transmission.tm), 1e-9);
}

TEST(SlabTest, KeepsEnergyWithoutLossAndNeverGainsAny) {
  double worst = 0;
  for (double c : {0.05, 0.2, 0.447213595, 0.7, 1.0}) {
    for (double d : {0.0003, 0.0011, 0.004, 0.0127}) {
      const Slab lossless = slab(dielectric(6.31, 0, d), c, 77e9), lossy = slab(dielectric(6.31, 1.2, d), c, 77e9);
      EXPECT_NEAR(std::norm(lossless.reflection.te) + std::norm(lossless.transmission.te), 1, 1e-9);
      EXPECT_NEAR(std::norm(lossless.reflection.tm) + std::norm(lossless.transmission.tm), 1, 1e-9);
      worst = std::max(worst, std::abs(std::norm(lossless.reflection.te) + std::norm(lossless.transmission.te) - 1));
      EXPECT_LT(std::norm(lossy.reflection.te) + std::norm(lossy.transmission.te), 1);
      EXPECT_LT(std::norm(lossy.reflection.tm) + std::norm(lossy.transmission.tm), 1);
    }
  }
  expectForm("4.5 lossless slabs, R^2 + T^2 - 1, worst", "1", 0, worst, 1e-9);
  expectForm("4.5 slab at Brewster's angle, abs(R_TM)", "1", 0,
             std::abs(slab(dielectric(4, 0, 0.003), std::cos(std::atan(2.0)), 77e9).reflection.tm), 1e-9);
}

TEST(SlabTest, IsTheHalfSpaceWhereItIsThickAndLossy) {
  const Slab thick = slab(dielectric(5.24, 1.381, 0.2), 0.8, 77e9);
  const Fresnel half = fresnel(dielectric(5.24, 1.381, 0.2), 0.8, 77e9);
  EXPECT_LT(std::abs(thick.reflection.te - half.te), 1e-9);
  EXPECT_LT(std::abs(thick.reflection.tm - half.tm), 1e-9);
  EXPECT_LT(std::abs(thick.transmission.te), 1e-9);
}

// docs/reference/closed_forms.md 4.5, one way at normal incidence.
TEST(SlabTest, HasTheLossesOfCommonPanels) {
  const Slab plasterboard = slab(dielectric(2.73, .503, .0125), 1, 77e9);
  expectForm("4.5 plasterboard 12.5 mm, abs(R)", "1", .2907, std::abs(plasterboard.reflection.te), 2e-3);
  expectForm("4.5 plasterboard 12.5 mm, T", "dB", -6.86, db(std::abs(plasterboard.transmission.te)), 0.05);
  EXPECT_NEAR(std::abs(slab(dielectric(6.31, 1.211, .006), 1, 77e9).reflection.te), .4589, 2e-3);
  const auto loss = [](double permittivity, double conductivity, double thickness_m) {
    return db(std::abs(slab(dielectric(permittivity, conductivity, thickness_m), 1, 77e9).transmission.te));
  };
  expectForm("4.5 glass 6 mm, T", "dB", -6.53, loss(6.31, 1.211, .006), 0.05);
  expectForm("4.5 chipboard 18 mm, T", "dB", -12.24, loss(2.58, .643, .018), 0.05);
  expectForm("4.5 wood 40 mm, T", "dB", -23.2, loss(1.99, .494, .040), 0.1);
}

// docs/reference/closed_forms.md 4.5: |Gamma| at normal incidence of every material of both editions at 77 GHz.
TEST(ItuMaterials, HaveTheTabulatedReflection) {
  const struct {
    const char *edition, *name;
    double gamma;
  } rows[] = {{"itu_p2040_3", "Concrete", .3926},    {"itu_p2040_3", "Brick", .3283},
              {"itu_p2040_3", "Plasterboard", .246}, {"itu_p2040_4", "Plasterboard", .263},
              {"itu_p2040_3", "Wood", .1714},        {"itu_p2040_3", "Glass", .431},
              {"itu_p2040_4", "Glass", .429},        {"itu_p2040_3", "CeilingBoard", .0978},
              {"itu_p2040_3", "Chipboard", .2335},   {"itu_p2040_3", "Plywood", .2444},
              {"itu_p2040_3", "Marble", .4535},      {"itu_p2040_3", "Floorboard", .3155},
              {"itu_p2040_4", "Floorboard", .3155},  {"itu_p2040_3", "Metal", 1},
              {"itu_p2040_4", "Concrete", .3926}};
  for (const auto& row : rows) {
    const auto table = loadMaterials(std::string(MMRADARTWIN_CONFIG) + "/materials/" + row.edition + ".yaml");
    ASSERT_EQ(table.count(row.name), 1u) << row.edition << " " << row.name;
    const Material& m = table.at(row.name);
    expectForm(std::string("4.5 Gamma of ") + row.name + ", " + row.edition, "1", row.gamma,
               std::abs(fresnel(m, 1, 77e9).te), 6e-4);
    EXPECT_GT(m.valid_hz_max, 1e9) << row.name;
    EXPECT_TRUE(m.extrapolated || (77e9 >= m.valid_hz_min && 77e9 <= m.valid_hz_max)) << row.name;
  }
}

TEST(Roughness, HasAmentsNumbers) {
  const double rows[][3] = {{.05e-3, 0, -.11}, {.1e-3, 0, -.45}, {.2e-3, 0, -1.81}, {.3e-3, 0, -4.07},
                            {.5e-3, 0, -11.3}, {1e-3, 0, -45.2}, {.5e-3, 60, -2.83}};
  for (const auto& row : rows) {
    expectForm("4.7 roughness of " + shortText(1e3 * row[0]) + " mm at " + shortText(row[1]) + " deg", "dB", row[2],
               db(roughnessLoss(row[0], std::cos(row[1] * kDegree), 77e9)), 0.05);
  }
}

class Propagation : public SceneFiles {
 protected:
  Simulation run(const std::string& mechanisms, const Eigen::Isometry3d& pose = radarPose(0, 0, 0),
                 const RadarConfig& radar = radarAt77GHz()) {
    return makeTwin(path("scene.yaml"), mechanisms, radar).simulate(pose);
  }
};

TEST_F(Propagation, RoughnessTakesFromEveryReflectionAtItsAngle) {
  addWall("wall", "Concrete", {3, -10}, {3, 10}, -5, 5);
  addWall("left", "Concrete", {3, 2}, {-3, 2}, -5, 5);
  addWall("patch", "RoughMetal", {-2, -4}, {2.9, -4}, -1, 1);
  writeScene();
  const std::string base = "  specular: {}\n  corner: {}\n  diffuse: {}\n";
  const Simulation smooth = run(base, radarPose(0, 0, 0, 20)),
                   rough = run(base + "  surface_roughness: {material: Concrete, roughness_rms_m: 0.0002}\n",
                               radarPose(0, 0, 0, 20));
  ASSERT_EQ(smooth.records.size(), rough.records.size());
  int first = 0, corners = 0, patches = 0;
  for (std::size_t i = 0; i < smooth.records.size(); ++i) {
    const PathRecord& r = smooth.records[i];
    const double change = db(rough.records[i].amplitude / r.amplitude);
    if (*r.event == "diffuse") {
      EXPECT_EQ(change, 0);
      ++patches;
    } else if (*r.event == "corner") {
      // Seen along (3, 2): incidence with cosines 3/sqrt(13) and 2/sqrt(13), whose squares add up to one.
      EXPECT_NEAR(change, -1.81, 0.01);
      ++corners;
    } else if (r.bounces == 1 && r.actors[0] != 2) {
      EXPECT_NEAR(change, -1.81, 0.01);
      ++first;
    }
  }
  EXPECT_EQ(first, 2);
  EXPECT_EQ(corners, 1);
  EXPECT_GT(patches, 50);
  EXPECT_NE(errorOf([&] { run("  surface_roughness: {material: Cork, roughness_rms_m: 0.0002}\n"); }).find("Cork"),
            std::string::npos);
}

TEST_F(Propagation, ScatteringMovesPowerFromTheMirrorIntoThePatches) {
  addWall("wall", "Metal", {3, -2}, {3, 2}, -1, 1);
  addWall("rough", "RoughMetal", {3, -2}, {3, 2}, -1, 1);
  writeScene("both");
  addWall("wall", "Metal", {3, -2}, {3, 2}, -1, 1);
  writeScene();
  const std::string base = "  specular: {}\n  diffuse: {spacing_m: 0.05}\n";
  const Simulation smooth = run(base);
  EXPECT_TRUE(of(smooth, "diffuse").empty());
  const Simulation s = run(base + "  diffuse_scattering: {material: Metal, scattering_coefficient: 0.6}\n");
  EXPECT_NEAR(of(s, "specular").at(0).amplitude / smooth.records[0].amplitude, std::sqrt(1 - 0.36), 1e-12);
  // Power of all patches: (lambda/4 pi)^2 S^2/pi times the integral of cos^2/r^4 over the wall.
  double power = 0, expected = 0;
  for (const PathRecord& r : of(s, "diffuse")) power += r.amplitude * r.amplitude;
  const double h = 0.004;
  for (double y = -2 + h / 2; y < 2; y += h) {
    for (double z = -1 + h / 2; z < 1; z += h) expected += h * h * 9 / std::pow(9 + y * y + z * z, 3);
  }
  expected *= std::pow(kLambda77_m / (4 * M_PI), 2) * 0.36 / M_PI;
  EXPECT_NEAR(10 * std::log10(power / expected), 0, 0.05);
}

// The corner of floor and wall: s = 2 sqrt(d^2 + h^2), elevation -atan(h/d), Gamma of both at their angles.
TEST_F(Propagation, FloorAndCeilingReturnFromTheirCorners) {
  addWall("wall", "Metal", {5, -20}, {5, 20}, 0, 2.5);
  addRectangle("floor", "Metal", V(-5, -20, 0), V(10, 0, 0), V(0, 40, 0));
  addRectangle("ceiling", "Metal", V(-5, -20, 2.5), V(10, 0, 0), V(0, 40, 0));
  writeScene();
  EXPECT_TRUE(run("  specular: {}\n  corner: {}\n", radarPose(0, 0, 1)).records.size() == 1u);
  const Simulation s = run("  floor_ceiling_multipath: {level: 1}\n", radarPose(0, 0, 1));
  ASSERT_EQ(s.records.size(), 2u);
  for (const PathRecord& r : s.records) {
    const double h = r.vertices[0].z() < 1 ? 1 : 1.5;
    EXPECT_NEAR(r.length_m[0], 2 * std::hypot(5, h), 1e-9);
    EXPECT_NEAR(std::asin(r.departure.z()), (h == 1 ? -1 : 1) * std::atan(h / 5), 1e-9);
    EXPECT_NEAR(db(r.amplitude), db(kLambda77_m / (4 * M_PI * r.length_m[0])), 0.3);
  }
  // Beyond 20 deg of elevation there is nothing; level is a factor.
  EXPECT_EQ(run("  floor_ceiling_multipath: {level: 1}\n", radarPose(2, 0, 1)).records.size(), 1u);
  const auto wide = run("  floor_ceiling_multipath: {level: 1, max_elevation_deg: 30}\n", radarPose(2, 0, 1)).records;
  ASSERT_EQ(wide.size(), 2u) << "the corner over the ceiling, 1.5 m up at 3 m";
  EXPECT_NEAR(std::max(wide[0].departure.z(), wide[1].departure.z()), 1.5 / std::hypot(3, 1.5), 1e-9);
  EXPECT_NEAR(run("  floor_ceiling_multipath: {level: 0.25}\n", radarPose(0, 0, 1)).records[0].amplitude /
                  s.records[0].amplitude,
              0.25, 1e-12);
}

TEST_F(Propagation, AGhostComesBackBothWays) {
  addWall("mirror", "Metal", {-8, 2}, {8, 2}, -4, 4);
  addWall("object", "RoughMetal", {4, -1}, {4.1, -0.9}, -0.05, 0.05);
  writeScene();
  const Simulation s = run("  wall_ghost: {walls: [mirror], spacing_m: 1}\n", radarPose(0, 0, 0), paperRadar());
  std::vector<PathRecord> ghosts;
  for (const PathRecord& r : s.records) {
    if (r.facets[0] != r.facets[1] && r.actors.size() == 2) ghosts.push_back(r);
  }
  ASSERT_GE(ghosts.size(), 2u);
  const PathRecord &a = ghosts[0], &b = ghosts[1];
  const V x = a.vertices[1], image(x.x(), 4 - x.y(), x.z());
  EXPECT_NEAR(a.length_m[0], x.norm() + image.norm(), 1e-9);
  EXPECT_NEAR(a.length_m[0], b.length_m[0], 1e-9);
  EXPECT_NEAR(a.amplitude, b.amplitude, 1e-15);
  EXPECT_LT((a.departure - image.normalized()).norm(), 1e-9) << "departs to the image, arrives from the object";
  EXPECT_LT((a.arrival - x.normalized()).norm(), 1e-9);
  EXPECT_LT((a.departure - b.arrival).norm() + (a.arrival - b.departure).norm(), 1e-12);
  // TX 1 sits four pitches to the left: its way to the image is shorter, its way to the object longer.
  const double step = paperRadar().tx_position_m[1].y();
  EXPECT_NEAR(a.length_m[4] - a.length_m[0], -step * image.normalized().y(), 2e-5);
  EXPECT_NEAR(b.length_m[4] - b.length_m[0], -step * x.normalized().y(), 2e-5);
  // Lambert's law between two directions, mirror of a conductor.
  const V n = V(0.1, 0.1, 0).cross(V(0, 0, 1)).normalized();
  const double cos_in = std::abs((image.normalized() - 2 * image.normalized().y() * V(0, 1, 0)).dot(n)),
               cos_out = std::abs(x.normalized().dot(n)), area = 0.1 * std::sqrt(2.0) * 0.1;
  const double expected = paperRadar().wavelength_m() / (4 * M_PI * x.norm() * image.norm()) * 0.6 *
                          std::sqrt(cos_in * cos_out * area / M_PI);
  EXPECT_NEAR(db(a.amplitude), db(expected), 0.3);
  EXPECT_NE(errorOf([&] { run("  wall_ghost: {walls: [nowhere]}\n"); }).find("nowhere"), std::string::npos);
}

TEST_F(Propagation, WhatEnclosesTheRoomIsNoGhostsObject) {
  const auto addRoom = [&] {
    addWall("mirror", "Metal", {-8, 4}, {8, 4}, -4, 4);
    addWall("behind", "RoughMetal", {8, -4}, {8, 4}, -4, 4);
  };
  addRoom();
  writeScene();
  EXPECT_TRUE(run("  wall_ghost: {walls: [mirror], spacing_m: 1}\n").records.empty());
  addRoom();
  addWall("object", "RoughMetal", {4, -1}, {4, -0.5}, -0.5, 0.5);
  writeScene();
  const Simulation s = run("  wall_ghost: {walls: [mirror], spacing_m: 1}\n");
  EXPECT_FALSE(s.records.empty());
  const Simulation more = run("  wall_ghost: {walls: [mirror], spacing_m: 1, gain_db: 6, edge_level: 3}\n");
  ASSERT_EQ(more.records.size(), s.records.size());
  for (std::size_t i = 0; i < s.records.size(); ++i) {
    const double more_db = db(more.records[i].amplitude / s.records[i].amplitude);
    EXPECT_TRUE(std::abs(more_db - 6) < 1e-9 || std::abs(more_db - db(3)) < 1e-9) << more_db;
  }
}

TEST_F(Propagation, AnEdgesGhostIsItsBistaticUtd) {
  addWall("mirror", "Metal", {-8, 2}, {8, 2}, -9, 9);
  addWall("screen", "Metal", {3, -1}, {4, -2}, -8, 8);
  writeScene();
  const Simulation s = run("  wall_ghost: {walls: [mirror]}\n");
  ASSERT_FALSE(s.records.empty());
  bool seen = false;
  for (const PathRecord& r : s.records) {
    if (r.reflection_cosine[0] < 0 || std::abs(r.vertices[1].x() - 3) > 1e-6) continue;
    const V x(3, -1, 0), image(3, 5, 0);
    EXPECT_NEAR(r.length_m[0], x.norm() + image.norm(), 1e-9);
    // |D| of a half plane far from its boundaries is 1/(2 sqrt(2 pi k)) |sec((phi-phi')/2) - sec((phi+phi')/2)|.
    const double face = -45 * kDegree, to_radar = std::atan2(1, -3),
                 from_image = std::atan2(5, -3);  // radar mirrored in y = 2 stands at (0, 4), seen from (3, -1)
    const double phi = to_radar - face, phi_in = from_image - face;
    const double k = 2 * M_PI / kLambda77_m, s1 = image.norm(), s2 = x.norm();
    const double D =
        std::abs(1 / std::cos((phi - phi_in) / 2) - 1 / std::cos((phi + phi_in) / 2)) / (2 * std::sqrt(2 * M_PI * k));
    EXPECT_NEAR(db(r.amplitude), db(kLambda77_m / (4 * M_PI) * D / std::sqrt(s1 * s2 * (s1 + s2))), 0.4);
    seen = true;
  }
  EXPECT_TRUE(seen);
}

TEST_F(Propagation, APanelLetsEchoesThroughTwiceWeakened) {
  addBox("panel", "Concrete", V(2, -1, -1), V(2.02, 1, 1));
  addWall("wall", "Metal", {4, -10}, {4, 10}, -5, 5);
  writeScene();
  const Simulation opaque = run("  specular: {}\n");
  ASSERT_EQ(opaque.records.size(), 1u);
  const Simulation clear = run("  specular: {}\n  transmission: {actor: panel, one_way_db: -3.5}\n");
  const auto first = of(clear, "specular", 1);
  ASSERT_EQ(first.size(), 2u) << "its own front, and the wall; not its back";
  EXPECT_NEAR(first[0].length_m[0], 4, 1e-9);
  EXPECT_NEAR(first[0].amplitude, opaque.records[0].amplitude, 1e-15);
  EXPECT_NEAR(first[1].length_m[0], 8, 1e-9);
  EXPECT_NEAR(db(first[1].amplitude), db(kLambda77_m / (4 * M_PI * 8)) - 7, 0.1);
  EXPECT_TRUE(clear.check.ok());
}

// What a parameter that says so only weighs: traced paths are another value's, too.
TEST_F(Propagation, ALevelOfTransmissionTracesNothingAnew) {
  addWall("panel", "Concrete", {2, -0.5}, {2, 0.5});
  addWall("wall", "Metal", {4, -3}, {4, 3});
  writeScene();
  for (const ParameterSpec& p : MechanismRegistry::instance().create("transmission")->parameters()) {
    EXPECT_EQ(p.name == "one_way_db", p.weighs) << p.name;
  }
  const std::string panel = "  specular: {}\n  diffuse: {}\n  transmission: {actor: panel, one_way_db: ";
  const Twin weak = makeTwin(path("scene.yaml"), panel + "-20}\n", radarAt77GHz());
  const Twin strong = makeTwin(path("scene.yaml"), panel + "-2}\n", radarAt77GHz());
  const Eigen::Isometry3d pose = radarPose(0, 0, 0);
  const Simulation traced = strong.simulate(pose), weighed = strong.weigh(pose, weak.trace(pose));
  ASSERT_GT(traced.records.size(), 2u);
  EXPECT_EQ(traced.records.size(), weighed.records.size());
  EXPECT_TRUE(traced.grid.x == weighed.grid.x);
  EXPECT_FALSE(traced.grid.x == weak.simulate(pose).grid.x);
}

// An upright metal cylinder: 2 pi r L^2/lambda far off, the mirror's level with sqrt(r/(r + R)) where it is tall.
TEST_F(Propagation, SomethingUnmodelledIsACylinder) {
  addWall("wall", "Metal", {9, -3}, {9, 3});
  writeScene();
  const std::string tall = "  actor_unmodelled: {x_m: 3.05, y_m: 0, size_m: 0.1, bottom_m: -40, height_m: 80}\n";
  const Simulation s = run(tall);
  ASSERT_EQ(s.records.size(), 1u);
  EXPECT_NEAR(s.records[0].length_m[0], 6, 1e-9);
  EXPECT_NEAR(db(s.records[0].amplitude), db(kLambda77_m / (4 * M_PI * 6) * std::sqrt(0.05 / 3.05)), 0.05);
  const Simulation small =
      run("  actor_unmodelled: {x_m: 9.01, y_m: 0, size_m: 0.02, bottom_m: -0.02, height_m: 0.04}\n");
  ASSERT_EQ(small.records.size(), 1u);
  const double sigma =
      std::pow(small.records[0].amplitude, 2) * std::pow(4 * M_PI, 3) * std::pow(9, 4) / (kLambda77_m * kLambda77_m);
  EXPECT_NEAR(10 * std::log10(sigma), 10 * std::log10(2 * M_PI * 0.01 * 0.04 * 0.04 / kLambda77_m), 0.1);
  // It hides the wall behind it.
  EXPECT_TRUE(of(run("  specular: {}\n" + tall), "specular").empty());
  EXPECT_EQ(of(run("  specular: {}\n  actor_unmodelled: {x_m: 3, y_m: 2, size_m: 0.1}\n"), "specular").size(), 1u);
}

// A box that a mechanism puts into the room does what the same box as an actor of the scene does, path by path.
TEST_F(Propagation, ABoxUnmodelledIsLikeOneInTheScene) {
  addWall("wall", "Metal", {4, -3}, {4, 3}, -2, 2);
  addWall("side", "Metal", {0.5, 2.5}, {6, 2.5}, -2, 2);
  writeScene();
  const std::string base = "  specular: {max_bounces: 2}\n  corner: {}\n  edge_diffraction: {level: 1}\n";
  const std::size_t without = run(base).records.size();
  const std::string box = "  actor_unmodelled: {shape: box, size_m: 0.4, bottom_m: -1, height_m: 2, ";
  const std::string square = box + "x_m: 2.2, y_m: 0.05, yaw_deg: 0}\n";
  const std::vector<PathRecord> put = run(base + square).records;
  // Facing: its face 2 m off, at the level of its image; nothing of the wall behind it.
  const auto facing = std::find_if(put.begin(), put.end(), [](const PathRecord& r) {
    return *r.event == "specular" && std::abs(r.length_m[0] - 4) < 1e-3;
  });
  ASSERT_NE(facing, put.end());
  EXPECT_EQ(facing->actors, PerInteraction<int>{-1});
  EXPECT_TRUE(std::none_of(put.begin(), put.end(), [](const PathRecord& r) {
    return *r.event == "specular" && std::abs(r.length_m[0] - 8) < 1e-3;
  }));
  // Turned, it sends its echo elsewhere: less than a hundredth of its power is left.
  for (const PathRecord& r : run("  specular: {max_bounces: 1}\n" + box + "x_m: 2.2, y_m: 0, yaw_deg: 30}\n").records) {
    EXPECT_TRUE(r.length_m[0] > 4.5 || r.amplitude < 0.1 * facing->amplitude) << r.length_m[0];
  }
  EXPECT_THROW(run(base + "  actor_unmodelled: {shape: ball, x_m: 2, y_m: 0, size_m: 0.4}\n"), InputError);

  addWall("wall", "Metal", {4, -3}, {4, 3}, -2, 2);
  addWall("side", "Metal", {0.5, 2.5}, {6, 2.5}, -2, 2);
  addBox("box", "Metal", V(2.0, -0.15, -1), V(2.4, 0.25, 1));
  writeScene();
  const std::vector<PathRecord> there = run(base).records;
  ASSERT_EQ(put.size(), there.size());
  EXPECT_NE(put.size(), without);
  const auto sorted = [](std::vector<PathRecord> records) {
    std::sort(records.begin(), records.end(), [](const PathRecord& a, const PathRecord& b) {
      return std::make_pair(a.length_m[0], a.departure.y()) < std::make_pair(b.length_m[0], b.departure.y());
    });
    return records;
  };
  const std::vector<PathRecord> a = sorted(put), b = sorted(there);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(*a[i].event, *b[i].event);
    EXPECT_NEAR(a[i].length_m[0], b[i].length_m[0], 1e-9);
    EXPECT_NEAR(a[i].amplitude, b[i].amplitude, 1e-9 * b[i].amplitude);
  }
}

TEST_F(Propagation, ACornerOfNamedActorsIsFoundAcrossAGap) {
  addWall("wall", "Metal", {4, -3}, {4, 3}, -2, 2);
  addBox("cabinet", "Metal", V(2.5, 1, -2), V(3.96, 2, 2));
  writeScene();
  EXPECT_TRUE(of(run("  corner: {}\n"), "corner").empty());
  const Simulation s = run("  corner: {}\n  corner_reflection: {actors: [cabinet, wall]}\n");
  const auto found = of(s, "corner_reflection");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT((found[0].vertices[0] - V(4, 1, 0)).norm(), 1e-9);
  EXPECT_NEAR(found[0].length_m[0], 2 * std::hypot(4, 1), 1e-9);
  // Where corner itself has it, it is not there twice.
  addWall("wall", "Metal", {4, -3}, {4, 3}, -2, 2);
  addBox("cabinet", "Metal", V(2.5, 1, -2), V(4, 2, 2));
  writeScene();
  const Simulation both = run("  corner: {}\n  corner_reflection: {actors: [cabinet, wall]}\n");
  EXPECT_EQ(of(both, "corner").size(), 1u);
  EXPECT_TRUE(of(both, "corner_reflection").empty());
}

TEST_F(Propagation, RoomAndMountStandWhereTheCausesSay) {
  addWall("wall", "Metal", {3, -10}, {3, 10}, -5, 5);
  writeScene();
  const auto look = [&](const std::string& m) { return run("  specular: {}\n" + m).records.at(0); };
  EXPECT_NEAR(look("  scene_registration: {x_m: 0.1, y_m: 0.3}\n").length_m[0], 6.2, 1e-9);
  const PathRecord turned = look("  scene_registration: {yaw_deg: 10}\n");
  EXPECT_NEAR(std::atan2(turned.departure.y(), turned.departure.x()) / kDegree, 10, 1e-9) << "the room turned left";
  EXPECT_NEAR(turned.length_m[0], 6, 1e-9);
  const PathRecord pitched = look("  radar_pitch_offset: {pitch_deg: 4}\n");
  EXPECT_NEAR(std::asin(pitched.departure.z()) / kDegree, 4, 1e-9) << "nose down: things stand higher";
  EXPECT_NEAR(db(look("  excess_attenuation: {db_per_m: 0.8}\n").amplitude / look("").amplitude), -2.4, 1e-9);
}

// A scan that is 1 % too small: a wall at distance d of map's origin stands at 1.01 d, the radar where it stood.
TEST_F(Propagation, AScaledSceneIsLargerAboutTheOrigin) {
  addWall("wall", "Metal", {3, -10}, {3, 10}, -5, 5);
  writeScene();
  const auto range = [&](const std::string& m, double x) {
    return makeTwin(path("scene.yaml"), "  specular: {}\n" + m).simulate(radarPose(x, 0, 0)).records.at(0).length_m[0] /
           2;
  };
  for (double x : {0.0, 1.0, -2.0}) {
    EXPECT_NEAR(range("  scene_scale: {scale: 0.01}\n", x), 3.03 - x, 1e-9);
    EXPECT_NEAR(range("  scene_scale: {scale: -0.2}\n", x), 2.4 - x, 1e-9);
    // The scale comes first, the shift is in true metres.
    EXPECT_NEAR(range("  scene_scale: {scale: 0.01}\n  scene_registration: {x_m: 0.1}\n", x), 3.13 - x, 1e-9);
  }
}

// A wall through (4, 0, 0.5) that leans: its normal is Rz(yaw) Ry(pitch) Rx(roll) e, its distance that of its middle
// along the normal.
TEST_F(Propagation, AnActorLeansAboutItsMiddle) {
  addWall("ahead", "Metal", {4, -3}, {4, 3}, -2.5, 3.5);
  addWall("left", "Metal", {-3, 5}, {3, 5}, -2.5, 3.5);
  writeScene();
  const auto look = [&](const std::string& values, double heading_deg) {
    const Simulation s =
        run("  specular: {max_bounces: 1}\n  actor_moved: {" + values + "}\n", radarPose(0, 0, 0, heading_deg));
    const int actor = heading_deg == 0 ? 0 : 1;
    for (const PathRecord& r : s.records) {
      if (r.actors[0] == actor) return r;
    }
    ADD_FAILURE() << values;
    return PathRecord();
  };
  const double a = 5 * kDegree;
  const PathRecord pitched = look("actor: ahead, dpitch_deg: 5, dz_m: 0.2, dx_m: 0.1", 0);
  EXPECT_NEAR(pitched.length_m[0] / 2, 4.1 * std::cos(a) - 0.7 * std::sin(a), 1e-9);
  EXPECT_NEAR(pitched.departure.z(), -std::sin(a), 1e-9);
  const PathRecord rolled = look("actor: left, droll_deg: 5, dz_m: -0.1", 90);
  EXPECT_NEAR(rolled.length_m[0] / 2, 5 * std::cos(a) + 0.4 * std::sin(a), 1e-9);
  EXPECT_NEAR(rolled.departure.z(), std::sin(a), 1e-9);
  const PathRecord turned = look("actor: ahead, dyaw_deg: 20, dpitch_deg: 5", 0);
  EXPECT_NEAR(std::atan2(turned.departure.y(), turned.departure.x()) / kDegree, 20, 1e-9);
  EXPECT_NEAR(std::asin(turned.departure.z()) / kDegree, -5, 1e-9);
  EXPECT_NEAR(look("actor: ahead, droll_deg: 30", 0).length_m[0] / 2, 4, 1e-9) << "a turn in its own plane";
}

// The echo of a square plate follows from its size over the Fresnel zone: a scaled plate is a larger plate farther
// away.
TEST_F(Propagation, AScaledSceneEqualsOneDrawnLarger) {
  addWall("plate", "Metal", {2, -0.03}, {2, 0.03}, -0.03, 0.03);
  addBox("cabinet", "Metal", V(1.5, 1, -2), V(2.5, 2, 2));
  writeScene();
  const Simulation scaled = run("  specular: {}\n  corner: {}\n  scene_scale: {scale: 0.25}\n");
  addWall("plate", "Metal", {2.5, -0.0375}, {2.5, 0.0375}, -0.0375, 0.0375);
  addBox("cabinet", "Metal", V(1.875, 1.25, -2.5), V(3.125, 2.5, 2.5));
  writeScene();
  const Simulation drawn = run("  specular: {}\n  corner: {}\n");
  ASSERT_EQ(scaled.records.size(), drawn.records.size());
  ASSERT_FALSE(drawn.records.empty());
  for (std::size_t i = 0; i < drawn.records.size(); ++i) {
    EXPECT_NEAR(scaled.records[i].length_m[0], drawn.records[i].length_m[0], 1e-9);
    EXPECT_NEAR(scaled.records[i].amplitude / drawn.records[i].amplitude, 1, 1e-9);
  }
}

// A radar that goes at v and turns at w while its poses are stamped late by L is ahead of them by vL and wL.
TEST_F(Propagation, PosesThatAreStampedLateShiftAMovingRadar) {
  addWall("wall", "Metal", {5, -20}, {5, 20}, -5, 5);
  writeScene();
  const double speed = 0.5, turn_deg_per_s = 20, lag_s = 0.08;
  std::vector<Pose> poses;
  for (int i = 0; i < 21; ++i) {
    Pose p;
    p.name = std::to_string(i);
    p.stamp_ns = i * 100000000LL + (i == 20 ? 3000000000LL : 0);  // the last one comes after a pause
    p.T_map_radar = radarPose(speed * 0.1 * i, 0.3, 0, turn_deg_per_s * 0.1 * i - 20);
    poses.push_back(p);
  }
  const auto path_at = [&](const std::string& mechanisms, std::size_t i) {
    Twin twin = makeTwin(path("scene.yaml"), "  specular: {}\n" + mechanisms, radarAt77GHz());
    twin.setSession(poses);
    EXPECT_EQ(twin.altersGeometry(), !mechanisms.empty());
    return twin.simulate(poses[i].T_map_radar, poses[i].stamp_ns).records.at(0);
  };
  const auto azimuth_deg = [](const PathRecord& r) { return std::atan2(r.departure.y(), r.departure.x()) / kDegree; };
  const std::string lag = "  pose_time_lag: {lag_s: 0.08}\n";
  const PathRecord reported = path_at("", 10), now = path_at(lag, 10);
  expectForm("range of a wall ahead, 0.5 m/s, poses 80 ms late", "m", 0.5 * reported.length_m[0] - speed * lag_s,
             0.5 * now.length_m[0], 1e-9);
  expectForm("its azimuth, 20 deg/s", "deg", azimuth_deg(reported) - turn_deg_per_s * lag_s, azimuth_deg(now), 1e-9);
  const PathRecord early = path_at("  pose_time_lag: {lag_s: -0.15}\n", 10);
  EXPECT_NEAR(early.length_m[0], reported.length_m[0] + 2 * speed * 0.15, 1e-9) << "across the pose before";
  EXPECT_NEAR(path_at(lag, 20).length_m[0], path_at("", 20).length_m[0], 1e-12) << "a standing radar shows nothing";
  EXPECT_NEAR(path_at(lag, 19).length_m[0], path_at("", 19).length_m[0], 1e-12) << "a pause is no motion";
  // What a trajectory says goes before the session's poses.
  Twin twin = makeTwin(path("scene.yaml"), "  specular: {}\n" + lag, radarAt77GHz());
  twin.setSession(poses);
  twin.setTrajectory([](std::int64_t stamp_ns) { return radarPose(1e-9 * static_cast<double>(stamp_ns), 0, 0); });
  EXPECT_NEAR(twin.simulate(radarPose(1, 0, 0), 1000000000).records.at(0).length_m[0], 2 * (4 - lag_s), 1e-9);
}

TEST_F(Propagation, CarrierScaleStretchesTheSine) {
  addWall("plate", "Metal", {4, 3}, {3.9, 3.2}, -0.05, 0.05);
  writeScene();
  const auto sine = [&](const std::string& m) {
    const PathRecord r =
        run("  diffuse_scattering: {material: Metal, scattering_coefficient: 0.5}\n  diffuse: {}\n" + m,
            radarPose(0, 0, 0), paperRadar())
            .records.at(0);
    return -(r.length_m[1] - r.length_m[0]) / paperRadar().rx_position_m[1].y();
  };
  EXPECT_NEAR(sine("  carrier_scale: {scale: 0.012}\n") / sine(""), 1.012, 1e-9);
}

TEST_F(Propagation, AnEmpiricalLawIsItsTable) {
  addWall("wall", "Metal", {3, -10}, {3, 10}, -5, 5);
  writeScene();
  const auto look = [&](const std::string& m, double yaw = 0) {
    return run("  specular: {}\n" + m, radarPose(0, 0, 1, yaw), paperRadar()).records.at(0);
  };
  const double base = look("").amplitude;
  EXPECT_NEAR(db(look("  empirical_law: {variable: range_m, at: [2, 4], gain_db: [0, -6]}\n").amplitude / base), -3,
              1e-9);
  EXPECT_NEAR(db(look("  empirical_law: {variable: range_m, at: [4, 5], gain_db: [-2, -6]}\n").amplitude / base), -2,
              1e-9);
  EXPECT_NEAR(
      db(look("  empirical_law: {variable: azimuth_deg, at: [-40, 0], gain_db: [-8, 0]}\n", 30).amplitude / base), -6,
      1e-6);
  EXPECT_NEAR(
      db(look("  empirical_law: {variable: incidence_deg, at: [0, 90], gain_db: [-1, -10]}\n").amplitude / base), -1,
      1e-9);
  EXPECT_NEAR(db(look("  empirical_law: {variable: height_m, at: [0, 2], gain_db: [0, 4]}\n").amplitude / base), 2,
              1e-9);
  EXPECT_NEAR(db(look("  empirical_law: {variable: heading_deg, at: [0, 30], gain_db: [0, 3]}\n", 10).amplitude / base),
              1, 1e-6);
  // The plate stands in map's +x: its echo arrives from there however the radar is turned.
  EXPECT_NEAR(
      db(look("  empirical_law: {variable: bearing_deg, at: [-10, 10], gain_db: [0, 5]}\n", 20).amplitude / base), 2.5,
      1e-6);
  // Half a metre beside the way there.
  EXPECT_NEAR(
      db(look("  empirical_law: {variable: passing_m, x_m: 1.5, y_m: 0.5, at: [0, 1], gain_db: [-8, 0]}\n").amplitude /
         base),
      -4, 1e-6);
  EXPECT_NEAR(look("  empirical_law: {variable: range_m, at: [0], delay_m: [0.04]}\n").length_m[0], 6.08, 1e-9);
  const PathRecord turned = look("  empirical_law: {variable: range_m, at: [0], angle_deg: [5]}\n", -20);
  EXPECT_NEAR(std::atan2(turned.departure.y(), turned.departure.x()) / kDegree, 25, 1e-9);
  EXPECT_NEAR(turned.length_m[1] - turned.length_m[0], -paperRadar().rx_position_m[1].y() * std::sin(25 * kDegree),
              1e-5);
  EXPECT_EQ(look("  empirical_law: {variable: range_m, at: [0], gain_db: [-9], event: diffuse}\n").amplitude, base);
  // Of two channels alone; the amplitude is the rms over all.
  const PathRecord plain = look("");
  const PathRecord second = look(
      "  empirical_law: {variable: range_m, at: [2, 4], gain_db: [0, -12], phase_deg: [0, 60], channels: [1, 5]}\n");
  for (std::size_t k = 0; k < plain.c.size(); ++k) {
    const Complex ratio = second.c[k] / plain.c[k];
    const bool of_it = k == 1 || k == 5;
    EXPECT_NEAR(db(std::abs(ratio)), of_it ? -6 : 0, 1e-9) << k;
    EXPECT_NEAR(std::arg(ratio) / kDegree, of_it ? 30 : 0, 1e-9) << k;
  }
  EXPECT_NEAR(second.amplitude / base, std::sqrt((6 + 2 * std::pow(10, -0.6)) / 8), 1e-12);
  for (const char* bad :
       {"{variable: colour, at: [0], gain_db: [0]}", "{variable: range_m, at: [1, 1], gain_db: [0, 0]}",
        "{variable: range_m, at: [0, 1], gain_db: [0]}", "{variable: range_m, at: [0]}",
        "{variable: range_m, at: [0], phase_deg: [1]}", "{variable: range_m, at: [0], delay_m: [0], channels: [1]}",
        "{variable: range_m, at: [0], phase_deg: [1], channels: [8]}",
        "{variable: range_m, at: [0], phase_deg: [1], channels: [0.5]}"}) {
    EXPECT_NE(errorOf([&] { look(std::string("  empirical_law: ") + bad + "\n"); }).find("empirical_law"),
              std::string::npos)
        << bad;
  }
}

TEST_F(Propagation, ClutterOnATableIsASumOfPointsThatEchoAlike) {
  addBox("table", "Concrete", {2.5, -0.4, -0.5}, {3.5, 0.4, -0.45});
  addWall("wall", "Metal", {8, -3}, {8, 3}, -2, 2);
  writeScene();
  const std::vector<PathRecord> found =
      of(run("  empirical_clutter: {actor: table, level_db: -20, spacing_m: 0.02}\n"), "empirical_clutter");
  EXPECT_EQ(found.size(), 50u * 40u);
  double power = 0, expected = 0;
  for (const PathRecord& r : found) {
    EXPECT_NEAR(r.vertices[0].z(), -0.4, 1e-9);  // things stand a little above the table
    power += r.amplitude * r.amplitude;
  }
  // The radar equation over the table's area, in strips of a centimetre.
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 80; ++j) {
      const double x = 2.505 + 0.01 * i, y = -0.395 + 0.01 * j, r2 = x * x + y * y + 0.4 * 0.4;
      expected += kLambda77_m * kLambda77_m * 0.01 * 1e-4 / (std::pow(4 * M_PI, 3) * r2 * r2);
    }
  }
  expectForm("power of clutter on a table", "sum lambda^2 sigma_0 dA/((4 pi)^3 r^4)", expected, power, 0.02 * expected);
  EXPECT_NE(errorOf([&] { run("  empirical_clutter: {actor: wall, level_db: -20}\n"); }).find("faces up"),
            std::string::npos);
}

TEST_F(Propagation, ALateEchoIsAPointFartherAway) {
  addWall("wall", "Metal", {8, -3}, {8, 3}, -2, 2);
  writeScene();
  const std::vector<PathRecord> found =
      of(run("  empirical_echo: {x_m: 3, y_m: 0, height_m: 0, rcs_dbsm: 0, behind_m: 1.5}\n"), "empirical_echo");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0].length_m[0], 9, 0.01);
  EXPECT_NEAR(found[0].arrival.x(), 1, 1e-3);
  // The radar equation of a square metre at 3 m, whatever the delay.
  expectForm("a late point's amplitude", "lambda sqrt(sigma)/((4 pi)^(3/2) r^2)",
             kLambda77_m / (std::pow(4 * M_PI, 1.5) * 9), found[0].amplitude, 1e-2 * found[0].amplitude);
  EXPECT_TRUE(of(run("  empirical_echo: {x_m: 9, y_m: 0, height_m: 0, rcs_dbsm: 0}\n"), "empirical_echo").empty());
}

TEST_F(Propagation, FacetsOfAPathAreThoseOfTheEditedScene) {
  addWall("side", "Metal", {0.5, 2.5}, {6, 2.5}, -2, 2);
  addWall("wall", "Metal", {4, -3}, {4, 3}, -2, 2);
  writeScene();
  const Twin twin =
      makeTwin(path("scene.yaml"),
               "  specular: {max_bounces: 2}\n  actor_absent: {actor: side}\n"
               "  actor_unmodelled: {shape: box, x_m: 2.2, y_m: 0, size_m: 0.4, bottom_m: -1, height_m: 2}\n");
  const Eigen::Isometry3d T_map_radar = radarPose(0, 0, 0);
  const Scene& scene = twin.tracedScene();
  int box = 0;
  for (const PathRecord& r : twin.trace(T_map_radar)) {
    for (std::size_t i = 0; i < r.facets.size(); ++i) {
      if (r.facets[i] < 0) continue;
      ASSERT_LT(r.facets[i], static_cast<int>(scene.facets.size()));
      const int actor = scene.facets[static_cast<std::size_t>(r.facets[i])].actor;
      EXPECT_EQ(actor < static_cast<int>(twin.scene().actors.size()) ? actor : -1, r.actors[i]);
      box += r.actors[i] < 0;
    }
    if (r.facets.empty() || r.facets[0] < 0 || r.actors[0] >= 0) continue;
    const LawVariable::Values foot = LawVariable("foot_m").of({scene, T_map_radar, 0, 1}, r);
    ASSERT_EQ(foot.count, 1);
    EXPECT_LE(std::abs(foot.value[0]), 0.2 + 1e-9);  // on the box's side
  }
  EXPECT_GT(box, 0);
  EXPECT_NE(&scene, &twin.scene());
  const Twin plain = makeTwin(path("scene.yaml"), "  specular: {max_bounces: 2}\n");
  EXPECT_EQ(&plain.tracedScene(), &plain.scene());
}

TEST_F(Propagation, LawVariablesReadPathAndSession) {
  Scene scene;
  Facet facet;
  facet.origin = facet.e1 = facet.e2 = Eigen::Vector3d::Zero();
  facet.normal = Eigen::Vector3d::UnitX();
  scene.facets = {facet};
  LawVariable::PathPlace where{scene, Eigen::Isometry3d::Identity(), 90, 0.5, 0.4};
  PathRecord record;
  record.amplitude = 0.05;
  record.bounces = 1;
  record.facets = {0};
  record.vertices = {{2, 2, 0}};
  record.departure = Eigen::Vector3d(1, 1, 0).normalized();
  record.arrival = Eigen::Vector3d::UnitX();
  const auto value = [&](const char* name) { return LawVariable(name).of(where, record); };
  EXPECT_DOUBLE_EQ(value("time_s").value[0], 90);
  EXPECT_NEAR(value("amplitude_db").value[0], -20, 1e-12);
  EXPECT_NEAR(value("total_power_db").value[0], 10 * std::log10(0.4) + 20 * std::log10(2.0), 1e-12);
  EXPECT_NEAR(value("incidence_deg").value[0], 45, 1e-9);  // of a scatter point
  ASSERT_EQ(value("azimuth_deg").count, 2);
  EXPECT_NEAR(value("azimuth_deg").value[0], 45, 1e-9);
  EXPECT_NEAR(value("azimuth_deg").value[1], 0, 1e-9);
  record.reflection_cosine = {0.5};
  EXPECT_NEAR(value("incidence_deg").value[0], 60, 1e-9);
  where.strongest_amplitude = 0;
  EXPECT_EQ(value("amplitude_db").count, 0);  // no session is known
  EXPECT_EQ(value("foot_m").count, 0);        // the face is no actor's
  scene.facets[0].actor = 0;
  scene.actors.resize(1);
  scene.actors[0].bounds.extend(Eigen::Vector3d(2, 1, 0));
  scene.actors[0].bounds.extend(Eigen::Vector3d(2, 2, 3));
  EXPECT_NEAR(value("foot_m").value[0], 0.5, 1e-9);
  where.T_map_radar.translation() = Eigen::Vector3d(3, 4, 1);
  EXPECT_NEAR(LawVariable("standing_m", {0, 0, 90}).of(where, record).value[0], 4, 1e-9);
  where.T_map_radar = Eigen::Isometry3d::Identity();
  EXPECT_NEAR(LawVariable("passing_m", {0, 3}).of(where, record).value[0], std::sqrt(4.5), 1e-9);
  EXPECT_NEAR(LawVariable("distance_m", {3, -4}).of(where, record).value[0], 5, 1e-12);
  EXPECT_NE(errorOf([] { LawVariable("colour"); }).find("time_s"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
