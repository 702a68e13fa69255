#include <algorithm>
#include <complex>

#include "closed_form.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/range_angle.h"
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

// Received power of 12 dBm through two antennas of 10 dBi: image in a plane, trihedral and sphere of
// docs/reference/closed_forms.md 4.1 by their cross-sections.
TEST_F(ClosedForms, RadarEquation) {
  addWall("wall", "Metal", {5, -30}, {5, 30}, -30, 30);
  const Simulation s = look(makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()));
  ASSERT_EQ(s.records.size(), 1u);
  const double gain_db = 12 + 10 + 10;
  expectForm("4.1 metal plane at 5 m, 12 dBm, 10 + 10 dBi", "dBm", -58.18, gain_db + db(s.records[0].amplitude), 0.1);
  EXPECT_NEAR(dbsm(s.records[0].amplitude, 5, kLambda77_m), 10 * std::log10(M_PI * 25), 0.1);
  // A sphere's range is that between its surface and its centre: sqrt(c (c - r)) = 5 m.
  const double r = 0.1, c = 0.5 * r + std::sqrt(0.25 * r * r + 25);
  addSphere("ball", "Metal", {c, 0, 0}, r, 24, 48);
  const Simulation ball = look(makeTwin(writeScene("ball"), "  specular: {}\n", radarAt77GHz()));
  expectForm("4.1 sphere of 10 cm at 5 m, likewise", "dBm", -92.16, gain_db + db(ball.records.at(0).amplitude), 0.1);
}

// A calibrated target in noise through frames, average and signal chain. With A^2 = lambda^2 sigma/((4 pi)^3 R^4) at
// the centre of a range bin and straight ahead, and white noise of power s^2 per complex sample, a map of F averaged
// frames shows SNR = A^2/s^2 F M (sum w)^2/sum w^2.
TEST_F(ClosedForms, RadarEquationWithNoise) {
  const RadarConfig radar = paperRadar();
  const double lambda = radar.wavelength_m(), R = 20 * radar.range_bin_m(), side = 0.05;
  addWall("plate", "Metal", {R, -side / 2}, {R, side / 2}, -side / 2, side / 2);
  constexpr int kFrames = 4, kMaps = 60;
  const double noise_dbfs = -46;
  Twin twin = makeTwin(writeScene(), "  specular: {max_bounces: 1}\n  noise_floor: {level_dbfs: -46}\n", radar);
  // Square plate in its near field, sigma = (4 pi/lambda^2) |I|^4.
  std::complex<double> I = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double x = side * ((i + 0.5) / n - 0.5);
    I += std::polar(side / n, -2 * M_PI / lambda * x * x / R);
  }
  const double sigma_m2 = 4 * M_PI / (lambda * lambda) * std::pow(std::abs(I), 4);
  const double amplitude = std::sqrt(lambda * lambda * sigma_m2 / (std::pow(4 * M_PI, 3) * std::pow(R, 4)));
  const double gain_db = -30 - db(amplitude);  // the plate at -30 dBFS
  double sum_w = 0, sum_w2 = 0;
  for (int i = 0; i < radar.samples_per_chirp; ++i) {
    const double w = 0.5 * (1 - std::cos(2 * M_PI * i / radar.samples_per_chirp));
    sum_w += w;
    sum_w2 += w * w;
  }
  const double expected_db = -30 - noise_dbfs + 10 * std::log10(kFrames * radar.channels() * sum_w * sum_w / sum_w2);
  const SignalChain chain(radar);
  double peak = 0, floor = 0;
  int cells = 0;
  for (int map = 0; map < kMaps; ++map) {
    const Simulation s = twin.simulate(radarPose(0, 0, 0), map * 1000000000LL);
    CoherentAverage average(radar, 0);
    for (const AdcCube& cube : twin.simulateFrames(s, {kFrames, gain_db, ""})) average.add(cube);
    const RangeAngleMap shown = chain.map(average.grid());
    peak += std::pow(10.0, shown.power_db(20, 32) / 10) / kMaps;
    for (int r = 40; r < 60; ++r) {
      for (int a = 0; a < 64; ++a, ++cells) floor += std::pow(10.0, shown.power_db(r, a) / 10);
    }
  }
  floor /= cells;
  // 60 maps of some 20 by 8 independent cells: 0.04 dB rms.
  expectForm("4.1 radar equation in noise, 4 frames averaged", "dB SNR", expected_db,
             10 * std::log10((peak - floor) / floor), 0.1);
  EXPECT_NEAR(10 * std::log10(peak), -30, 0.1) << "a map's level is that of the sample";
}

