#include "diagnosis/search/law_form.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace mmradartwin::diagnosis::search {
namespace {

constexpr int kFine = 48, kFinest = 128;  ///< nodes of the finest table; the limit where ranges span a hall
constexpr double kFineRange_m = 0.2;      ///< spacing of these nodes over range
constexpr int kMostNodes = 8;             ///< nodes of a curve
constexpr double kShortest = 3.5;         ///< fine steps in a ripple's shortest period
constexpr double kMostPeriods = 10, kShortest_m = 0.85;  ///< periods of a ripple; ten of the shortest span a room
/// Shares of the variable's span in which an exponential falls by e.
constexpr double kDecayShares[] = {0.05, 0.1, 0.2, 0.4};
constexpr int kSectors = 24;          ///< parts of the variable's span whose edges are tried
constexpr int kNarrowestBump = 4;     ///< parts between a bump's ends
constexpr double kLeastShare = 0.02;  ///< share of the paths beyond a table's first and last node

std::string threeDigits(double value) {
  std::ostringstream out;
  out << std::setprecision(3) << value;
  return out.str();
}

/// Adds the weights of a table's nodes at x. Beyond the ends the first or last node has weight 1.
void addHat(const std::vector<double>& at, double x, double weight, Eigen::Ref<Eigen::RowVectorXd> row) {
  const Eigen::Index last = static_cast<Eigen::Index>(at.size()) - 1;
  if (x <= at.front() || last == 0) {
    row[0] += weight;
  } else if (x >= at.back()) {
    row[last] += weight;
  } else {
    const Eigen::Index i = std::upper_bound(at.begin(), at.end(), x) - at.begin();
    const double low = at[static_cast<std::size_t>(i - 1)], high = at[static_cast<std::size_t>(i)];
    const double share = (x - low) / (high - low);
    row[i - 1] += weight * (1 - share);
    row[i] += weight * share;
  }
}

/// [fine][nodes] weights of a coarse table's nodes at the nodes of a finer one.
Eigen::MatrixXd hats(const std::vector<double>& fine, const std::vector<double>& nodes) {
  Eigen::MatrixXd m =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fine.size()), static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < fine.size(); ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(m.cols());
    addHat(nodes, fine[i], 1, row);
    m.row(static_cast<Eigen::Index>(i)) = row;
  }
  return m;
}

/// Nodes between which the sorted numbers are evenly distributed.
std::vector<double> evenNodes(const std::vector<double>& sorted, int count) {
  std::vector<double> nodes;
  for (int k = 0; k < count; ++k) {
    const double share = std::clamp(static_cast<double>(k) / (count - 1), kLeastShare, 1 - kLeastShare);
    const double x = sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    if (nodes.empty() || x > nodes.back() + 1e-6) nodes.push_back(x);
  }
  return nodes;
}

}  // namespace

LawForms::LawForms(const std::string& variable, std::vector<double> values, bool constant)
    : constant_(constant),
      turns_(variable == "heading_deg" || variable == "bearing_deg"),
      of_azimuth_(variable == "azimuth_deg"),
      of_range_(variable == "range_m"),
      sorted_(std::move(values)) {
  std::sort(sorted_.begin(), sorted_.end());
  low_ = turns_ ? -180 : sorted_.front();
  high_ = turns_ ? 180 : sorted_.back();
  const int count =
      of_range_ ? std::clamp(static_cast<int>(std::ceil((high_ - low_) / kFineRange_m)), kFine, kFinest) : kFine;
  for (int i = 0; i < count; ++i) fine_.push_back(low_ + (high_ - low_) * i / (count - 1));
}

bool LawForms::varies() const {
  return sorted_.back() - sorted_.front() > 1e-3 * std::max(1.0, std::abs(sorted_.back()));
}

void LawForms::addAt(double x, double weight, Eigen::Ref<Eigen::RowVectorXd> row) const {
  addHat(fine_, x, weight, row);
}

Eigen::MatrixXd LawForms::onFine(const LawForm& form) const {
  return form.at == fine_ ? form.shapes : hats(fine_, form.at) * form.shapes;
}

