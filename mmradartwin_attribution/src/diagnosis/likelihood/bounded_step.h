#pragma once

#include <Eigen/Core>
#include <functional>
#include <initializer_list>
#include <optional>

namespace mmradartwin::diagnosis::likelihood {

/// Change of parameters that maximises the quadratic score^T d - d^T information d / 2 within low <= d <= high.
struct BoundedStep {
  Eigen::VectorXd step;  ///< [n]
  double promised_nats;  ///< value of the quadratic there
};

/// Quadratic programming in a box by active sets (Nocedal and Wright, Numerical Optimization, 2006, 16.5): numbers that
/// would leave their bounds are held at them, and the others follow. A step that is cut in one number alone would leave
/// the ridge on which numbers are coupled. information: [n][n] symmetric, positive definite; score, low, high: [n],
/// low <= 0 <= high.
BoundedStep boundedStep(const Eigen::MatrixXd& information, const Eigen::VectorXd& score, const Eigen::VectorXd& low,
                        const Eigen::VectorXd& high);

/// Goes along a step: by the first of the shares that gains, and from a whole step that gains more than it promises on
/// to 2, 4 and 8 of it while each gains more: information that is expected overstates curvatures. attempt: takes a
/// share of the step where it gains over what was taken last, and returns by how many nats. Returns the sum of what was
/// gained.
double gainAlong(double promised_nats, std::initializer_list<double> shares,
                 const std::function<std::optional<double>(double share)>& attempt);

}  // namespace mmradartwin::diagnosis::likelihood
