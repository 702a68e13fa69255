#include "diagnosis/hypotheses/fitted_parameters.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis::hypotheses {
namespace {

// Factor on standard errors by which 95 % intervals hold the truth as often as they state; see
// docs/verification/calibration_of_bounds.md#kcalibration.
constexpr double kCalibration = 1.3;

/// Widens the intervals of a list's elements by the coordinates that add a shape to the list.
void widenByShapes(const Hypothesis& hypothesis, const std::vector<double>& standard_error, double t,
                   const std::string& parameter, std::vector<std::array<double, 2>>& ci95) {
  for (std::size_t k = 0; k < ci95.size(); ++k) {
    double squares = 0;
    for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
      const Coordinate& c = hypothesis.coordinates[j];
      if (c.parameter == parameter && k < c.shape.size()) squares += std::pow(t * standard_error[j] * c.shape[k], 2);
    }
    ci95[k][0] -= std::sqrt(squares);
    ci95[k][1] += std::sqrt(squares);
  }
}

}  // namespace

std::vector<FindingParameter> fittedParameters(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                                               const std::vector<double>& standard_error, const std::string& cause,
                                               std::size_t locations) {
  std::vector<FindingParameter> parameters;
  const NamedParameters m = hypothesis.at(scaled_values);
  const boost::math::students_t distribution(std::max(1.0, static_cast<double>(locations) - 1));
  const double t = kCalibration * boost::math::quantile(distribution, 0.975);
  for (const CauseParameter& wanted : causeDescription(cause).parameters) {
    if (!m.values.has(wanted.name)) continue;
    FindingParameter parameter{wanted.name, wanted.unit, m.values.all().at(wanted.name), {}};
    const auto* text = std::get_if<std::string>(&parameter.value);
    const auto* list = std::get_if<std::vector<double>>(&parameter.value);
    if ((text && text->empty()) || (list && list->empty())) continue;
    if (const auto* value = std::get_if<double>(&parameter.value)) {
      for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
        if (hypothesis.coordinates[j].parameter != wanted.name) continue;
        const Coordinate& c = hypothesis.coordinates[j];
        parameter.ci95 = {
            {std::max(c.min, *value - t * standard_error[j]), std::min(c.max, *value + t * standard_error[j])}};
      }
      const auto isDefault = [&] {
        const Parameters usual = defaultMechanism(m.mechanism).values;
        return usual.has(wanted.name) && usual.all().at(wanted.name) == parameter.value;
      };
      if (parameter.ci95.empty() && (wanted.one_of > 0 || (wanted.optional && isDefault()))) continue;
    } else if (list != nullptr) {
      parameter.ci95.assign(list->size(), {0, 0});
      for (std::size_t k = 0; k < list->size(); ++k) parameter.ci95[k] = {(*list)[k], (*list)[k]};
      for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
        const Coordinate& c = hypothesis.coordinates[j];
        if (c.parameter != wanted.name || c.element < 0) continue;
        const double v = (*list)[static_cast<std::size_t>(c.element)];
        parameter.ci95[static_cast<std::size_t>(c.element)] = {v - t * standard_error[j], v + t * standard_error[j]};
      }
      widenByShapes(hypothesis, standard_error, t, wanted.name, parameter.ci95);
    }
    parameters.push_back(std::move(parameter));
  }
  // The one law of poses that has a name.
  if (hypothesis.form() == MechanismForm::kLaw && m.values.text("variable") == "total_power_db") {
    parameters.push_back({"law", "", std::string("level_by_total_power"), {}});
  }
  return parameters;
}

double natsFromNothing(const Hypothesis& hypothesis, const std::vector<double>& scaled_values,
                       const std::vector<double>& standard_error) {
  double nats = 0;
  for (std::size_t j = 0; j < scaled_values.size(); ++j) {
    const double error = kCalibration * standard_error[j] / std::abs(hypothesis.coordinates[j].slope(scaled_values[j]));
    nats += 0.5 * scaled_values[j] * scaled_values[j] / (error * error);
  }
  return nats;
}

}  // namespace mmradartwin::diagnosis::hypotheses
