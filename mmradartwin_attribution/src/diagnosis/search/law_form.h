#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Form of a law over a variable: a table, linear between its points.
struct LawForm {
  std::vector<double> at;  ///< values of the variable
  Eigen::MatrixXd shapes;  ///< [at][numbers] the table for each number at 1
  int searched = 0;        ///< further numbers (edges, a period) that were searched for
  std::string words = "";  ///< "" for a curve, whose numbers are the table's own
  bool local = false;      ///< zero outside a part of the variable
  bool of_points = false;  ///< each number is one point of the table

  /// Numbers that have a price; a constant is free.
  int priced(bool constant) const { return static_cast<int>(shapes.cols()) - (constant ? 1 : 0) + searched; }
};

/// Forms that a law over one variable may have, given the values of the variable.
class LawForms {
 public:
  /// values: of all paths, in any order, at least one. constant: a constant is fitted as well. A curve contains it; in
  /// other forms it is the first number.
  LawForms(const std::string& variable, std::vector<double> values, bool constant);

  /// False where all values are the same.
  bool varies() const;
  /// Nodes of the finest table.
  const std::vector<double>& fine() const { return fine_; }
  /// Adds to row the weights of the finest table's nodes at x.
  void addAt(double x, double weight, Eigen::Ref<Eigen::RowVectorXd> row) const;
  /// [fine][numbers] shapes of a form on the finest table.
  Eigen::MatrixXd onFine(const LawForm& form) const;
  /// Curves of a few nodes.
  std::vector<LawForm> curves() const;
  /// Ripples, exponentials, sectors (steps among them) and bumps.
  std::vector<LawForm> others() const;

 private:
  LawForm shaped(const std::vector<std::vector<double>>& shapes, int searched, const std::string& words) const;
  LawForm between(int from, int to, bool bump) const;
  void addRipples(bool in_sine, std::vector<LawForm>& to) const;

  bool constant_;
  bool turns_;  ///< both ends are the same direction
  bool of_azimuth_, of_range_;
  std::vector<double> sorted_, fine_;
  double low_, high_;
};

}  // namespace mmradartwin::diagnosis::search
