#include <algorithm>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "closed_form.h"
#include "rays/image_paths.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;
constexpr double kLambda77_m = kSpeedOfLight_m_per_s / 77e9;

class Paths : public SceneFiles {
 protected:
  /// Amplitude of a flat smooth surface's image, |Gamma| lambda/(4 pi 2R).
  static double imageLevel(double gamma, double R, double lambda) { return gamma * lambda / (4 * M_PI * 2 * R); }
  static double gammaTe(const Scene& scene, double cos_theta, double hz) {
    return std::abs(fresnel(scene.actors[0].material, cos_theta, hz).te);
  }
};

// Image method of a box room (all six walls): distinct images 6, 18 and 38 at orders 1, 2 and 3. At order 2 the images
// through two perpendicular walls (12 of 18) lie in edges, which are the corner's; the 6 through parallel walls remain.
TEST_F(Paths, AreTheImagesOfABoxRoom) {
  const V size(8, 6, 3), p(1.0137, 3.0291, 1.1173);
  addBox("room", "Metal", V::Zero(), size);
  const Scene scene = loadScene(writeScene(), 77e9);
  ASSERT_EQ(scene.facets.size(), 6u);
  const RayCaster rays(scene);
  const ImageSearch search(scene, true);
  const std::vector<ImagePath> paths = search.find(p, rays, {});
  std::vector<std::vector<double>> lengths(4);
  for (const ImagePath& path : paths) lengths[path.facets.size()].push_back((path.image - p).norm());
  // Expected from coordinates alone: image i -> x + mL (m even) or (m+1)L - x (m odd).
  std::vector<std::vector<double>> expected(4);
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      for (int k = -3; k <= 3; ++k) {
        const int order = std::abs(i) + std::abs(j) + std::abs(k);
        if (order < 1 || order > 3) continue;
        const int odd = (i & 1) + (j & 1) + (k & 1);
        if (odd > 1) continue;  // the line to such an image runs through an edge or a corner of the room
        V image;
        const int m[3] = {i, j, k};
        for (int a = 0; a < 3; ++a) image[a] = m[a] % 2 == 0 ? p[a] + m[a] * size[a] : (m[a] + 1) * size[a] - p[a];
        expected[order].push_back((image - p).norm());
      }
    }
  }
  for (int order = 1; order <= 3; ++order) {
    std::sort(lengths[order].begin(), lengths[order].end());
    std::sort(expected[order].begin(), expected[order].end());
    ASSERT_EQ(lengths[order].size(), expected[order].size()) << "order " << order;
    for (std::size_t i = 0; i < expected[order].size(); ++i) EXPECT_NEAR(lengths[order][i], expected[order][i], 1e-9);
  }
  for (int order = 1; order <= 3; ++order) {
    double worst = 0;
    for (std::size_t i = 0; i < expected[order].size(); ++i) {
      worst = std::max(worst, std::abs(lengths[order][i] - expected[order][i]));
    }
    expectForm("4.4 box room, images of order " + std::to_string(order) + " outside edges", "number",
               static_cast<double>(expected[order].size()), static_cast<double>(lengths[order].size()), 0);
    expectForm("4.4 their lengths, worst", "m", 0, worst, 1e-9);
  }
  EXPECT_EQ(lengths[1].size(), 6u);
  EXPECT_EQ(lengths[2].size(), 6u);
  EXPECT_EQ(lengths[3].size(), 30u) << "38 images less the 8 corners";
}