// 8 pi a^4/lambda^2 far off (2 D^2/lambda = 2.6 m for a = 5 cm); nearer the Fresnel integral over the aperture
// a sqrt(2) by a: sigma = (4 pi/lambda^2) |I1 I2|^2, I = sqrt(lambda R) [C(u) - jS(u)].
TEST_F(ClosedForms, DihedralNearAndFar) {
  expectForm("4.2 dihedral of 5 cm, far", "dBsm", 10.15,
             dbsm(look(dihedral(0.05, 9, 0, "  corner: {}\n")).records.at(0).amplitude, 9, kLambda77_m), 0.1);
  for (double a : {0.05, 0.07, 0.10, 0.15}) {
    for (double R : {0.9, 3.0}) {
      const double expected =
          10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * strip(a * std::sqrt(2.0), R) * strip(a, R));
      expectForm("4.3 dihedral of " + shortText(100 * a) + " cm at " + shortText(R) + " m", "dBsm", expected,
                 dbsm(look(dihedral(a, R, 0, "  corner: {}\n")).records.at(0).amplitude, R, kLambda77_m), 0.1);
    }
  }
}

/// Level of a turned dihedral by physical optics, summed over both faces' elements, E along the fold: the single bounce
/// of each face and, in both orders, the double bounce, by rays at the first face and by physical optics at the second.
double summedDihedral_dbsm(double a, double R, double turn_deg) {
  const double k = 2 * M_PI / kLambda77_m;
  const int n = static_cast<int>(40 * a / kLambda77_m), m = static_cast<int>(4 * a / kLambda77_m);
  const double ds = a / n, dz = a / m;
  std::complex<double> sum = 0;
  for (int face = 0; face < 2; ++face) {
    // In the fold's frame: this face along +x, the other along +y, the radar at (x, y) between them.
    const double own = (45 + (face == 0 ? -turn_deg : turn_deg)) * kDegree;  // angle of the radar to this face
    const double x = R * std::cos(own), y = R * std::sin(own);
    if (y < 1e-9) continue;  // along the face
    for (int i = 0; i < n; ++i) {
      const double s = (i + 0.5) * ds;
      for (int j = 0; j < m; ++j) {
        const double z = (j + 0.5) * dz - a / 2, back = std::sqrt((s - x) * (s - x) + y * y + z * z);
        sum -= y / back * std::polar(ds * dz / (back * back), -2 * k * back);
        if (x < 1e-9) continue;
        // From the image at (-x, y) through the other face, in the plane x = 0.
        const double share = x / (x + s), at_y = y * (1 - share), at_z = z * share;
        if (at_y > a || std::abs(at_z) > a / 2) continue;
        const double image = std::sqrt((s + x) * (s + x) + y * y + z * z);
        sum += y / image * std::polar(ds * dz / (image * back), -k * (image + back));
      }
    }
  }
  return 10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * std::norm(sum) * std::pow(R, 4));
}

