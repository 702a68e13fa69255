#include "hypothesis_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <numeric>

namespace mmradartwin {
namespace {

constexpr double kSmallStep = 0.125;  ///< of the scale, for derivatives
constexpr double kEnough = 0.2;       ///< nats: a further step promises less
constexpr double kMaxInflation = 50;

SessionCovariance difference(SessionCovariance of, const SessionCovariance& from, double per) {
  const float f = static_cast<float>(1 / per);
  for (std::size_t i = 0; i < of.size(); ++i) {
    for (std::size_t j = 0; j < of[i].size(); ++j) of[i][j] = (of[i][j] - from[i][j]) * f;
  }
  return of;
}

std::vector<NamedParameters> with(std::vector<NamedParameters> mechanisms, NamedParameters added) {
  mechanisms.push_back(std::move(added));
  return mechanisms;
}

}  // namespace

double HypothesisFit::ranking() const {
  return gain / inflation - 1.5 * static_cast<double>(std::max<std::size_t>(1, hypothesis.coordinates.size()));
}

/// Scores of the hypothesis' own directions with the nuisance's part taken out.
struct HypothesisFitter::Effective {
  Eigen::MatrixXd by_location;  // [L][n]
  Eigen::MatrixXd information;  // [n][n]
  Eigen::VectorXd total;
  double inflation = 1;
};

HypothesisFitter::HypothesisFitter(EchoSource& source, const SessionModel& model, int folds)
    : source_(source), model_(model), folds_(folds) {}

HypothesisFitter::Effective HypothesisFitter::effective(const Scores& s, int globals) const {
  Effective e;
  const Eigen::Index n = s.information.rows() - globals;
  const Eigen::MatrixXd nuisance = s.information.topLeftCorner(globals, globals);
  const Eigen::MatrixXd projection = nuisance.ldlt().solve(s.information.topRightCorner(globals, n));  // [g][n]
  e.by_location = s.by_location.rightCols(n) - s.by_location.leftCols(globals) * projection;
  e.information =
      s.information.bottomRightCorner(n, n) - s.information.topRightCorner(globals, n).transpose() * projection;
  e.information.diagonal().array() += 1e-9 * e.information.diagonal().array().abs() + 1e-12;
  e.total = s.total.tail(n) - projection.transpose() * s.total.head(globals);
  const double locations = static_cast<double>(e.by_location.rows());
  if (locations > 1 && n > 0) {
    const Eigen::MatrixXd centred = e.by_location.rowwise() - e.by_location.colwise().mean();
    const Eigen::MatrixXd scatter = centred.transpose() * centred * (locations / (locations - 1));
    const Eigen::MatrixXd ratio = e.information.ldlt().solve(scatter);
    e.inflation = std::clamp(ratio.trace() / static_cast<double>(n), 1.0, kMaxInflation);
  }
  return e;
}

ModelState HypothesisFitter::state(const std::vector<NamedParameters>& mechanisms, const Nuisance* start) {
  ModelState s;
  s.mechanisms = mechanisms;
  s.echoes = source_.echoes(mechanisms);
  s.nuisance = start != nullptr ? *start : model_.start(s.echoes);
  model_.fit(s.echoes, s.nuisance, start != nullptr ? 4 : 16);
  s.log_likelihood = model_.logLikelihood(s.echoes, s.nuisance, &s.by_pose);
  s.basis = model_.basis(s.echoes, s.nuisance);
  return s;
}

std::vector<std::pair<int, double>> HypothesisFitter::suspects(const ModelState& null) const {
  std::vector<std::pair<int, double>> result;
  const LatentSpread spread = model_.spread();
  for (std::size_t a = 0; a < null.nuisance.actor_gain.size(); ++a) {
    const double gain = null.nuisance.actor_gain[a] / spread.actor_gain;
    const double range = null.nuisance.actor_range_m[a] / spread.actor_range_m;
    result.emplace_back(static_cast<int>(a), 0.5 * (gain * gain + range * range));
  }
  std::stable_sort(result.begin(), result.end(), [](const auto& a, const auto& b) { return a.second > b.second; });
  return result;
}

Screened HypothesisFitter::screen(const ModelState& null, const Hypothesis& hypothesis, const std::vector<int>& poses) {
  Screened result{hypothesis, 0, std::vector<double>(hypothesis.coordinates.size(), 1.0)};
  std::vector<PoseEchoes> looked_at;
  for (int i : poses) looked_at.push_back(null.echoes[static_cast<std::size_t>(i)]);
  const SessionCovariance base = model_.covariance(looked_at, null.nuisance, poses);
  std::vector<SessionCovariance> directions;
  const std::size_t count = std::max<std::size_t>(1, hypothesis.coordinates.size());
  for (std::size_t j = 0; j < count; ++j) {
    std::vector<double> at(hypothesis.coordinates.size(), 0.0);
    if (!at.empty()) at[j] = 1;
    const auto echoes = source_.echoes(with(null.mechanisms, hypothesis.at(at)), poses);
    directions.push_back(difference(model_.covariance(echoes, null.nuisance, poses), base, 1));
  }
  const Effective e = effective(model_.scores(null.basis, directions, poses), null.nuisance.globals());
  const double whole = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  Eigen::VectorXd step = e.information.ldlt().solve(e.total);
  if (hypothesis.coordinates.empty()) {
    // There or not: the promise of being there at all, by the quadratic at 1.
    result.promised = whole * (e.total[0] - 0.5 * e.information(0, 0)) / e.inflation;
    return result;
  }
  bool possible = true;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const Coordinate& c = hypothesis.coordinates[j];
    const bool one_sided =
        c.logarithmic() || c.min == c.neutral || c.max == c.neutral || hypothesis.coordinates[j].min > -1e-12;
    if (one_sided && step[static_cast<Eigen::Index>(j)] <= 0) possible = false;
    result.start[j] = std::clamp(step[static_cast<Eigen::Index>(j)], one_sided ? 0.02 : -8.0, 8.0);
  }
  if (possible) result.promised = whole * 0.5 * e.total.dot(step) / e.inflation;
  return result;
}

