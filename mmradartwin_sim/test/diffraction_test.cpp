#include <complex>

#include "closed_form.h"
#include "edges/diffracting_edge.h"
#include "edges/wedge_diffraction.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;
using V = Eigen::Vector3d;
constexpr double kWavenumber77 = 2 * M_PI * 77e9 / kSpeedOfLight_m_per_s;
constexpr double kDegree = M_PI / 180;

// Kouyoumjian and Pathak 1974, fig. 6: magnitude and phase of the transition function.
TEST(Transition, HasItsTabulatedValues) {
  const double rows[][3] = {{.01, .1637, 40.632}, {.1, .4364, 32.494}, {.3, .6335, 25.524},
                            {1, .8422, 16.005},   {3, .9565, 7.967},   {10, .9942, 2.788}};
  for (const auto& row : rows) {
    expectForm("4.6 abs F(" + shortText(row[0]) + ")", "1", row[1], std::abs(transitionFunction(row[0])), 1e-4);
    expectForm("4.6 arg F(" + shortText(row[0]) + ")", "deg", row[2], std::arg(transitionFunction(row[0])) / kDegree,
               2e-3);
  }
  EXPECT_NEAR(std::abs(transitionFunction(999.9) - transitionFunction(1000.1)), 0, 1e-6) << "the series joins";
}

/// Plane wave from phi_in on a wedge of exterior angle n pi, unit wavenumber: total field at (rho, phi); gamma -1 soft,
/// +1 hard.
Complex totalField(double n, double rho, double phi_deg, double phi_in_deg, double gamma) {
  const double phi = phi_deg * kDegree, phi_in = phi_in_deg * kDegree;
  Complex total = wedgeCoefficient({n, phi, phi_in, rho, 1}, 1, gamma, gamma) * std::polar(1 / std::sqrt(rho), -rho);
  if (phi < M_PI + phi_in) total += std::polar(1.0, rho * std::cos(phi - phi_in));
  if (phi < M_PI - phi_in) total += gamma * std::polar(1.0, rho * std::cos(phi + phi_in));
  if (phi > (2 * n - 1) * M_PI - phi_in) total += gamma * std::polar(1.0, rho * std::cos(2 * n * M_PI - phi - phi_in));
  return total;
}

// Sommerfeld's exact half plane, phi' = 60 deg, k rho = 20: |soft| and |hard|.
TEST(Wedge, IsSommerfeldsHalfPlane) {
  const double rows[][3] = {{30, 1.399526, 1.402524}, {90, 2.114831, .243393}, {180, 1.059370, 1.000000},
                            {239, .488427, .559295},  {240, .464388, .538184}, {241, .441478, .517881},
                            {270, .117994, .209353},  {330, .016837, .109136}};
  for (const auto& row : rows) {
    // On the boundary itself the optical field jumps by as much as the diffracted one; the mean of both sides is exact.
    const auto size = [&](double gamma) {
      return row[0] == 240
                 ? std::abs(0.5 * (totalField(2, 20, 240 - 1e-4, 60, gamma) + totalField(2, 20, 240 + 1e-4, 60, gamma)))
                 : std::abs(totalField(2, 20, row[0], 60, gamma));
    };
    expectForm("4.6 half plane at " + shortText(row[0]) + " deg, soft", "1", row[1], size(-1), 2e-6);
    expectForm("4.6 half plane at " + shortText(row[0]) + " deg, hard", "1", row[2], size(1), 2e-6);
  }
}

TEST(Wedge, IsContinuousAtBothShadowBoundaries) {
  for (double n : {2.0, 1.5, 1.7}) {
    for (double gamma : {-1.0, 1.0, -0.4}) {
      for (double boundary : {120.0, 240.0}) {
        const Complex below = totalField(n, 20, boundary - 5e-4, 60, gamma);
        expectForm("4.6 step at " + shortText(boundary) + " deg, n " + shortText(n) + ", face " + shortText(gamma), "1",
                   0, std::abs(totalField(n, 20, boundary + 5e-4, 60, gamma) - below), 1e-3);
      }
    }
  }
  // The other face's reflection: source at 200 deg lights face n of a right-angled wedge, boundary at 2 n 180 - 380.
  for (double gamma : {-1.0, 1.0}) {
    EXPECT_LT(std::abs(totalField(1.5, 20, 160 - 5e-4, 200, gamma) - totalField(1.5, 20, 160 + 5e-4, 200, gamma)),
              1e-3);
  }
}