// Corner, flashes of both plates and what their edges do to each other, all with `knife_edges: 1`.
TEST_F(ClosedForms, TurnedDihedralsAreASumOverTheirElements) {
  const double R = 0.9;
  for (double a : {0.05, 0.07, 0.10, 0.15}) {
    double worst = -1, worst_sum = 0, worst_found = 0, worst_at = 0;
    const auto compare = [&](double turn) {
      const double summed = summedDihedral_dbsm(a, R, turn);
      for (double side : {-1.0, 1.0}) {
        const Twin twin = dihedral(a, R, side * turn, "  specular: {knife_edges: 1}\n  corner: {knife_edges: 1}\n");
        const double found = dbsm(level(look(twin)), R, kLambda77_m);
        if (std::abs(found - summed) < worst) continue;
        worst = std::abs(found - summed);
        worst_sum = summed;
        worst_found = found;
        worst_at = side * turn;
      }
    };
    for (double turn = 0; turn <= 45; turn += 1.5) compare(turn);
    for (double turn : {44.0, 44.5, 44.8}) compare(turn);  // one plate nearly along the ray
    expectForm("4.3 turned dihedral of " + shortText(100 * a) + " cm at 0.9 m, -45 to 45 deg, worst at " +
                   shortText(worst_at) + " deg",
               "dBsm", worst_sum, worst_found, 0.3);
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
    expectForm("4.3 flash of a turned dihedral's plate, " + shortText(100 * a) + " cm", "dBsm",
               10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * strip(a, R) * strip(a, R)),
               dbsm(square, R, kLambda77_m), 0.1);
    const Simulation middle = look(dihedral(a, 0.9, 0, "  specular: {}\n  corner: {}\n"));
    EXPECT_EQ(of(middle, "corner").size(), 1u) << a;
    EXPECT_NEAR(level(look(dihedral(a, 0.9, 20, "  specular: {}\n  corner: {}\n"))),
                level(look(dihedral(a, 0.9, -20, "  specular: {}\n  corner: {}\n"))), 1e-9)
        << "left and right alike";
  }
}

// The whole curve from -50 to 50 deg, as dihedral_curve writes it: its middle belongs to the fold, its flashes to the
// plates near +-45 deg, and both sides are alike.
TEST_F(ClosedForms, RotatingDihedralsCurveHasItsMiddleAndTwoFlashes) {
  for (double a : {0.05, 0.07, 0.10, 0.15}) {
    double flash[2] = {0, 0}, flash_at[2] = {0, 0};
    for (int turn = -50; turn <= 50; turn += 1) {
      const Simulation s =
          look(dihedral(a, 0.9, turn, "  specular: {}\n  corner: {}\n  edge_diffraction: {level: 1}\n"));
      double fold = 0, plates = 0;
      for (const PathRecord& r : s.records) {
        if (*r.event == "corner") fold = std::max(fold, r.amplitude);
        if (*r.event == "specular") plates = std::max(plates, r.amplitude);
      }
      if (std::abs(turn) <= 20) {
        EXPECT_GT(fold, plates) << a << " m at " << turn;
      }
      if (std::abs(turn) > 46) {
        EXPECT_EQ(fold, 0) << a << " m at " << turn << ": the other plate is seen from behind";
      }
      if (plates > flash[turn > 0]) {
        flash[turn > 0] = plates;
        flash_at[turn > 0] = turn;
      }
    }
    for (int side : {0, 1}) EXPECT_NEAR(std::abs(flash_at[side]), 45, 8) << a;
    EXPECT_NEAR(flash_at[0], -flash_at[1], 1) << a;
    EXPECT_NEAR(db(flash[0] / flash[1]), 0, 1e-6) << a;
  }
}

/// Three metal faces in an octant: edges from the apex along the columns of `axes`, each `a` long; triangles or
/// squares.
struct OctantFaces {
  Eigen::Vector3d apex;
  Eigen::Matrix3d axes;
  double a;
  bool square;
};

