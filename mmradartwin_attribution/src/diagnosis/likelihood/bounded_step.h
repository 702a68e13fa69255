#pragma once

#include <Eigen/Core>

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

}  // namespace mmradartwin::diagnosis::likelihood