// Whatever the search leaves out early, it finds the sequences that solve() accepts of all that there are.
TEST_F(Paths, AreThoseOfAllSequencesThatExist) {
  std::mt19937 random(4);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<>(low, high)(random); };
  addBox("room", "Metal", V::Zero(), V(7, 5, 3));
  for (int i = 0; i < 8; ++i) {
    const Eigen::Quaterniond turn =
        Eigen::AngleAxisd(uniform(-M_PI, M_PI), V::UnitZ()) * Eigen::AngleAxisd(uniform(-0.2, 0.2), V::UnitY());
    addRectangle("panel_" + std::to_string(i), "Metal", V(uniform(1, 6), uniform(1, 4), uniform(0.2, 1)),
                 turn * V(0, uniform(0.5, 2), 0), turn * V(0, 0, uniform(0.5, 1.5)));
  }
  const Scene scene = loadScene(writeScene(), 77e9);
  const RayCaster rays(scene);
  const ImageSearch search(scene, true);
  const std::vector<int>& all = search.reflectors();
  std::size_t compared = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const V p(uniform(0.3, 6.7), uniform(0.3, 4.7), uniform(0.8, 1.4));
    ImageSearch::Limits limits;
    const double yaw_rad = uniform(-M_PI, M_PI);
    limits.forward = V(std::cos(yaw_rad), std::sin(yaw_rad), 0);
    limits.in_view = [&](const V& d) { return d.dot(limits.forward) > 0; };
    limits.max_length_m = trial % 3 == 0 ? 100 : 14;
    if (trial % 5 < 2) limits.wavelength_m = 4e-3;
    limits.only_actor = trial % 2 == 0 ? -1 : scene.facets[static_cast<std::size_t>(all[all.size() / 2])].actor;
    std::set<std::vector<int>> expected, found;
    ImagePath path;
    const auto tryOne = [&](const PerInteraction<int>& facets) {
      const auto wanted = [&](int f) { return scene.facets[static_cast<std::size_t>(f)].actor == limits.only_actor; };
      if (limits.only_actor >= 0 && std::none_of(facets.begin(), facets.end(), wanted)) return;
      if (search.solve(p, facets, rays, limits, path)) expected.insert({facets.begin(), facets.end()});
    };
    for (int a : all) {
      tryOne({a});
      for (int b : all) {
        if (b == a) continue;
        if (!perpendicular(scene.facets[static_cast<std::size_t>(a)], scene.facets[static_cast<std::size_t>(b)])) {
          tryOne({a, b});
        }
        for (int c : all) {
          if (c != b) tryOne({a, b, c});
        }
      }
    }
    for (const ImagePath& f : search.find(p, rays, limits)) found.insert({f.facets.begin(), f.facets.end()});
    EXPECT_EQ(found, expected) << "trial " << trial;
    compared += expected.size();
  }
  EXPECT_GT(compared, 100u);
}

// docs/reference/closed_forms.md 4.3: exact monostatic 10 cm plate at normal incidence, near field included.
TEST_F(Paths, OfAPlateHoldItsNearAndFarField) {
  const double rows[][2] = {{1, 5.61}, {2, 15.96}, {3, 17.77}, {5, 18.68}, {9.9, 19.06}};
  for (const auto& row : rows) {
    const double R = row[0];
    addWall("plate", "Metal", {R, -0.05}, {R, 0.05}, -0.05, 0.05);
    const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
    ASSERT_EQ(s.records.size(), 1u);
    // A^2 = lambda^2 sigma/((4 pi)^3 R^4)
    const double A = s.records[0].amplitude;
    const double sigma = A * A * std::pow(4 * M_PI, 3) * std::pow(R, 4) / (kLambda77_m * kLambda77_m);
    expectForm("4.3 plate of 10 cm at " + shortText(R) + " m", "dBsm", row[1], 10 * std::log10(sigma), 0.1);
  }
  // A wide plate near, a small one far: pi R^2 less its edges, and 4 pi A^2/lambda^2.
  const double others[][3] = {{1, 5, 17.85}, {0.05, 9.5, 7.14}};
  for (const auto& [a, R, expected] : others) {
    addWall("plate", "Metal", {R, -a / 2}, {R, a / 2}, -a / 2, a / 2);
    const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
    const double A = s.records.at(0).amplitude;
    expectForm("4.3 plate of " + shortText(100 * a) + " cm at " + shortText(R) + " m", "dBsm", expected,
               10 * std::log10(A * A * std::pow(4 * M_PI, 3) * std::pow(R, 4) / (kLambda77_m * kLambda77_m)), 0.1);
  }
}