/// Level of the three-bounce return in dBsm by brute force: parallel rays on a grid across the line of sight run
/// through the mirrors; what comes back after three hits adds up with the phase of a spherical wave from R.
double tracedTrihedral_dbsm(const OctantFaces& faces, const Eigen::Vector3d& radar) {
  const Eigen::Vector3d towards = faces.axes.transpose() * (radar - faces.apex);  // in the octant's own axes
  const double R = towards.norm(), k = 2 * M_PI / kLambda77_m, h = faces.a / 150;
  const Eigen::Vector3d look = -towards / R, u = look.unitOrthogonal(), v = look.cross(u);
  std::complex<double> sum = 0;
  const int n = static_cast<int>(1.5 * faces.a / h);
  for (int i = -n; i < n; ++i) {
    for (int j = -n; j < n; ++j) {
      const double x = (i + 0.5) * h, y = (j + 0.5) * h;
      Eigen::Vector3d p = x * u + y * v - 10 * faces.a * look, d = look;
      int bounces = 0;
      for (; bounces < 4; ++bounces) {
        int plane = -1;
        double nearest = 1e300;
        for (int axis = 0; axis < 3; ++axis) {
          const double t = -p[axis] / d[axis];
          if (d[axis] < 0 && t < nearest) {
            nearest = t;
            plane = axis;
          }
        }
        if (plane < 0) break;
        p += nearest * d;
        const double s = p[(plane + 1) % 3], t = p[(plane + 2) % 3];
        if (s < 0 || t < 0 || (faces.square ? std::max(s, t) > faces.a : s + t > faces.a)) break;
        p[plane] = 0;
        d[plane] = -d[plane];
      }
      if (bounces == 3) sum += std::polar(h * h, -k * (x * x + y * y) / R);
    }
  }
  return 10 * std::log10(4 * M_PI / (kLambda77_m * kLambda77_m) * std::norm(sum));
}

class TrihedralForms : public ClosedForms {
 protected:
  void addFaces(const OctantFaces& faces) {
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d u = faces.a * faces.axes.col((i + 1) % 3), v = faces.a * faces.axes.col((i + 2) % 3);
      std::vector<Eigen::Vector3d> corners = {faces.apex, faces.apex + u, faces.apex + u + v, faces.apex + v};
      if (!faces.square) corners.erase(corners.begin() + 2);
      addPolygons("face" + std::to_string(i), "Metal", corners,
                  {faces.square ? std::vector<int>{0, 1, 2, 3} : std::vector<int>{0, 1, 2}});
    }
  }
  /// Axes of an octant none of whose faces lies within 45 deg of the floor; it opens 19.5 deg upwards.
  static Eigen::Matrix3d tiltedAxes() {
    Eigen::Matrix3d axes;
    axes.row(2) = Eigen::RowVector3d(1, 1, -1).normalized();
    axes.row(0) = Eigen::RowVector3d(1, -1, 0).normalized();
    axes.row(1) = axes.row(2).cross(axes.row(0));
    return axes;
  }
  /// The radar at `range_m` from the apex, in the octant's direction `own`, looking at it.
  static Eigen::Isometry3d facing(const OctantFaces& faces, const Eigen::Vector3d& own, double range_m) {
    const Eigen::Vector3d way = faces.axes * own.normalized();
    return Eigen::Translation3d(faces.apex + range_m * way) *
           Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), -way);
  }
};

// 4 pi a^4/(3 lambda^2) = 2.37 and 14.41 dBsm for 5 and 10 cm (docs/reference/closed_forms.md 4.2).
TEST_F(TrihedralForms, FarOffTheTriangularOneHasItsCrossSection) {
  const OctantFaces faces = {{0, 0, 0}, tiltedAxes(), 0.05, false};
  addFaces(faces);
  const Simulation s = makeTwin(writeScene(), "  corner: {}\n", radarAt77GHz()).simulate(facing(faces, {1, 1, 1}, 9.5));
  std::vector<PathRecord> three = of(s, "corner", 3);
  ASSERT_EQ(three.size(), 1u);
  expectForm("4.2 triangular trihedral of 5 cm, far", "dBsm", 2.37, dbsm(three[0].amplitude, 9.5, kLambda77_m), 0.1);
  EXPECT_NEAR(three[0].length_m[0], 19, 1e-9);
  EXPECT_TRUE(s.check.ok());
  const OctantFaces square = {{0, 0, 0}, tiltedAxes(), 0.03, true};
  addFaces(square);
  const auto of_square = of(
      makeTwin(writeScene(), "  corner: {}\n", radarAt77GHz()).simulate(facing(square, {1, 1, 1}, 9.5)), "corner", 3);
  expectForm("4.2 square trihedral of 3 cm, far", "dBsm",
             10 * std::log10(12 * M_PI * std::pow(0.03, 4) / (kLambda77_m * kLambda77_m)),
             dbsm(of_square.at(0).amplitude, 9.5, kLambda77_m), 0.1);
}