// Equivalent radar cross-section of a long 90 deg edge at 2 m, dBsm: sigma = 4 pi R^4 |D|^2/(2 R^3).
TEST(Wedge, HasTheMonostaticLevelsOfABoxEdge) {
  const double rows[][3] = {{100, -18.2, -20.4}, {135, -25.3, -31.3}, {60, -35.6, -27.2}}, R = 2;
  for (const auto& row : rows) {
    const auto level = [&](double gamma) {
      const Complex D =
          wedgeCoefficient({1.5, row[0] * kDegree, row[0] * kDegree, R / 2, 1}, kWavenumber77, gamma, gamma);
      return 10 * std::log10(4 * M_PI * R * std::norm(D) / 2);
    };
    expectForm("4.6 box edge at 2 m, " + shortText(row[0]) + " deg, soft", "dBsm", row[1], level(-1), 0.06);
    expectForm("4.6 box edge at 2 m, " + shortText(row[0]) + " deg, hard", "dBsm", row[2], level(1), 0.06);
  }
}

class EdgeTest : public SceneFiles {
 protected:
  /// A metal box of 1 m turned by yaw, its nearest upright edge at (3, 0), -2 to 2 m high.
  std::string boxScene(double yaw_deg) {
    const double a = yaw_deg * kDegree;
    const Eigen::Vector2d u(std::cos(a), std::sin(a)), v(-std::sin(a), std::cos(a));
    const Eigen::Vector2d c0(3, 0), c1 = c0 + u, c2 = c0 + u + v, c3 = c0 + v;
    std::ostringstream obj;
    obj << "o box\nusemtl Metal\n" << std::setprecision(12);
    for (double z : {-2.0, 2.0}) {
      for (const auto& c : {c0, c1, c2, c3}) obj << "v " << c.x() << " " << c.y() << " " << z << "\n";
    }
    obj << "f 1 2 3\nf 1 3 4\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 "
           "8\n";
    write("box.obj", obj.str());
    write("box.yaml", "meshes: [{file: box.obj}]\nmaterials: materials.yaml\n");
    return path("box.yaml");
  }
};

// The whole mechanism on the box edge of docs/reference/closed_forms.md 4.6: the level of an infinite edge, vertical
// field along it.
TEST_F(EdgeTest, OfABoxHasTheClosedFormsLevel) {
  for (const auto& [phi_deg, dbsm] : std::vector<std::pair<double, double>>{{100, -18.2}, {135, -25.3}}) {
    // The radar looks from 180 deg, one face lies at yaw + 90 deg: phi = 90 - yaw.
    const Twin twin = makeTwin(boxScene(90 - phi_deg), "  edge_diffraction: {level: 1}\n", radarAt77GHz());
    Eigen::Isometry3d pose = radarPose(1, 0, 0);
    const Simulation s = twin.simulate(pose);
    const PathRecord* nearest = nullptr;
    for (const PathRecord& r : s.records) {
      if ((r.vertices[0] - V(3, 0, 0)).norm() < 1e-6) nearest = &r;
    }
    ASSERT_NE(nearest, nullptr) << phi_deg;
    const double R = 2, lambda = twin.radar().wavelength_m();
    const double sigma = std::pow(nearest->amplitude, 2) * std::pow(4 * M_PI, 3) * std::pow(R, 4) / (lambda * lambda);
    EXPECT_NEAR(10 * std::log10(sigma), dbsm, 0.25) << "edge ends at 2 m add ripples";
    EXPECT_NEAR(nearest->length_m[0], 4, 1e-9);
    EXPECT_EQ(nearest->bounces, 1);
    EXPECT_EQ(*nearest->event, "edge_diffraction");
    // The conjugate of exp(-jkL)'s coefficient at the path's phase; the soft coefficient acts on the field's sign.
    const Complex D = wedgeCoefficient({1.5, phi_deg * kDegree, phi_deg * kDegree, R / 2, 1}, kWavenumber77, -1, -1);
    const double tau = 4 / kSpeedOfLight_m_per_s;
    const Complex expected = std::conj(D) * std::polar(1.0, 2 * M_PI * (77e9 * tau - 0.5 * 75e12 * tau * tau));
    EXPECT_NEAR(std::arg(nearest->c[0] / expected), 0, 0.05) << phi_deg;
  }
}