TEST_F(Paths, OfATurnedPlateAreThoseOfAPolygon) {
  // The same plate as two facets' worth of triangles that are no rectangle in one piece: a cross-shaped outline.
  write("cross.obj",
        "o cross\nusemtl Metal\nv 3 -0.15 -0.05\nv 3 0.15 -0.05\nv 3 0.15 0.05\nv 3 -0.15 0.05\n"
        "v 3 -0.05 0.05\nv 3 0.05 0.05\nv 3 0.05 0.15\nv 3 -0.05 0.15\nf 1 2 3\nf 1 3 6\nf 1 6 5\nf 1 5 4\nf 5 6 7\nf "
        "5 7 8\n");
  write("cross.yaml", "meshes: [{file: cross.obj}]\nmaterials: materials.yaml\n");
  const Simulation whole =
      makeTwin(path("cross.yaml"), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(whole.records.size(), 1u);
  addWall("wide", "Metal", {3, -0.15}, {3, 0.15}, -0.05, 0.05);
  addWall("top", "Metal", {3, -0.05}, {3, 0.05}, 0.05, 0.15);
  const Simulation parts = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(parts.records.size(), 2u);
  // Amplitudes add at one distance; the part beside the foot comes from 5 cm higher, so phases are taken off.
  std::complex<double> sum = 0;
  for (const PathRecord& r : parts.records) {
    const double tau = r.length_m[0] / kSpeedOfLight_m_per_s;
    sum += r.c[0] * std::polar(1.0, -2 * M_PI * (77e9 * tau - 0.5 * 75e12 * tau * tau));
  }
  EXPECT_NEAR(db(std::abs(sum)), db(whole.records[0].amplitude), 1e-6);
}

TEST_F(Paths, OfAWideWallAreTheImageFormula) {
  addWall("wall", "RoughConcrete", {3, -25}, {3, 25}, -20, 20);  // edges add 1/(pi u sqrt 2) each
  const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(s.records.size(), 1u);
  EXPECT_NEAR(db(s.records[0].amplitude), db(imageLevel(0.3926 * std::sqrt(0.75), 3, kLambda77_m)), 0.05);
  EXPECT_NEAR(s.records[0].length_m[0], 6, 1e-9);
  EXPECT_EQ(s.records[0].range_bin, static_cast<int>(std::lround(3 / 0.15614)));
  // Gamma's phase enters conjugated: x = conj(Gamma) exp(+j 2 pi f tau) for a wide wall.
  Material concrete;
  concrete.relative_permittivity = 5.24;
  concrete.conductivity_s_per_m = 1.38;
  const double tau = 6 / kSpeedOfLight_m_per_s;
  const std::complex<double> expected =
      std::conj(fresnel(concrete, 1, 77e9).te) *
      std::polar(1.0, 2 * M_PI * (std::fmod(77e9 * tau, 1.0) - 0.5 * 75e12 * tau * tau));
  expectForm("4.5 phase of a concrete wall's echo against conj(Gamma) exp(j 2 pi f tau)", "deg", 0,
             std::arg(s.records[0].c[0] / expected) * 180 / M_PI, 1);
}

TEST_F(Paths, AreExactPerElement) {
  addWall("wall", "Metal", {3, -10}, {3, 10}, -5, 5);
  const RadarConfig radar = paperRadar();
  const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radar).simulate(radarPose(0, 0, 0, 20));
  ASSERT_EQ(s.records.size(), 1u);
  const Eigen::Isometry3d T = radarPose(0, 0, 0, 20);
  for (int t = 0; t < 2; ++t) {
    for (int r = 0; r < 4; ++r) {
      V tx = T * radar.tx_position_m[t];
      const V rx = T * radar.rx_position_m[r];
      tx.x() = 6 - tx.x();
      EXPECT_NEAR(s.records[0].length_m[4 * t + r], (tx - rx).norm(), 1e-12);
    }
  }
  EXPECT_NEAR(std::atan2(s.records[0].departure.y(), s.records[0].departure.x()), -20 * M_PI / 180, 1e-9);
}

TEST_F(Paths, BesideAFacetComeFromItsNearestPointAtTheImagesLevel) {
  // The wall ends 10 cm to the left of the foot: a known tail of one axis.
  addWall("wall", "Metal", {3, 0.1}, {3, 10}, -5, 5);
  const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(s.records.size(), 1u);
  EXPECT_LT((s.records[0].vertices[0] - V(3, 0.11, 0)).norm(), 1e-9);
  EXPECT_NEAR(s.records[0].length_m[0], 2 * std::hypot(3, 0.11), 1e-9);
  // |C + jS| tail at u = 2 * 0.1/sqrt(lambda R) = 1.8505, by numbers from Abramowitz and Stegun's auxiliary functions.
  const double u = 0.2 / std::sqrt(kLambda77_m * 3);
  const double f = (1 + 0.926 * u) / (2 + 1.792 * u + 3.104 * u * u),
               g = 1 / (2 + 4.142 * u + 3.492 * u * u + 6.670 * u * u * u);
  EXPECT_NEAR(s.records[0].amplitude / imageLevel(1, 3, kLambda77_m), std::hypot(f, g) / std::sqrt(2), 3e-3);
  // Two metres beside, the factor is below 0.01 and the return is dropped.
  EXPECT_TRUE(
      makeTwin(path("scene.yaml"), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, -2, 0)).records.empty());
}