TEST_F(TrihedralForms, AreTheTracedOnesNearAndFarOnBoresightAndBeside) {
  for (bool square : {false, true}) {
    for (double a : {0.05, 0.10}) {
      const OctantFaces faces = {{0.3, -0.2, 0.1}, tiltedAxes(), a, square};
      addFaces(faces);
      const Twin twin = makeTwin(writeScene(), "  corner: {}\n", radarAt77GHz());
      for (double R : {0.9, 4.0}) {
        for (const Eigen::Vector3d& own : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, 0.8, 0.6)}) {
          const Eigen::Isometry3d pose = facing(faces, own, R);
          const auto three = of(twin.simulate(pose), "corner", 3);
          ASSERT_EQ(three.size(), 1u);
          expectForm(std::string("4.3 ") + (square ? "square" : "triangular") + " trihedral of " + shortText(100 * a) +
                         " cm at " + shortText(R) + " m" + (own.y() < 1 ? ", turned" : ""),
                     "dBsm", tracedTrihedral_dbsm(faces, pose.translation()), dbsm(three[0].amplitude, R, kLambda77_m),
                     0.3);
        }
      }
    }
  }
}

// A reflector that is set up level has a face that the base takes for a floor: named, it returns all the same.
TEST_F(TrihedralForms, LevelOnesReturnWhereTheyAreNamed) {
  OctantFaces faces = {{3, 0, 0}, Eigen::Matrix3d::Identity(), 0.1, false};
  // Boresight along -x.
  faces.axes = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(1, 1, 1).normalized(), -Eigen::Vector3d::UnitX())
                   .toRotationMatrix();
  addFaces(faces);
  const std::string scene = writeScene();
  EXPECT_TRUE(of(makeTwin(scene, "  corner: {}\n", radarAt77GHz()).simulate(radarPose(0, 0, 0)), "corner", 3).empty());
  const auto three =
      of(makeTwin(scene, "  corner: {}\n  corner_reflection: {actors: [face0, face1, face2]}\n", radarAt77GHz())
             .simulate(radarPose(0, 0, 0)),
         "corner_reflection", 3);
  ASSERT_EQ(three.size(), 1u);
  EXPECT_NEAR(dbsm(three[0].amplitude, 3, kLambda77_m), tracedTrihedral_dbsm(faces, Eigen::Vector3d::Zero()), 0.1);
  // From outside, where the edges are convex, there is nothing.
  EXPECT_TRUE(of(makeTwin(scene, "  corner_reflection: {actors: [face0, face1, face2]}\n", radarAt77GHz())
                     .simulate(radarPose(6, 0, 0, 180)),
                 "corner_reflection", 3)
                  .empty());
}

/// Amplitude of a metal surface's echo by physical optics: 1/(4 pi) |integral of cos exp(-2jk rho)/rho^2 dS| over what
/// faces the radar at the origin. `point` gives position and outward area vector of a cell.
template <typename Surface>
double physicalOptics(int n, int m, Surface point) {
  std::complex<double> sum = 0;
  const double k = 2 * M_PI / kLambda77_m;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < m; ++j) {
      const auto [p, area] = point((i + 0.5) / n, (j + 0.5) / m);
      const double rho = p.norm(), facing = -p.dot(area) / rho;
      if (facing > 0) sum += std::polar(facing / (rho * rho), -2 * k * rho);
    }
  }
  return std::abs(sum) / (4 * M_PI);
}

class CurvedForms : public ClosedForms {};

