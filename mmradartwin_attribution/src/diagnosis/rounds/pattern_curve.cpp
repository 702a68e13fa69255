#include "diagnosis/rounds/pattern_curve.h"

#include <algorithm>
#include <boost/math/interpolators/cardinal_cubic_b_spline.hpp>
#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis::rounds {
namespace {

/// An element of a quarter to a half of a wavelength has no lobes: a node every 22.5 degrees describes its pattern.
constexpr double kNodeStep_deg = 22.5;
constexpr int kNodesOfSide = 3;  ///< to 67.5 degrees
/// Between the angles of the mechanism the curve is straight: a third of the nodes' step bends by a ninth as much.
constexpr int kAnglesOfStep = 3;
constexpr int kAnglesBeyond = 2;  ///< to 82.5 degrees
constexpr double kTypical_db = 3, kMost_db = 60;
constexpr double kZero = 1e-12;

/// A law's value, linear between its points and held at its ends.
double valueAt(const std::vector<double>& at, const std::vector<double>& values, double x) {
  const auto above = std::upper_bound(at.begin(), at.end(), x);
  if (above == at.begin()) return values.front();
  if (above == at.end()) return values.back();
  const auto i = static_cast<std::size_t>(above - at.begin());
  return values[i - 1] + (x - at[i - 1]) / (at[i] - at[i - 1]) * (values[i] - values[i - 1]);
}

/// Values at `angles_deg` of the spline that is 1 at one node and 0 at the others.
std::vector<double> shapeOf(int node, const std::vector<double>& angles_deg) {
  std::vector<double> at_nodes(2 * kNodesOfSide + 1, 0.0);
  at_nodes[static_cast<std::size_t>(node)] = 1;
  const double outer_deg = kNodesOfSide * kNodeStep_deg;
  const double *first = at_nodes.data(), *last = &at_nodes.back();
  // Slopes at the ends, by the parabola through the three outer nodes.
  const double first_slope = (-3 * first[0] + 4 * first[1] - first[2]) / (2 * kNodeStep_deg);
  const double last_slope = (3 * last[0] - 4 * last[-1] + last[-2]) / (2 * kNodeStep_deg);
  const boost::math::interpolators::cardinal_cubic_b_spline<double> spline(at_nodes.begin(), at_nodes.end(), -outer_deg,
                                                                           kNodeStep_deg, first_slope, last_slope);
  std::vector<double> shape;
  for (double angle : angles_deg) {
    const double inside = std::clamp(angle, -outer_deg, outer_deg);
    const double value = spline(inside) + (angle - inside) * spline.prime(inside);
    shape.push_back(std::abs(value) < kZero ? 0 : value);
  }
  return shape;
}

}  // namespace

std::optional<std::string> angleOfPattern(const Hypothesis& hypothesis) {
  if (hypothesis.mechanism.mechanism != "element_pattern") return std::nullopt;
  return "azimuth_deg";
}

bool isLawOfAllLevels(const Hypothesis& hypothesis, const std::string& variable) {
  if (hypothesis.form() != MechanismForm::kLaw) return false;
  const Parameters& law = hypothesis.mechanism.values;
  const bool of_all = law.text("actor").empty() && law.text("material").empty() && law.text("event").empty() &&
                      law.numbers("channels").empty();
  return of_all && law.text("variable") == variable && !law.numbers("gain_db").empty() && law.numbers("at").size() > 1;
}

std::pair<Hypothesis, std::vector<double>> patternCurve(Hypothesis hypothesis, const Parameters& of_cosine,
                                                        const Parameters& law) {
  const std::vector<double> at = law.numbers("at"), gain_db = law.numbers("gain_db");
  std::vector<double> angles_deg;
  const int outermost = kNodesOfSide * kAnglesOfStep + kAnglesBeyond;
  for (int i = -outermost; i <= outermost; ++i) angles_deg.push_back(i * kNodeStep_deg / kAnglesOfStep);
  hypothesis.mechanism = defaultMechanism(hypothesis.mechanism.mechanism);
  hypothesis.mechanism.values.set("gain_db", std::vector<double>(angles_deg.size(), 0.0));
  hypothesis.coordinates.clear();
  hypothesis.variant = "a curve";
  const auto product_db = [&](double angle_deg) {
    return 10 * of_cosine.number("cos_exponent") * std::log10(std::cos(angle_deg * M_PI / 180)) +
           valueAt(at, gain_db, angle_deg) / 2;
  };
  std::vector<double> scaled_values;
  for (int node = 0; node <= 2 * kNodesOfSide; ++node) {
    if (node == kNodesOfSide) continue;  // the gain of the session takes what is common to all angles
    const double angle_deg = (node - kNodesOfSide) * kNodeStep_deg;
    hypothesis.coordinates.push_back(
        {"gain_db", "dB", -1, 0, kTypical_db, -kMost_db, kMost_db, shapeOf(node, angles_deg)});
    scaled_values.push_back(hypothesis.coordinates.back().scaled(product_db(angle_deg) - product_db(0)));
  }
  hypothesis.mechanism.values.set("angles_deg", std::move(angles_deg));
  return {std::move(hypothesis), std::move(scaled_values)};
}

}  // namespace mmradartwin::diagnosis::rounds