TEST_F(Paths, StayInTheFieldOfViewAndTheRange) {
  addWall("ahead", "Metal", {3, -2}, {3, 2});
  addWall("behind", "Metal", {-3, -2}, {-3, 2});
  addWall("far", "Metal", {10.2, -5}, {10.2, -3});
  addRectangle("floor", "Metal", V(-9, -9, -1), V(20, 0, 0), V(0, 18, 0));
  Twin twin = makeTwin(writeScene(), "  specular: {max_bounces: 1}\n");
  EXPECT_EQ(twin.simulate(radarPose(0, 0, 0)).records.size(), 1u);
  EXPECT_EQ(twin.simulate(radarPose(0, -4, 0)).records.size(), 0u) << "10.2 m lies beyond N c/(2B)";
  EXPECT_EQ(twin.simulate(radarPose(0.3, -4, 0)).records.size(), 1u);
  // Looking up by 25 degrees the wall ahead leaves the field of view of +-20 degrees.
  const Eigen::Isometry3d up = radarPose(0, 0, 0) * Eigen::AngleAxisd(-25 * M_PI / 180, V::UnitY());
  EXPECT_TRUE(twin.simulate(up).records.empty());
}

// A wedge of 60 degrees around the radar's axis: both orders exist, with images of their own, s = 2 rho sin(60 deg).
TEST_F(Paths, OfTwoBouncesHaveTheWedgesGeometry) {
  const Eigen::Vector2d apex(4, 0), left(4 - 3.7 * std::cos(M_PI / 6), 3.7 * std::sin(M_PI / 6)),
      right(left.x(), -left.y());
  addWall("left", "Concrete", apex, left, -8, 8);
  addWall("right", "Concrete", apex, right, -8, 8);
  Twin twin = makeTwin(writeScene(), "  specular: {max_bounces: 2}\n  corner: {}\n", radarAt77GHz());
  const Simulation s = twin.simulate(radarPose(0, 0, 0));
  const auto two = of(s, "specular", 2);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_TRUE(of(s, "corner").empty());
  const double gamma = gammaTe(twin.scene(), std::cos(M_PI / 6), 77e9);
  for (const PathRecord& r : two) {
    EXPECT_NEAR(r.length_m[0], 8 * std::sin(M_PI / 3), 1e-9);
    const double side = r.facets[0] == 0 ? 1 : -1;
    EXPECT_NEAR(std::atan2(r.departure.y(), r.departure.x()), side * M_PI / 6, 1e-9);
    EXPECT_NEAR(std::atan2(r.arrival.y(), r.arrival.x()), -side * M_PI / 6, 1e-9);
    EXPECT_LT((r.vertices[0] - V(2, side * 2 / std::sqrt(3), 0)).norm(), 1e-9);
    EXPECT_NEAR(db(r.amplitude), db(gamma * gamma * kLambda77_m / (4 * M_PI * r.length_m[0])), 0.3);
  }
}

// Between parallel walls A-B-A counts, and A-B does not: it arrives from behind.
TEST_F(Paths, OfThreeBouncesRunToAndFro) {
  addWall("ahead", "Metal", {2, -5}, {2, 5}, -3, 3);
  addWall("behind", "Metal", {-1, -5}, {-1, 5}, -3, 3);
  const Simulation s = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(s.records.size(), 2u);
  EXPECT_NEAR(s.records[0].length_m[0], 4, 1e-9);
  EXPECT_EQ(s.records[1].bounces, 3);
  EXPECT_NEAR(s.records[1].length_m[0], 2 * (2 + 3), 1e-9);
  EXPECT_NEAR(db(s.records[1].amplitude), db(kLambda77_m / (4 * M_PI * 10)), 0.3);
}

