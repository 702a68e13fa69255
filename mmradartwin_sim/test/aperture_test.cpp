#include "physics/aperture.h"

#include <gtest/gtest.h>

#include "closed_form.h"
#include "physics/fresnel_integral.h"

namespace mmradartwin {
namespace {

using Loops = std::vector<std::vector<Eigen::Vector2d>>;

// Values of C and S to 16 digits, Abramowitz and Stegun 7.3 as SciPy evaluates them.
TEST(FresnelIntegral, HasItsTabulatedValues) {
  const double rows[][3] = {
      {0.1, 0.09999753262708506, 0.0005235895476122108}, {1, 0.779893400376823, 0.4382591473903547},
      {2.1999, 0.6362611424452601, 0.45560776241023},    {2.2001, 0.6363108804177189, 0.4558014790272935},
      {5, 0.5636311887040122, 0.4991913819171169},       {130, 0.49999995388202995, 0.4975514624165767}};
  for (const auto& row : rows) {
    EXPECT_NEAR(fresnelIntegral(row[0]).real(), row[1], 2e-14);
    EXPECT_NEAR(fresnelIntegral(row[0]).imag(), -row[2], 2e-14);
    EXPECT_EQ(fresnelIntegral(-row[0]), -fresnelIntegral(row[0]));
  }
}

TEST(Aperture, IsOneWhereItReachesFarAndAHalfAtAnEdge) {
  EXPECT_NEAR(std::abs(apertureAxis(-1e6, 1e6) - 1.0), 0, 1e-6);
  EXPECT_NEAR(std::abs(apertureAxis(0, 1e6) - 0.5), 0, 1e-6);
  EXPECT_NEAR(std::abs(apertureAxis(50, 1e6)), 1 / (std::sqrt(2) * M_PI * 50), 1e-6);
}

// Loss behind a knife edge at the Fresnel parameter nu, exact: -20 log10 of the half-infinite aperture's factor.
TEST(Aperture, BehindAKnifeEdgeHasItsTabulatedLoss) {
  const double rows[][2] = {{0, 6.021},    {0.5, 10.234}, {1, 13.864}, {2, 19.091},
                            {2.4, 20.618}, {5, 26.936},   {-1, -1.001}};
  for (const auto& [nu, loss_db] : rows) {
    expectForm("4.6 knife edge, nu " + shortText(nu), "dB", loss_db, -20 * std::log10(std::abs(apertureAxis(nu, 1e7))),
               1e-3);
  }
}

TEST(Aperture, OfAPolygonAgreesWithTheRectanglesClosedForm) {
  const double rows[][4] = {{-1, 1, -1, 1},         {-130, 3, -20, 40}, {0.3, 5, -2, 0.001}, {2, 3, 4, 5},
                            {1e-6, 100, -50, 1e-5}, {0, 2, -1, 1},      {10, 12, -60, 60}};
  for (const auto& r : rows) {
    const Loops rectangle = {{{r[0], r[2]}, {r[1], r[2]}, {r[1], r[3]}, {r[0], r[3]}}};
    EXPECT_NEAR(std::abs(aperturePolygon(rectangle) - apertureAxis(r[0], r[1]) * apertureAxis(r[2], r[3])), 0, 1e-9);
  }
}

// A circle around the reflection point: (1/-2j) integral of exp(-j pi rho^2/2) rho d rho d phi = 1 - exp(-j pi
// rho^2/2).
TEST(Aperture, OfACircleIsTheZonePlatesClosedForm) {
  for (double rho : {0.5, 1.0, 1.41421356, 2.0}) {
    Loops circle(1);
    for (int i = 0; i < 2000; ++i)
      circle[0].emplace_back(rho * std::cos(2 * M_PI * i / 2000), rho * std::sin(2 * M_PI * i / 2000));
    const std::complex<double> expected = 1.0 - std::polar(1.0, -0.5 * M_PI * rho * rho);
    EXPECT_NEAR(std::abs(aperturePolygon(circle) - expected), 0, 2e-5);
  }
}

TEST(Aperture, WithAHoleIsTheDifference) {
  const Loops outer = {{{-3, -2}, {4, -2}, {4, 2}, {-3, 2}}}, hole = {{{-1, -1}, {2, -1}, {2, 1}, {-1, 1}}};
  Loops both = outer;
  both.emplace_back(hole[0].rbegin(), hole[0].rend());
  EXPECT_NEAR(std::abs(aperturePolygon(both) - (aperturePolygon(outer) - aperturePolygon(hole))), 0, 1e-9);
}

}  // namespace
}  // namespace mmradartwin