TEST_F(EdgeTest, IsSeenFromAllHeadingsButNeverWithAFacetThatHoldsIt) {
  Twin twin = makeTwin(boxScene(-45), "  specular: {}\n  edge_diffraction: {level: 1}\n");
  // Faces at 45 deg: no specular from here, the corner towards the radar and the two side corners are seen.
  const Simulation tilted = twin.simulate(radarPose(1, 0, 0));
  EXPECT_TRUE(of(tilted, "specular").empty());
  EXPECT_EQ(of(tilted, "edge_diffraction").size(), 3u);
  // One face square on: its specular return holds its two edges.
  Twin square = makeTwin(boxScene(0), "  specular: {}\n  edge_diffraction: {level: 1}\n");
  const Simulation facing = square.simulate(radarPose(1, 0.5, 0));
  EXPECT_EQ(of(facing, "specular", 1).size(), 1u);
  EXPECT_TRUE(of(facing, "edge_diffraction").empty());
  // Half the level, half the amplitude.
  const Simulation weak =
      makeTwin(path("box.yaml"), "  edge_diffraction: {level: 0.5}\n").simulate(radarPose(1, 0.5, 0));
  const Simulation full = makeTwin(path("box.yaml"), "  edge_diffraction: {level: 1}\n").simulate(radarPose(1, 0.5, 0));
  ASSERT_EQ(weak.records.size(), full.records.size());
  ASSERT_FALSE(weak.records.empty());
  EXPECT_NEAR(weak.records[0].amplitude / full.records[0].amplitude, 0.5, 1e-12);
}

// Beside an open plate its return goes over from the aperture's tail into the rim's diffraction: the same law.
TEST_F(EdgeTest, TakesOverWhereTheApertureLeavesOff) {
  addWall("plate", "Metal", {3, 0}, {3, 4}, -3, 3);
  const std::string scene = writeScene();
  Twin both = makeTwin(scene, "  specular: {}\n  edge_diffraction: {level: 1}\n");
  double held = 0, taken = 0, at = 0;
  for (double y = -0.3; y > -1.5 && taken == 0; y -= 0.005) {
    const Simulation s = both.simulate(radarPose(0, y, 0));
    double near_edge = 0;
    for (const PathRecord& r : of(s, "edge_diffraction")) {
      if (std::abs(r.vertices[0].y()) < 1e-6) near_edge = r.amplitude;
    }
    if (!of(s, "specular").empty()) {
      EXPECT_EQ(near_edge, 0) << "never both";
      held = s.records[0].amplitude;
    } else {
      taken = near_edge;
      at = y;
    }
  }
  ASSERT_GT(held, 0);
  ASSERT_GT(taken, 0);
  EXPECT_NEAR(db(taken / held), 0, 2) << "at y = " << at;
}

TEST_F(EdgeTest, IsExposedOnly) {
  // A room's walls end in each other: no rims. A cabinet against the wall: its front edges alone.
  addWall("south", "Concrete", {0, 0}, {6, 0}, 0, 2.8);
  addWall("east", "Concrete", {6, 0}, {6, 5}, 0, 2.8);
  addWall("north", "Concrete", {0, 5}, {6, 5}, 0, 2.8);
  addWall("west", "Concrete", {0, 0}, {0, 5}, 0, 2.8);
  addRectangle("floor", "Concrete", V(0, 0, 0), V(6, 0, 0), V(0, 5, 0));
  addRectangle("ceiling", "Concrete", V(0, 0, 2.8), V(6, 0, 0), V(0, 5, 0));
  addBox("cabinet", "Metal", V(4, 4, 0), V(5, 5, 1.6));
  const std::vector<DiffractingEdge> edges = findDiffractingEdges(loadScene(writeScene(), 77e9));
  ASSERT_EQ(edges.size(), 2u);
  for (const DiffractingEdge& e : edges) {
    EXPECT_NEAR(e.n, 1.5, 1e-9);
    EXPECT_NEAR(e.length_m, 1.6, 1e-6);
    EXPECT_NEAR(e.origin.y(), 4, 1e-9);
    EXPECT_NEAR(std::abs(e.along.z()), 1, 1e-9);
  }
  // An open screen has four rims; tessellation does not change them.
  addWall("screen", "Metal", {2, 2}, {3, 2}, 0.5, 1.5, 7);
  const std::vector<DiffractingEdge> rims = findDiffractingEdges(loadScene(writeScene(), 77e9));
  ASSERT_EQ(rims.size(), 4u);
  for (const DiffractingEdge& e : rims) {
    EXPECT_EQ(e.n, 2);
    EXPECT_NEAR(e.length_m, 1, 1e-6);
  }
}

}  // namespace
}  // namespace mmradartwin