// Fourth order comes from launched rays: enough of them find what twice as many find, and a few say that they are few.
TEST_F(Paths, OfLaunchedRaysSayWhetherTheyConverged) {
  addWall("ahead", "Metal", {4, -2}, {4, 3}, -3, 3);
  addWall("behind", "Metal", {-1.1, -2}, {-1.1, 3}, -3, 3);
  addWall("left", "Metal", {-1.1, 3}, {4, 3}, -3, 3);
  addWall("right", "Metal", {-1.1, -2.2}, {3.9, -2}, -3, 3);
  const std::string scene = writeScene();
  const auto look = [&](int budget) {
    const Twin twin = makeTwin(scene, "  specular: {max_bounces: 5, ray_budget: " + std::to_string(budget) + "}\n");
    EXPECT_TRUE(twin.notes().empty()) << "nothing was launched yet";
    std::set<PerInteraction<int>> paths;
    for (const PathRecord& r : twin.simulate(radarPose(0.3, 0.4, 0, 25)).records) {
      EXPECT_TRUE(paths.insert(r.facets).second) << "each sequence once";
    }
    return std::make_pair(paths, twin.notes().empty() ? std::string() : twin.notes().back());
  };
  const auto few = look(16), enough = look(4000), twice = look(8000);
  EXPECT_NE(enough.second.find("half as many"), std::string::npos) << enough.second;
  EXPECT_EQ(enough.first, twice.first);
  EXPECT_LT(few.first.size(), enough.first.size());
  EXPECT_GT(std::count_if(enough.first.begin(), enough.first.end(), [](const auto& p) { return p.size() > 3; }), 0);
  EXPECT_NE(few.second.find("raise ray_budget"), std::string::npos) << few.second;
}

class Corners : public Paths {
 protected:
  // Faces of 3 m from an edge at (4, 0), 45 degrees to both sides of the axis; towards the radar (concave) or away.
  void addFaces(double towards, double angle_deg = 90, double length = 3, double height = 3) {
    const double h = 0.5 * angle_deg * M_PI / 180;
    const Eigen::Vector2d apex(4, 0);
    addWall("left", "Concrete", apex, apex + length * Eigen::Vector2d(-towards * std::cos(h), std::sin(h)), -height,
            height);
    addWall("right", "Concrete", apex, apex + length * Eigen::Vector2d(-towards * std::cos(h), -std::sin(h)), -height,
            height);
  }
};

TEST_F(Corners, AreTheImageFormulaOnce) {
  addFaces(1);
  Twin twin = makeTwin(writeScene(), "  specular: {}\n  corner: {}\n", radarAt77GHz());
  const Simulation s = twin.simulate(radarPose(0, 0, 0));
  ASSERT_EQ(of(s, "corner").size(), 1u) << "both orders are one image";
  EXPECT_TRUE(of(s, "specular", 2).empty());
  EXPECT_EQ(of(s, "specular", 1).size(), 2u) << "the feet on both faces, 2.83 m from the edge";
  const PathRecord r = of(s, "corner")[0];
  EXPECT_EQ(r.bounces, 2);
  EXPECT_NEAR(r.length_m[0], 8, 1e-9);
  const double gamma = gammaTe(twin.scene(), std::sqrt(0.5), 77e9);
  expectForm("4.4 concrete corner, image formula", "dB", db(gamma * gamma * kLambda77_m / (4 * M_PI * 8)),
             db(r.amplitude), 0.3);
}