// pi r^2 with the range's square taken between surface and centre: -21.05, -15.03 and -7.07 dBsm
// (docs/reference/closed_forms.md 4.2).
TEST_F(CurvedForms, SpheresHaveTheirCrossSectionHoweverTheyAreTessellated) {
  for (const auto& [r, expected] :
       std::vector<std::pair<double, double>>{{0.05, -21.05}, {0.1, -15.03}, {0.25, -7.07}}) {
    for (int n : {16, 37}) {
      addSphere("ball", "Metal", {3 + r, 0.2, 0.1}, r, n, 2 * n);
      const Twin twin = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz());
      ASSERT_EQ(twin.scene().curved.size(), 1u) << r << " m, " << n << " rings";
      EXPECT_NEAR(twin.scene().curved[0].radius_m, r, 1e-6);
      const Simulation s = look(twin);
      ASSERT_EQ(s.records.size(), 1u);
      const double center = Eigen::Vector3d(3 + r, 0.2, 0.1).norm();
      EXPECT_NEAR(s.records[0].length_m[0], 2 * (center - r), 1e-6);
      expectForm("4.2 sphere of " + shortText(100 * r) + " cm in " + std::to_string(n) + " rings", "dBsm", expected,
                 dbsm(s.records[0].amplitude, std::sqrt(center * (center - r)), kLambda77_m), 0.05);
      EXPECT_TRUE(s.check.ok());
    }
  }
  const Eigen::Vector3d c(1.1, 0, 0);
  const double po = physicalOptics(4000, 400, [&](double u, double v) {
    const double t = 0.5 * M_PI * u, p = 2 * M_PI * v, r = 0.1;  // the half towards the radar
    const Eigen::Vector3d n(-std::cos(t), std::sin(t) * std::cos(p), std::sin(t) * std::sin(p));
    return std::make_pair(Eigen::Vector3d(c + r * n),
                          Eigen::Vector3d(r * r * std::sin(t) * (0.5 * M_PI / 4000) * (2 * M_PI / 400) * n));
  });
  addSphere("ball", "Metal", c, 0.1, 20, 40);
  EXPECT_NEAR(db(look(makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz())).records.at(0).amplitude), db(po),
              0.1);
}

TEST_F(CurvedForms, CylindersDivergeAboutTheirAxis) {
  for (const auto& [length, sides] : std::vector<std::pair<double, int>>{{0.06, 12}, {0.3, 24}, {0.3, 200}}) {
    const double r = 0.05, L = length;
    for (bool upright : {true, false}) {
      const Eigen::Vector3d axis = upright ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d(0, 1, 0.3).normalized();
      const Eigen::Vector3d middle(2.05, 0, 0), other = axis.cross(Eigen::Vector3d::UnitX());
      addCylinder("pipe", "Metal", middle - 0.5 * L * axis, middle + 0.5 * L * axis, r, sides);
      const Twin twin = makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz());
      ASSERT_EQ(twin.scene().curved.size(), 1u) << sides;
      const Simulation s = look(twin);
      ASSERT_EQ(s.records.size(), 1u) << sides << " sides are one surface, and its ends face away";
      const double po = physicalOptics(3000, 600, [&](double u, double v) {
        const double t = M_PI * (u - 0.5);
        const Eigen::Vector3d n = -std::cos(t) * Eigen::Vector3d::UnitX() + std::sin(t) * other;
        return std::make_pair(Eigen::Vector3d(middle + r * n + (v - 0.5) * L * axis),
                              Eigen::Vector3d(r * (M_PI / 3000) * (L / 600) * n));
      });
      expectForm("4.2 cylinder of " + shortText(100 * L) + " cm in " + std::to_string(sides) + " sides" +
                     (upright ? "" : ", lying") + ", against physical optics",
                 "dB", db(po), db(s.records[0].amplitude), 0.1);
    }
  }
  // 2 pi r L^2/lambda far off, its range that of (d^3 (d + r))^(1/4) with d to the surface.
  const double r = 0.05, L = 0.06, d = 9.4;
  addCylinder("pipe", "Metal", {d + r, 0, -L / 2}, {d + r, 0, L / 2}, r, 24);
  const Simulation far = look(makeTwin(writeScene(), "  specular: {}\n", radarAt77GHz()));
  expectForm("4.2 cylinder of 5 cm, 6 cm long, far", "dBsm", 10 * std::log10(2 * M_PI * r * L * L / kLambda77_m),
             dbsm(far.records.at(0).amplitude, std::pow(d * d * d * (d + r), 0.25), kLambda77_m), 0.1);
}

