#include <algorithm>
#include <complex>

#include "scene_files.h"

namespace mmradartwin {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kLambda77_m = kSpeedOfLight_m_per_s / 77e9;

/// Radar cross-section in dBsm of an amplitude at range R: A^2 = lambda^2 sigma/((4 pi)^3 R^4).
double dbsm(double amplitude, double R, double lambda) {
  return 10 * std::log10(amplitude * amplitude * std::pow(4 * M_PI, 3) * std::pow(R, 4) / (lambda * lambda));
}

/// |integral of exp(-jk x^2/R) dx|^2 over a strip at range R: one axis of a plate in the Fresnel zone.
double strip(double width, double R) {
  std::complex<double> sum = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double x = width * ((i + 0.5) / n - 0.5);
    sum += std::polar(width / n, -2 * M_PI / kLambda77_m * x * x / R);
  }
  return std::norm(sum);
}

class ClosedForms : public SceneFiles {
 protected:
  /// Two metal squares of side a at a right angle, upright fold at (R, 0), open towards the radar at the origin, turned
  /// about the fold.
  Twin dihedral(double a, double R, double turn_deg, const std::string& mechanisms) {
    for (const auto& [name, angle] : std::vector<std::pair<std::string, double>>{{"left", 135}, {"right", 225}}) {
      const double t = (angle + turn_deg) * kDegree;
      addWall(name, "Metal", {R, 0}, {R + a * std::cos(t), a * std::sin(t)}, -a / 2, a / 2);
    }
    return makeTwin(writeScene(), mechanisms, radarAt77GHz());
  }
  static Simulation look(const Twin& twin) { return twin.simulate(radarPose(0, 0, 0)); }
  /// Level of all returns together, as one channel at the window's centre has it.
  static double level(const Simulation& s) {
    std::complex<double> sum = 0;
    for (const PathRecord& r : s.records) sum += r.c[0];
    return std::abs(sum);
  }
};

// Received power of 12 dBm through two antennas of 10 dBi: image in a plane, trihedral and sphere of simulation.md 4.1
// by their cross-sections.
TEST_F(ClosedForms, RadarEquation) {
  addWall("wall", "Metal", {5, -30}, {5, 30}, -30, 30);
  const Simulation s = look(makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()));
  ASSERT_EQ(s.records.size(), 1u);
  const double gain_db = 12 + 10 + 10;
  EXPECT_NEAR(gain_db + db(s.records[0].amplitude), -58.18, 0.1);
  EXPECT_NEAR(dbsm(s.records[0].amplitude, 5, kLambda77_m), 10 * std::log10(M_PI * 25), 0.1);
}

// 8 pi a^4/lambda^2 far off (2 D^2/lambda = 2.6 m for a = 5 cm); nearer the Fresnel integral over the aperture
// a sqrt(2) by a: sigma = (4 pi/lambda^2) |I1 I2|^2, I = sqrt(lambda R) [C(u) - jS(u)].
TEST_F(ClosedForms, DihedralNearAndFar) {
  EXPECT_NEAR(dbsm(look(dihedral(0.05, 9, 0, "  corner: {}\n")).records.at(0).amplitude, 9, kLambda77_m), 10.15, 0.1);
  for (double a : {0.05, 0.07, 0.10, 0.15}) {
    for (double R : {0.9, 3.0}) {
      const double expected =
          10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * strip(a * std::sqrt(2.0), R) * strip(a, R));
      EXPECT_NEAR(dbsm(look(dihedral(a, R, 0, "  corner: {}\n")).records.at(0).amplitude, R, kLambda77_m), expected,
                  0.1)
          << a << " m at " << R << " m";
    }
  }
}

// A rotating dihedral at 0.9 m: retro return in the middle, single-plate flashes at +-45 deg.
TEST_F(ClosedForms, RotatingDihedralFlashesOnItsPlates) {
  for (double a : {0.05, 0.07, 0.10, 0.15}) {
    double best = 0, best_at = 0;
    for (double turn = 38; turn <= 50; turn += 0.25) {
      const Simulation s = look(dihedral(a, 0.9, turn, "  specular: {}\n  corner: {}\n"));
      const auto single = of(s, "specular", 1);
      double strongest = 0;
      for (const PathRecord& r : single) strongest = std::max(strongest, r.amplitude);
      if (strongest > best) {
        best = strongest;
        best_at = turn;
      }
    }
    // Square on, the perpendicular's foot lies on the plate that starts at the fold; ripples of the near field decide
    // where on it the return is strongest.
    const double foot = 0.9 * std::sin((45 - best_at) * kDegree);
    EXPECT_GT(foot, 0) << a;
    EXPECT_LT(foot, a) << a;
    // With the foot in its middle it is the square plate's exact near field.
    const double R = 0.9 * std::cos(std::asin(0.5 * a / 0.9));
    const auto flash =
        of(look(dihedral(a, 0.9, 45 - std::asin(0.5 * a / 0.9) / kDegree, "  specular: {}\n")), "specular", 1);
    double square = 0;
    for (const PathRecord& r : flash) square = std::max(square, r.amplitude);
    EXPECT_NEAR(dbsm(square, R, kLambda77_m),
                10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * strip(a, R) * strip(a, R)), 0.1)
        << a;
    const Simulation middle = look(dihedral(a, 0.9, 0, "  specular: {}\n  corner: {}\n"));
    EXPECT_EQ(of(middle, "corner").size(), 1u) << a;
    EXPECT_NEAR(level(look(dihedral(a, 0.9, 20, "  specular: {}\n  corner: {}\n"))),
                level(look(dihedral(a, 0.9, -20, "  specular: {}\n  corner: {}\n"))), 1e-9)
        << "left and right alike";
  }
}

}  // namespace
}  // namespace mmradartwin