// In a room of four mirrors there is an image of the radar for each pair of numbers (m, n). Where both are odd, its
// line runs through an edge: the corner itself at (1, 1), corners seen in other walls beyond.
TEST_F(Corners, AreSeenInOtherWalls) {
  const double length = 5, width = 4, x = 1.1, y = 1.37, heading_deg = 108.5;
  addWall("south", "Metal", {0, 0}, {length, 0}, -30, 30);
  addWall("east", "Metal", {length, 0}, {length, width}, -30, 30);
  addWall("north", "Metal", {length, width}, {0, width}, -30, 30);
  addWall("west", "Metal", {0, width}, {0, 0}, -30, 30);
  const std::string scene = writeScene();
  const auto recordsOf = [&](int bounces) {
    std::vector<PathRecord> retro;
    const Twin twin = makeTwin(scene, "  specular: {max_bounces: " + std::to_string(bounces) + "}\n", radarAt77GHz());
    for (const PathRecord& r : twin.simulate(radarPose(x, y, 0, heading_deg)).records) {
      if (r.bounces % 2 == 0 && (r.departure - r.arrival).norm() < 1e-9) retro.push_back(r);
    }
    return retro;
  };
  const auto imageAt = [](int number, double at, double size) {  // in the walls at 0 and at `size`
    return number % 2 == 0 ? number * size + at : (number + 1) * size - at;
  };
  const Eigen::Vector2d ahead(std::cos(heading_deg * M_PI / 180), std::sin(heading_deg * M_PI / 180));
  std::size_t expected = 0;
  const std::vector<PathRecord> found = recordsOf(6);
  for (int m = -5; m <= 5; m += 2) {
    for (int n = -5; n <= 5; n += 2) {
      const int order = std::abs(m) + std::abs(n);
      const Eigen::Vector2d way(imageAt(m, x, length) - x, imageAt(n, y, width) - y);
      if (order < 4 || order > 6 || way.dot(ahead) <= 0 || way.norm() > 20) continue;
      ++expected;
      const auto same = [&](const PathRecord& r) {
        return r.bounces == order && std::abs(r.length_m[0] - way.norm()) < 1e-6;
      };
      ASSERT_EQ(std::count_if(found.begin(), found.end(), same), 1) << m << ", " << n;
      const PathRecord& r = *std::find_if(found.begin(), found.end(), same);
      EXPECT_NEAR(db(r.amplitude), db(kLambda77_m / (4 * M_PI * way.norm())), 0.3) << m << ", " << n;
      const double azimuth_deg = std::remainder(std::atan2(way.y(), way.x()) * 180 / M_PI - heading_deg, 360.0);
      EXPECT_NEAR(std::atan2(r.departure.y(), r.departure.x()) * 180 / M_PI, azimuth_deg, 1e-6);
    }
  }
  EXPECT_GE(expected, 4u);
  EXPECT_EQ(found.size(), expected);
  EXPECT_TRUE(recordsOf(3).empty()) << "three bounces see no corner in a wall";
}

TEST_F(Corners, HaveOneApertureFromFarEndToFarEnd) {
  addFaces(1, 90, 0.1, 20);
  Twin twin = makeTwin(writeScene(), "  corner: {}\n", radarAt77GHz());
  const Simulation s = twin.simulate(radarPose(0, 0, 0));
  ASSERT_EQ(s.records.size(), 1u);
  const double gamma = gammaTe(twin.scene(), std::sqrt(0.5), 77e9);
  // Half width across the ray 0.1 sin 45: u = 2x/sqrt(lambda R), [C - jS](u) from a plain sum.
  const double u = 2 * 0.1 * std::sqrt(0.5) / std::sqrt(kLambda77_m * 4);
  std::complex<double> integral = 0;
  const int steps = 200000;
  for (int i = 0; i < steps; ++i) {
    const double t = u * (i + 0.5) / steps;
    integral += std::polar(u / steps, -0.5 * M_PI * t * t);
  }
  const double factor = std::abs(2.0 * integral / std::complex<double>(1, -1));
  EXPECT_NEAR(db(s.records[0].amplitude), db(factor * gamma * gamma * kLambda77_m / (4 * M_PI * 8)), 0.05);
}

