// Paths that graze an edge, against the Fresnel integral: summed here, by nothing of the simulator.

#include <algorithm>
#include <complex>

#include "closed_form.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;
constexpr double kLambda77_m = kSpeedOfLight_m_per_s / 77e9;
constexpr double kAllowed_db = 0.3;
constexpr double kBehind_m = -3;      // of the radar, where a screen ends whose other edge alone is asked for
const double kDark = std::sqrt(2.0);  // where the dark side's first Fresnel zone ends

/// Share of the field between Fresnel parameters low and high, over a path of rotated steps where high is infinite.
Complex between(double low, double high) {
  // exp(-j pi u^2/2) falls off along u = low + (1 - j) t.
  const auto from = [](double u0) {
    Complex sum = 0;
    const double step = 1e-3;
    for (int i = 0; i < 4000; ++i) {
      const Complex u = u0 + Complex(1, -1) * ((i + 0.5) * step);
      sum += std::exp(Complex(0, -0.5 * M_PI) * u * u) * step;
    }
    return sum;  // (1 - j) of the path's direction is that of the integral over all u
  };
  const auto tail = [&from](double u) { return u >= 0 ? from(u) : 1.0 - from(-u); };
  return tail(low) - (high > 1e3 ? 0.0 : tail(high));
}

/// Share of the field that passes two half planes one after the other, both from Fresnel parameter nu on.
Complex beyondBoth(double nu, double correlation) {
  const Complex turned = std::polar(nu, M_PI / 4);
  Complex sum = 0;
  const double step = 0.02, det = 1 - correlation * correlation;
  for (int i = 0; i < 400; ++i) {
    for (int j = 0; j < 400; ++j) {
      const Complex a = turned + (i + 0.5) * step, b = turned + (j + 0.5) * step;
      sum += std::exp(-0.5 * M_PI * (a * a - 2 * correlation * a * b + b * b) / det);
    }
  }
  return sum * step * step / (2 * std::sqrt(det));
}

class Grazing : public SceneFiles {
 protected:
  static constexpr double kApex_m = 4;
  /// A wedge of 60 deg about the x axis that opens towards the radar: its path over both walls crosses the axis at
  /// right angles, halfway, 4 - D/2 from the origin for a radar at a distance D from the apex.
  void addWedge(double left_m = 3.7, double right_m = 3.7) {
    const double c = std::cos(M_PI / 6), s = std::sin(M_PI / 6);
    addWall("left", "Metal", {kApex_m, 0}, {kApex_m - left_m * c, left_m * s}, -8, 8);
    addWall("right", "Metal", {kApex_m, 0}, {kApex_m - right_m * c, -right_m * s}, -8, 8);
  }
  /// Level of the path over left, then right wall; 0 where there is none.
  static double level(const Twin& twin, double x, double y = 0) {
    double found = 0;
    for (const PathRecord& r : twin.simulate(radarPose(x, y, 0)).records) {
      if (r.bounces == 2 && r.actors[0] == 0 && r.actors[1] == 1) found = r.amplitude;
    }
    return found;
  }
  /// Steps the radar along the wedge's axis: the share that is left of the path over both walls against the closed form
  /// of the place where its middle leg crosses the axis.
  void stepAlongAxis(const std::string& what, const std::function<void()>& addScreens,
                     const std::function<Complex(double crossing_m, double unit)>& form) {
    addWedge();
    const Twin open = makeTwin(writeScene("open"), "  specular: {max_bounces: 2, knife_edges: 1}\n", radarAt77GHz());
    addWedge();
    addScreens();
    const Twin twin = makeTwin(writeScene("screens"), "  specular: {max_bounces: 2, knife_edges: 1}\n", radarAt77GHz());
    double worst = 0, worst_form = 0, worst_found = 0;
    int dark = 0, lit = 0;
    for (double x = -0.36; x <= 0.36; x += 0.004) {
      const double crossing_m = 0.5 * (kApex_m + x), s = std::sqrt(3.0) * (kApex_m - x);
      const double unit = std::sqrt(8 / (kLambda77_m * s));
      const Complex expected = form(crossing_m, unit);
      if (std::abs(expected) < 0.15) continue;
      const double found = level(twin, x) / level(open, x);
      (std::abs(expected) < 0.5 ? dark : lit) += 1;
      const double off = found > 0 ? std::abs(db(found) - db(std::abs(expected))) : 99;
      if (off < worst) continue;
      worst = off;
      worst_form = db(std::abs(expected));
      worst_found = db(found);
    }
    EXPECT_GT(dark, 5) << what;
    EXPECT_GT(lit, 20) << what;
    expectForm("4.6 " + what + ", worst of the steps", "dB", worst_form, worst_found, kAllowed_db);
  }
};

TEST_F(Grazing, OneEdgeOfAnObstacleIsAKnifeEdge) {
  stepAlongAxis(
      "leg beside a screen's edge, from its one side",
      [&] {
        addWall("screen", "Metal", {2, 0}, {3.5, 0});
      },
      [](double at, double unit) {
        const double nu = (at - 2) * unit;
        return nu > kDark ? 0.0 : between(nu, 1e9);
      });
  stepAlongAxis(
      "leg beside a screen's edge, from its other side",
      [&] {
        addWall("screen", "Metal", {2, 0}, {kBehind_m, 0});
      },
      [](double at, double unit) {
        const double nu = (2 - at) * unit;
        return nu > kDark ? 0.0 : between(nu, 1e9);
      });
}