std::vector<LawForm> LawForms::curves() const {
  std::vector<LawForm> forms;
  for (int count = 2; count <= kMostNodes; ++count) {
    LawForm form;
    if (turns_) {
      for (int k = 0; k <= count; ++k) form.at.push_back(-180 + 360.0 * k / count);
    } else {
      form.at = evenNodes(sorted_, count);
      form.of_points = true;
    }
    const Eigen::Index nodes = static_cast<Eigen::Index>(form.at.size());
    if (nodes < count) continue;
    form.shapes = Eigen::MatrixXd::Identity(nodes, nodes);
    if (turns_) {
      form.shapes = form.shapes.leftCols(nodes - 1).eval();
      form.shapes(nodes - 1, 0) = 1;
    }
    // The session's gain is free already.
    if (!constant_) form.shapes = form.shapes.rightCols(form.shapes.cols() - 1).eval();
    forms.push_back(std::move(form));
  }
  return forms;
}

LawForm LawForms::shaped(const std::vector<std::vector<double>>& shapes, int searched, const std::string& words) const {
  LawForm form;
  form.at = fine_;
  form.searched = searched;
  form.words = words;
  const Eigen::Index first = constant_ ? 1 : 0;
  const Eigen::Index nodes = static_cast<Eigen::Index>(fine_.size());
  form.shapes = Eigen::MatrixXd::Ones(nodes, first + static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    form.shapes.col(first + static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(shapes[k].data(), nodes);
  }
  return form;
}

void LawForms::addRipples(bool in_sine, std::vector<LawForm>& to) const {
  const auto place = [&](double x) { return in_sine ? std::sin(x * M_PI / 180) : x; };
  const double span = place(high_) - place(low_);
  const double shortest = std::max(kShortest * (fine_[1] - fine_[0]) * (in_sine ? M_PI / 180 : 1),
                                   of_range_ ? std::min(kShortest_m, span / kMostPeriods) : span / kMostPeriods);
  for (double periods = 1; span / periods > shortest; periods += 0.25) {
    std::vector<std::vector<double>> shapes(2);
    for (int quarter : {0, 1}) {
      for (double x : fine_) {
        shapes[static_cast<std::size_t>(quarter)].push_back(
            std::cos(2 * M_PI * place(x) * periods / span - 0.5 * M_PI * quarter));
      }
    }
    to.push_back(
        shaped(shapes, 1, "a ripple of period " + threeDigits(span / periods) + (in_sine ? " of the sine" : "")));
  }
}

LawForm LawForms::between(int from, int to, bool bump) const {
  std::vector<double> shape(fine_.size(), 0.0);
  for (int i = from; i < to; ++i) {
    shape[static_cast<std::size_t>(i)] = bump ? 0.5 - 0.5 * std::cos(2 * M_PI * (i - from + 1) / (to - from + 1)) : 1;
  }
  LawForm f = shaped({shape}, from == 0 || to >= static_cast<int>(fine_.size()) ? 1 : 2,
                     (bump ? "a bump from " : "one value from ") + threeDigits(fine_[static_cast<std::size_t>(from)]) +
                         " to " + threeDigits(fine_[static_cast<std::size_t>(to - 1)]));
  f.local = true;
  return f;
}

std::vector<LawForm> LawForms::others() const {
  std::vector<LawForm> forms;
  const int count = static_cast<int>(fine_.size());
  if (!turns_) addRipples(false, forms);
  if (of_azimuth_) addRipples(true, forms);  // interference at an aperture has this form
  for (double share : kDecayShares) {
    for (bool grows : {false, true}) {
      if (turns_) break;
      std::vector<double> shape;
      for (int i = 0; i < count; ++i) shape.push_back(std::exp(-(grows ? count - 1 - i : i) / (share * (count - 1))));
      forms.push_back(shaped({shape}, 1,
                             std::string("an exponential that ") + (grows ? "grows" : "falls") + " by e in " +
                                 threeDigits(share * (high_ - low_))));
    }
  }
  const auto edge = [&](int part) { return part * count / kSectors; };
  for (int from = 0; from < kSectors; ++from) {
    for (int to = from + 1; to <= kSectors; ++to) {
      if (from > 0 || to < kSectors) forms.push_back(between(edge(from), edge(to), false));
      if (to - from >= kNarrowestBump) forms.push_back(between(edge(from), edge(to), true));
    }
  }
  return forms;
}

}  // namespace mmradartwin::diagnosis::search