TEST_F(CurvedForms, FacetsThatAreNoChordsStayFacets) {
  addBox("box", "Metal", {2, -0.5, -0.5}, {2.5, 0.5, 0.5});
  addCylinder("octagon", "Metal", {4, 2, -1}, {4, 2, 1}, 0.2, 8);
  // A cone: its sides are straight, but lean.
  std::vector<Eigen::Vector3d> cone = {{4, -2, 1}};
  std::vector<std::vector<int>> sides;
  for (int i = 0; i < 24; ++i) {
    cone.emplace_back(4 + 0.5 * std::cos(i * M_PI / 12), -2 + 0.5 * std::sin(i * M_PI / 12), -1);
    sides.push_back({0, 1 + i, 1 + (i + 1) % 24});
  }
  addPolygons("cone", "Metal", cone, sides);
  EXPECT_TRUE(loadScene(writeScene(), 77e9).curved.empty());
  addCylinder("pipe", "Metal", {2, 1, -1}, {2, 1, 1}, 0.1, 24);
  Scene scene = loadScene(writeScene(), 77e9);
  ASSERT_EQ(scene.curved.size(), 1u);
  EXPECT_EQ(scene.curved[0].facets.size(), 24u) << "the ends are facets";
  moveActor(scene, 0, Eigen::Translation3d(0, 0.5, 0) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(std::abs(scene.curved[0].axis.y()), 1, 1e-9) << "moves with its actor";
}

// Lambert's sphere, (8/3) rho pi r^2 far off; here near, and without the caps whose facets lie within 45 deg of the
// horizontal: (lambda/4 pi)^2 S^2/pi times the integral of cos^2/rho^4.
TEST_F(CurvedForms, ARoughSphereIsLamberts) {
  const double r = 0.1, x = 3;
  addSphere("ball", "RoughMetal", {x, 0, 0}, r, 40, 80);
  double power = 0, expected = 0, whole = 0;
  for (const PathRecord& p : look(makeTwin(writeScene(), "  diffuse: {spacing_m: 0.005}\n", radarAt77GHz())).records)
    power += p.amplitude * p.amplitude;
  const int n = 400;
  for (int i = 0; i < n; ++i) {
    const double t = M_PI * (i + 0.5) / n;
    for (int j = 0; j < n; ++j) {
      const double p = 2 * M_PI * (j + 0.5) / n;
      const Eigen::Vector3d normal(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)),
          at = Eigen::Vector3d(x, 0, 0) + r * normal;
      const double rho = at.norm(), cosine = -at.dot(normal) / rho;
      if (cosine <= 0) continue;
      const double cell = r * r * std::sin(t) * (M_PI / n) * (2 * M_PI / n) * cosine * cosine;
      whole += 4 * 0.36 * cell;
      if (std::abs(std::cos(t)) < std::sqrt(0.5)) expected += cell / std::pow(rho, 4);
    }
  }
  EXPECT_NEAR(10 * std::log10(whole / (8.0 / 3 * 0.36 * M_PI * r * r)), 0, 0.3) << "seen from 3 m a little less";
  expected *= std::pow(kLambda77_m / (4 * M_PI), 2) * 0.36 / M_PI;
  expectForm("4.8 rough sphere of 10 cm, Lambert's integral", "dB", 10 * std::log10(expected), 10 * std::log10(power),
             0.1);
}

}  // namespace
}  // namespace mmradartwin