HypothesisFit HypothesisFitter::fit(const ModelState& null, const Hypothesis& hypothesis,
                                    const std::vector<double>& start, int iterations) {
  HypothesisFit f;
  f.hypothesis = hypothesis;
  const int globals = null.nuisance.globals();
  const Eigen::Index n = static_cast<Eigen::Index>(hypothesis.coordinates.size());
  const auto evaluate = [&](const std::vector<double>& scaled, const Nuisance& nuisance) {
    ModelState s;
    s.mechanisms = with(null.mechanisms, hypothesis.at(scaled));
    s.echoes = source_.echoes(s.mechanisms);
    s.nuisance = nuisance;
    s.log_likelihood = model_.logLikelihood(s.echoes, nuisance, &s.by_pose);
    return s;
  };
  // A cause may have been fitted as the latents of all poses or actors: it starts without them, too.
  Nuisance without = null.nuisance;
  std::fill(without.yaw_rad.begin(), without.yaw_rad.end(), 0.0);
  Nuisance bare = without;
  std::fill(bare.actor_gain.begin(), bare.actor_gain.end(), 0.0);
  std::fill(bare.actor_range_m.begin(), bare.actor_range_m.end(), 0.0);
  const auto consider = [&](const std::vector<double>& scaled) {
    ModelState s = evaluate(scaled, null.nuisance);
    for (const Nuisance* other : {&without, &bare}) {
      std::vector<double> by_pose;
      const double value = model_.logLikelihood(s.echoes, *other, &by_pose);
      if (value <= s.log_likelihood) continue;
      s.log_likelihood = value;
      s.nuisance = *other;
      s.by_pose = std::move(by_pose);
    }
    if (f.scaled.size() == scaled.size() && !f.state.echoes.empty() && s.log_likelihood <= f.state.log_likelihood)
      return;
    f.state = std::move(s);
    f.scaled = scaled;
  };
  consider(start);
  if (n == 1 && hypothesis.coordinates[0].min < hypothesis.coordinates[0].neutral &&
      !hypothesis.coordinates[0].logarithmic()) {
    for (double scaled : {-3.0, -1.0, 1.0, 3.0}) consider({scaled});  // what latents hide starts from far off
  }
  if (n > 0) {
    for (double factor : {0.4, 2.0}) {
      std::vector<double> other = start;
      for (double& v : other) v *= factor;
      consider(other);
    }
  }
  std::vector<int> everyone(null.echoes.size());
  std::iota(everyone.begin(), everyone.end(), 0);
  const auto derivatives = [&](const ModelState& s, const std::vector<double>& scaled) {
    std::vector<SessionCovariance> directions;
    const SessionCovariance here = model_.covariance(s.echoes, s.nuisance, everyone);
    for (Eigen::Index j = 0; j < n; ++j) {
      std::vector<double> moved = scaled;
      const double step = hypothesis.coordinates[static_cast<std::size_t>(j)].logarithmic()
                              ? kSmallStep * std::max(1e-4, std::abs(scaled[static_cast<std::size_t>(j)]))
                              : kSmallStep;
      moved[static_cast<std::size_t>(j)] += step;
      directions.push_back(difference(
          model_.covariance(source_.echoes(with(null.mechanisms, hypothesis.at(moved))), s.nuisance, everyone), here,
          step));
    }
    return model_.scores(model_.basis(s.echoes, s.nuisance), directions, everyone);
  };
  Scores scores;
  for (int i = 0;; ++i) {
    scores = derivatives(f.state, f.scaled);
    Eigen::MatrixXd information = scores.information;
    information.diagonal().array() += 1e-9 * information.diagonal().array().abs() + 1e-12;
    const Eigen::VectorXd step = information.ldlt().solve(scores.total);
    if (i >= iterations || 0.5 * scores.total.dot(step) < kEnough) break;
    bool better = false;
    for (double share : {1.0, 0.4, 0.1}) {
      std::vector<double> next = f.scaled;
      for (Eigen::Index j = 0; j < n; ++j) {
        const Coordinate& c = hypothesis.coordinates[static_cast<std::size_t>(j)];
        double& v = next[static_cast<std::size_t>(j)];
        v += share * std::clamp(step[globals + j], -3.0, 3.0);
        if (c.logarithmic()) v = std::max(v, 0.3 * f.scaled[static_cast<std::size_t>(j)]);
        const double low = std::min(c.scaled(c.min), c.scaled(c.max)),
                     high = std::max(c.scaled(c.min), c.scaled(c.max));
        v = std::clamp(v, low, high);
      }
      ModelState s = evaluate(next, model_.stepped(f.state.nuisance, step.head(globals), scores, step, share));
      if (s.log_likelihood <= f.state.log_likelihood) continue;
      f.state = std::move(s);
      f.scaled = next;
      better = true;
      break;
    }
    if (!better) break;
  }
  f.gain = f.state.log_likelihood - null.log_likelihood;

  // Scatter over places: of the scores at the fit where there is a number, else of the gain itself.
  const double locations = static_cast<double>(model_.data().locations.size());
  if (n > 0) {
    const Effective e = effective(scores, globals);
    f.inflation = e.inflation;
    const Eigen::MatrixXd covariance = e.information.inverse();
    Eigen::MatrixXd middle = e.information;
    if (locations > 2) {
      const Eigen::MatrixXd centred = e.by_location.rowwise() - e.by_location.colwise().mean();
      middle = centred.transpose() * centred * (locations / (locations - 1));
    }
    const Eigen::MatrixXd robust = covariance * middle * covariance;
    for (Eigen::Index j = 0; j < n; ++j) {
      const double variance = std::max(robust(j, j), covariance(j, j));
      f.standard_error.push_back(
          std::sqrt(variance) *
          std::abs(hypothesis.coordinates[static_cast<std::size_t>(j)].slope(f.scaled[static_cast<std::size_t>(j)])));
    }
    // Without a fold: one step away from the fit by that fold's scores.
    for (int k = 0; k < folds_; ++k) {
      Eigen::VectorXd left_out = Eigen::VectorXd::Zero(n);
      double share = 0;
      for (Eigen::Index l = 0; l < e.by_location.rows(); ++l) {
        if (fold(static_cast<int>(l)) != k) continue;
        left_out += e.by_location.row(l).transpose();
        share += 1 / locations;
      }
      const Eigen::VectorXd shift = covariance * left_out / std::max(0.2, 1 - share);
      std::vector<double> scaled = f.scaled;
      for (Eigen::Index j = 0; j < n; ++j) scaled[static_cast<std::size_t>(j)] -= shift[j];
      f.fold_scaled.push_back(scaled);
      f.held_out_gain -= left_out.dot(shift) + 0.5 * share * shift.dot(e.information * shift);
    }
  } else {
    f.fold_scaled.assign(static_cast<std::size_t>(folds_), {});
    std::vector<double> by_location(model_.data().locations.size(), 0.0);
    for (std::size_t i = 0; i < f.state.by_pose.size(); ++i) {
      by_location[static_cast<std::size_t>(model_.data().poses[i].location)] += f.state.by_pose[i] - null.by_pose[i];
    }
    double mean = 0, squares = 0;
    for (double v : by_location) mean += v / locations;
    for (double v : by_location) squares += (v - mean) * (v - mean);
    // A gain of G nats by chance scatters by sqrt(2 G).
    if (locations > 1 && f.gain > 0) {
      f.inflation = std::clamp(squares * locations / (locations - 1) / (2 * f.gain), 1.0, kMaxInflation);
    }
  }
  f.held_out_gain += f.gain;
  return f;
}

void HypothesisFitter::judge(HypothesisFit& f, std::size_t family) const {
  // Twice the gain over its inflation against F: the inflation itself was estimated from the places.
  const double n = static_cast<double>(std::max<std::size_t>(1, f.hypothesis.coordinates.size()));
  const double locations = static_cast<double>(model_.data().locations.size());
  const double statistic = 2 * std::max(0.0, f.gain) / f.inflation / n;
  const boost::math::fisher_f distribution(n, std::max(1.0, locations - n));
  f.false_alarm_rate =
      std::min(1.0, static_cast<double>(family) * boost::math::cdf(boost::math::complement(distribution, statistic)));
}

}  // namespace mmradartwin