// A face of 20 cm and one that ends 3 cm from the edge: what meets the wide one farther out leaves beside the narrow
// one.
TEST_F(Corners, AreAsWideAsTheirNarrowerFace) {
  const double narrow_m = 0.03, wide_m = 0.2, s = std::sqrt(0.5);
  addWall("narrow", "Metal", {4, 0}, {4 - narrow_m * s, narrow_m * s}, -20, 20);
  addWall("wide", "Metal", {4, 0}, {4 - wide_m * s, -wide_m * s}, -20, 20);
  const Simulation found =
      makeTwin(writeScene(), "  corner: {knife_edges: 1}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
  ASSERT_EQ(found.records.size(), 1u);
  const double u = 2 * narrow_m * s / std::sqrt(kLambda77_m * 4);
  std::complex<double> integral = 0;
  const int steps = 20000;
  for (int i = 0; i < steps; ++i) {
    const double t = u * (i + 0.5) / steps;
    integral += std::polar(u / steps, -0.5 * M_PI * t * t);
  }
  expectForm("4.3 corner whose one face ends 3 cm from the edge", "dB",
             db(std::abs(2.0 * integral / std::complex<double>(1, -1)) * kLambda77_m / (4 * M_PI * 8)),
             db(found.records[0].amplitude), 0.3);
}

TEST_F(Corners, AreNotConvexEdges) {
  addFaces(-1);
  EXPECT_TRUE(makeTwin(writeScene(), "  specular: {}\n  corner: {}\n", radarAt77GHz())
                  .simulate(radarPose(0, 0, 0))
                  .records.empty());
}

TEST_F(Corners, AreWithinATenthOfADegree) {
  for (const auto& [angle, corners] :
       std::vector<std::pair<double, std::size_t>>{{90.08, 1}, {89.92, 1}, {90.5, 0}, {89.5, 0}}) {
    addFaces(1, angle);
    const Simulation s =
        makeTwin(writeScene(), "  specular: {}\n  corner: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0));
    EXPECT_EQ(of(s, "corner").size(), corners) << angle;
    // Sharper than a right angle the ordinary images of both orders exist, wider they do not.
    EXPECT_EQ(of(s, "specular", 2).size(), angle == 89.5 ? 2u : 0u) << angle;
  }
}

TEST_F(Corners, AreFoundWhereAFaceMeetsAWallInItsMiddle) {
  addWall("wall", "Concrete", {4, -3}, {4, 3});
  addWall("fin", "Metal", {3.4, 1}, {4, 1}, -1, 1);
  const Simulation s = makeTwin(writeScene(), "  corner: {}\n", radarAt77GHz()).simulate(radarPose(1, 0, 0));
  ASSERT_EQ(s.records.size(), 1u) << "the side of the fin that faces the radar";
  EXPECT_LT((s.records[0].vertices[0] - V(4, 1, 0)).norm(), 1e-9);
}

class DiffuseTest : public Paths {};

// Power sum of all patches against the integral of (lambda/4 pi)^2 S^2 cos^2/(pi r^4) over the wall.
TEST_F(DiffuseTest, ReturnsTheIntegralOfItsLaw) {
  addWall("wall", "RoughMetal", {3, -3}, {3, 3}, -1, 1);
  Twin twin = makeTwin(writeScene(), "  diffuse: {spacing_m: 0.05}\n", radarAt77GHz());
  const Simulation s = twin.simulate(radarPose(0, 0, 0));
  double power = 0;
  for (const PathRecord& r : s.records) power += r.amplitude * r.amplitude;
  double expected = 0;
  const double h = 0.002;
  for (double y = -3 + h / 2; y < 3; y += h) {
    for (double z = -1 + h / 2; z < 1; z += h) {
      const double r2 = 9 + y * y + z * z;
      expected += h * h * 9 / (r2 * r2 * r2);
    }
  }
  expected *= std::pow(kLambda77_m / (4 * M_PI), 2) * 0.36 / M_PI;
  expectForm("4.8 Lambert wall of 6 by 2 m at 3 m, its integral", "dB", 10 * std::log10(expected),
             10 * std::log10(power), 0.03);
  EXPECT_EQ(s.records.size(), 120u * 40u);
}

TEST_F(DiffuseTest, SumsThePowerOfCells) {
  addWall("wall", "RoughMetal", {3.1, -3}, {3.1, 3}, -1, 1);
  Twin twin = makeTwin(writeScene(), "  diffuse: {spacing_m: 0.05}\n", radarAt77GHz());
  const Eigen::Isometry3d T = radarPose(0, 0, 0);
  const auto left = [](const V& p) { return static_cast<char>(p.y() > 0.11); };
  const auto sides = [&](const std::vector<V>& points) {
    std::vector<char> side;
    for (const V& p : points) side.push_back(left(p));
    return side;
  };
  const ScatterCells cells{T, 0.1, 0.07, 0.2, sides};
  using Cell = std::tuple<int, int, int, char>;
  const auto powers = [&](const std::vector<PathRecord>& records) {
    std::map<Cell, std::pair<double, int>> sum;
    for (const PathRecord& r : records) {
      const V p = r.vertices[0], u = p.normalized();
      auto& [power, count] =
          sum[{static_cast<int>(std::floor(p.norm() / 0.1)), static_cast<int>(std::floor(u.y() / 0.07)),
               static_cast<int>(std::floor(u.z() / 0.2)), left(p)}];
      power += r.amplitude * r.amplitude;
      ++count;
    }
    return sum;
  };
  const auto expected = powers(twin.trace(T)), found = powers(twin.trace(T, 0, &cells));
  ASSERT_GT(expected.size(), 100u);
  EXPECT_EQ(found.size(), expected.size());
  for (const auto& [cell, sum] : expected) {
    EXPECT_NEAR(found.at(cell).first, sum.first, 1e-9 * sum.first);
    EXPECT_EQ(found.at(cell).second, 1) << "one path a cell";
  }
}

TEST_F(DiffuseTest, KeepsItsPhasesAtItsPoints) {
  addWall("wall", "RoughMetal", {3, -3}, {3, 3}, -1, 1);
  Twin twin = makeTwin(writeScene(), "  diffuse: {}\n");
  const auto phaseAtPoint = [&twin](const PathRecord& r) {
    const double tau = r.length_m[0] / kSpeedOfLight_m_per_s;
    return std::arg(r.c[0] *
                    std::polar(1.0, -2 * M_PI * (twin.radar().center_frequency_hz() * tau - 0.5 * 75e12 * tau * tau)));
  };
  const Simulation a = twin.simulate(radarPose(0, 0, 0)), b = twin.simulate(radarPose(0.5, 0.2, 0.1, 10));
  int common = 0;
  for (const PathRecord& p : a.records) {
    for (const PathRecord& q : b.records) {
      if ((p.vertices[0] - q.vertices[0]).norm() > 1e-12) continue;
      EXPECT_NEAR(std::remainder(phaseAtPoint(p) - phaseAtPoint(q), 2 * M_PI), 0, 1e-6);
      ++common;
    }
  }
  EXPECT_GT(common, 500);
  Twin other(loadTwin(path("twin.yaml"), path("scene.yaml"), paperRadar()), 2);
  EXPECT_GT(std::abs(phaseAtPoint(a.records[0]) - phaseAtPoint(other.simulate(radarPose(0, 0, 0)).records[0])), 1e-6);
}

// Degli-Esposti's directive lobe scatters the same total as Lambert's; straight back at normal incidence it is
// pi/F_alpha(0) stronger in power, F_4(0) = 2.4348.
TEST_F(DiffuseTest, HasADirectiveLobe) {
  addWall("patch", "RoughMetal", {3, -0.05}, {3, 0.05}, -0.05, 0.05);
  const std::string scene = writeScene();
  const auto level = [&](const std::string& lobe) {
    return makeTwin(scene, "  diffuse: {lobe: " + lobe + "}\n", radarAt77GHz())
        .simulate(radarPose(0, 0, 0))
        .records.at(0)
        .amplitude;
  };
  EXPECT_NEAR(db(level("directive") / level("lambertian")), 10 * std::log10(M_PI / 2.4348), 0.02);
  // F_alpha of docs/reference/closed_forms.md 4.8 at 0 and 45 deg: straight back the lobe has cos^(2 alpha) where
  // Lambert's has cos.
  const double rows[][3] = {{1, 4.7124, 4.2523}, {4, 2.4348, 2.1591}, {10, 1.1419, 1.0965}, {30, .4054, .4049}};
  const double s = std::sqrt(0.5);
  // So small that it is nothing where in it its one point lies.
  const double half_m = 0.001;
  addWall("patch", "RoughMetal", {3 - half_m * s, -half_m * s}, {3 + half_m * s, half_m * s}, -half_m, half_m);
  const std::string turned = writeScene("turned");
  const auto turnedLevel = [&](const std::string& lobe) {
    return makeTwin(turned, "  diffuse: {lobe: " + lobe + "}\n", radarAt77GHz())
        .simulate(radarPose(0, 0, 0))
        .records.at(0)
        .amplitude;
  };
  for (const auto& [alpha, straight, slanted] : rows) {
    const std::string lobe = "directive, alpha: " + shortText(alpha);
    expectForm("4.8 directive lobe, alpha " + shortText(alpha) + ", 0 deg, over Lambert's", "dB",
               10 * std::log10(M_PI / straight), db(level(lobe) / level("lambertian")), 0.05);
    expectForm("4.8 directive lobe, alpha " + shortText(alpha) + ", 45 deg, over Lambert's", "dB",
               10 * std::log10(M_PI * std::pow(0.5, alpha) / (slanted * s)),
               db(turnedLevel(lobe) / turnedLevel("lambertian")), 0.05);
  }
}

}  // namespace
}  // namespace mmradartwin