TEST_F(Grazing, TwoEdgesAreAStrip) {
  const double half = 0.04;
  stepAlongAxis(
      "leg through a gap of 8 cm between two things",
      [&] {
        addWall("near", "Metal", {2 - half, 0}, {kBehind_m, 0});
        addWall("far", "Metal", {2 + half, 0}, {3.5, 0});
      },
      [&](double at, double unit) {
        if ((std::abs(at - 2) - half) * unit > kDark) return Complex(0);
        return between((2 - half - at) * unit, (2 + half - at) * unit);
      });
  stepAlongAxis(
      "leg past a slat of 8 cm",
      [&] {
        addWall("slat", "Metal", {2 - half, 0}, {2 + half, 0});
      },
      [&](double at, double unit) { return 1.0 - between((2 - half - at) * unit, (2 + half - at) * unit); });
}

// Out and back past the same edge at 1.2 m before a wall at 3 m: two knife edges in turn.
TEST_F(Grazing, OutAndBackAreTwoKnifeEdges) {
  addWall("wall", "Metal", {3, -20}, {3, 20}, -20, 20);
  const Twin open = makeTwin(writeScene("open"), "  specular: {max_bounces: 1, knife_edges: 1}\n", radarAt77GHz());
  addWall("wall", "Metal", {3, -20}, {3, 20}, -20, 20);
  addWall("screen", "Metal", {1.2, 0}, {1.2, 5}, -5, 5);
  const Twin twin = makeTwin(writeScene("screen"), "  specular: {max_bounces: 1, knife_edges: 1}\n", radarAt77GHz());
  const auto level = [](const Twin& t, double y) {
    double found = 0;
    for (const PathRecord& r : t.simulate(radarPose(0, y, 0)).records) {
      if (r.actors[0] == 0) found = r.amplitude;
    }
    return found;
  };
  const double unit = std::sqrt(2 * 6 / (kLambda77_m * 1.2 * 4.8));
  double worst = 0, worst_form = 0, worst_found = 0;
  int steps = 0;
  for (double y = -0.3; y < 0.03; y += 0.003) {
    // On the lit side by what lies beyond either edge and beyond both.
    const double beyond = std::abs(y) * unit;
    const Complex both = beyondBoth(beyond, 1.2 / 4.8);
    const double expected = std::abs(y > 0 ? both : 1.0 - 2.0 * between(beyond, 1e9) + both);
    const double found = level(twin, y) / level(open, y);
    if (expected < 0.1) continue;
    ++steps;
    const double off = found > 0 ? std::abs(db(found) - db(expected)) : 99;
    if (off < worst) continue;
    worst = off;
    worst_form = db(expected);
    worst_found = db(found);
  }
  EXPECT_GT(steps, 30);
  expectForm("4.6 wall past a screen's edge, out and back, worst of the steps", "dB", worst_form, worst_found,
             kAllowed_db);
}

// A plate that stands on the wall's end is the corner's other face; on a wall that goes on behind it, it is in the way.
TEST_F(Grazing, TheOtherFaceOfACornerHidesNoneOfAFacetThatEndsThere) {
  const auto echo = [this](const std::string& name) {
    const Twin twin = makeTwin(writeScene(name), "  specular: {max_bounces: 1, knife_edges: 1}\n", radarAt77GHz());
    double found = 0;
    for (const PathRecord& r : twin.simulate(radarPose(0, 0, 0)).records) {
      if (r.actors[0] == 0) found = r.amplitude;
    }
    return db(found);
  };
  for (double behind_m : {0.0, 1.0}) {
    const auto addFacet = [&] { addWall("facet", "Metal", {3, -0.02}, {3, -0.06 - behind_m}, -1, 1); };
    addFacet();
    const double alone_db = echo("alone");
    addFacet();
    addWall("plate", "Metal", {3, -0.06}, {2.8, -0.06}, -1, 1);
    const double found_db = echo("with_plate");
    if (behind_m > 0) {
      EXPECT_GT(std::abs(found_db - alone_db), 1);
    } else {
      EXPECT_NEAR(found_db, alone_db, 1e-9);
    }
  }
}

// One wall of the wedge ends near the point where the path meets it.
TEST_F(Grazing, TheEdgeOfTheReflectorIsOneToo) {
  const double end_m = 4 / std::sqrt(3.0);  // from the apex: where the radar at the origin meets the wall
  addWedge();
  const Twin open = makeTwin(writeScene("open"), "  specular: {max_bounces: 2, knife_edges: 1}\n", radarAt77GHz());
  addWedge(end_m);
  const Twin twin = makeTwin(writeScene("short"), "  specular: {max_bounces: 2, knife_edges: 1}\n", radarAt77GHz());
  double worst = 0, worst_form = 0, worst_found = 0;
  int dark = 0, lit = 0;
  for (double x = -0.2; x <= 0.4; x += 0.004) {
    const double D = kApex_m - x, at = D / std::sqrt(3.0), s = std::sqrt(3.0) * D, d1 = D / std::sqrt(3.0);
    // Across the ray the wall is met at 30 deg.
    const double unit = std::cos(M_PI / 6) * std::sqrt(2 * s / (kLambda77_m * d1 * (s - d1))), nu = (at - end_m) * unit;
    if (nu > kDark) continue;
    // The wall's other end, in the apex, has its part in both.
    const double expected = db(std::abs(between(nu, at * unit) / between((at - 3.7) * unit, at * unit)));
    const double part = level(twin, x) / level(open, x);
    const double found = part > 0 ? db(part) : -99;
    (nu > 0 ? dark : lit) += 1;
    if (std::abs(found - expected) < worst) continue;
    worst = std::abs(found - expected);
    worst_form = expected;
    worst_found = found;
  }
  EXPECT_GT(dark, 10);
  EXPECT_GT(lit, 20);
  expectForm("4.6 path beside the end of one of its walls, worst of the steps", "dB", worst_form, worst_found,
             kAllowed_db);
}

}  // namespace
}  // namespace mmradartwin
