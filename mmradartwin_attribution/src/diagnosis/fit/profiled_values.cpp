#include "diagnosis/fit/profiled_values.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace mmradartwin::diagnosis::fit {
namespace {

/// Most Fisher steps of the latents at each point. Fewer would leave latents on the way to where they take in a part of
/// the step, and the profile would be too steep.
constexpr int kRefits = 12;
constexpr std::size_t kMostProfiled = 6;  ///< numbers profiled jointly: each pair of them costs one point
constexpr int kWidths = 3;                ///< widths of a step that are tried
constexpr double kWidest = 1;             ///< largest width of a geometry's step, scaled

/// Fall of the likelihood that a step should cause, in nats, and the narrowest step.
struct Fall {
  double least, wanted, most;
  double narrowest;  ///< scaled
};
constexpr Fall kSmooth = {1, 3, 15, 1e-6};
constexpr Fall kRough = {10, 25, 80, 0.1};  ///< well above the jumps of paths that appear and vanish within millimetres
constexpr double kMostCorrelated = 0.95;    ///< limit of the correlation of two values

/// Likelihood at one point, with all latents refitted.
struct ProfilePoint {
  double log_likelihood = 0;
  Eigen::VectorXd by_location;  ///< [locations] nats, with the prior of the headings there
  Eigen::VectorXd errors;       ///< [2 errors] errors of the actors, in standard deviations
  SessionLatents latents;
};

// Paths that begin and end within the session locate things, too. Ranges and directions do not say everything.
constexpr double kMostErrorRatio = 10;  ///< limit of the geometric standard error, over the likelihood's own
/// Least amplitude of an echo that locates things, over the pose's strongest.
constexpr double kLeastAmplitudeShare = 0.1;
constexpr double kSmallChange = 0.125;   ///< step of numerical derivatives, scaled
constexpr double kLeastInformation = 1;  ///< least information of ranges about a scaled value for which they locate it

/// Variance of the scaled coordinates by the ranges and directions of strong echoes, where actors have range errors and
/// poses have heading errors. All echoes of one actor or pose share these errors. 0 for a coordinate that moves no
/// echo.
Eigen::VectorXd geometricVariance(const std::vector<std::vector<PathShift>>& by_coordinate, int actors, int poses,
                                  const PoseAccuracy& accuracy, const LatentSpread& spread) {
  // Unknowns: the coordinates, the range errors of actors and of everything outside the scene, the headings of poses.
  const Eigen::Index n = static_cast<Eigen::Index>(by_coordinate.size()), all = n + actors + 1 + poses;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
  information.diagonal().segment(n, actors + 1).setOnes();
  information.diagonal().tail(poses).setOnes();
  const double range_m = std::hypot(accuracy.path_range_m, accuracy.position_m);
  std::vector<double> strongest(static_cast<std::size_t>(poses), 0.0);
  for (const PathShift& p : by_coordinate.front()) {
    strongest[p.place] = std::max(strongest[p.place], p.amplitude);
  }
  using Key = std::tuple<std::size_t, const std::string*, PerInteraction<int>>;
  std::vector<std::map<Key, const PathShift*>> shifts(by_coordinate.size());
  for (std::size_t j = 0; j < shifts.size(); ++j) {
    for (const PathShift& p : by_coordinate[j]) shifts[j][{p.place, p.event, p.facets}] = &p;
  }
  // The error of a pose's position is common to its echoes: all of them measure a range as well as one does.
  std::vector<double> echoes(strongest.size(), 0.0);
  const auto carries = [&](const PathShift& p) { return p.amplitude >= kLeastAmplitudeShare * strongest[p.place]; };
  for (const auto& [key, path] : shifts.front()) echoes[path->place] += carries(*path);
  for (const auto& [key, path] : shifts.front()) {
    if (!carries(*path)) continue;
    Eigen::VectorXd range = Eigen::VectorXd::Zero(all), azimuth = Eigen::VectorXd::Zero(all);
    bool shared = true;
    for (Eigen::Index j = 0; j < n && shared; ++j) {
      const auto& of_coordinate = shifts[static_cast<std::size_t>(j)];
      const auto shift = of_coordinate.find(key);
      shared = shift != of_coordinate.end();
      if (!shared) break;
      range[j] = shift->second->range_m / kSmallChange / range_m;
      azimuth[j] = shift->second->azimuth_rad / kSmallChange / accuracy.path_angle_rad;
    }
    if (!shared) continue;
    for (int a : path->actors) range[n + (a >= 0 ? a : actors)] += spread.actor_range_m / range_m;
    if (path->actors.empty()) range[n + actors] += spread.actor_range_m / range_m;
    azimuth[n + actors + 1 + static_cast<Eigen::Index>(path->place)] = accuracy.heading_rad / accuracy.path_angle_rad;
    information += range * range.transpose() / echoes[path->place] + azimuth * azimuth.transpose();
  }
  const Eigen::ArrayXd own = information.diagonal().head(n).array();
  information.diagonal().head(n).array() += 1e-12;
  const Eigen::ArrayXd variance = information.inverse().diagonal().head(n).array();
  return (own > kLeastInformation).select(variance, 0.0);
}

/// Positive definite matrix close to these curvatures: numerical differences of a rough likelihood need not describe a
/// maximum. Correlations are limited to kMostCorrelated.
Eigen::MatrixXd positiveDefinite(const Eigen::MatrixXd& fall) {
  const Eigen::VectorXd scale = fall.diagonal().cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> alike(scale.cwiseInverse().asDiagonal() * fall *
                                                             scale.cwiseInverse().asDiagonal());
  const Eigen::MatrixXd to = scale.asDiagonal() * alike.eigenvectors();
  return to * alike.eigenvalues().cwiseMax(1 - kMostCorrelated).asDiagonal() * to.transpose();
}

/// Steps to both sides of the fit along one coordinate.
struct Step {
  double width = 0;
  ProfilePoint ahead, behind;
  double curvature = 0;
  bool flat = false;  ///< the likelihood does not fall: only the width limits the error
};

/// Profile of the likelihood about a fit, along each coordinate and at one corner of each pair.
class Profile {
 public:
  /// start: latents near those of the fit.
  Profile(const ProfiledModel& model, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
          const SessionLatents& start);
  /// Values at the best point, with the fit's errors.
  const ProfiledValues& best() const { return best_; }
  /// Latents of the fit.
  const SessionLatents& latents() const { return here_.latents; }
  /// True where the maximum lies beyond the steps, so that they give no width.
  bool endsBeyondItsSteps() const;
  /// Values at the best point with their standard errors.
  ProfiledValues withErrors() const;

 private:
  std::vector<NamedParameters> mechanismsAt(const std::vector<double>& scaled_values) const {
    return mechanismsWith(model_.base, parts_, scaled_values);
  }
  /// start: where the latents are likely to be.
  ProfilePoint pointAt(const std::vector<double>& scaled_values, const SessionLatents& start) const;
  /// Latents that lie from `from` by a share of what `point` lies from the fit.
  SessionLatents beyond(const SessionLatents& from, const ProfilePoint& point, double share) const {
    return model_.likelihood.extrapolated(from, here_.latents, point.latents, share);
  }
  /// Makes a point the best one where its likelihood is higher.
  void consider(const ProfilePoint& point, const std::vector<double>& scaled_values);
  /// Limits of the scaled value of coordinate j.
  std::pair<double, double> limits(std::size_t j) const;
  Step stepAlong(std::size_t j, const Fall& wanted);
  void evaluateCorners();
  void climbToTop();
  Eigen::VectorXd geometricVarianceHere() const;

  const ProfiledModel& model_;
  const std::vector<Hypothesis>& parts_;
  const ProfiledValues& fit_;
  std::vector<Coordinate> coordinates_;
  std::vector<char> traces_;  ///< [coordinates] the coordinate changes traced paths
  ProfilePoint here_;
  double highest_ = 0;
  ProfiledValues best_;
  std::vector<Step> steps_;
  Eigen::VectorXd slope_;
  Eigen::MatrixXd fall_, scores_, errors_;  ///< [n][n], [locations][n], [2 errors][n]
  Eigen::MatrixXd covariance_;              ///< [n][n] inverse of the curvatures
  Eigen::VectorXd to_top_;
  std::vector<double> top_;
  Eigen::VectorXd geometric_;
};

Profile::Profile(const ProfiledModel& model, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                 const SessionLatents& start)
    : model_(model), parts_(parts), fit_(fit), best_(fit) {
  for (const Hypothesis& h : parts) {
    coordinates_.insert(coordinates_.end(), h.coordinates.begin(), h.coordinates.end());
    traces_.resize(coordinates_.size(),
                   model.source.altersGeometry(h.at(std::vector<double>(h.coordinates.size(), 1.0))));
  }
  const bool rough = std::count(traces_.begin(), traces_.end(), 1) > 0;
  here_.latents = start;
  here_ = pointAt(fit.scaled_values, here_.latents);
  highest_ = here_.log_likelihood;
  for (std::size_t j = 0; j < coordinates_.size(); ++j) steps_.push_back(stepAlong(j, rough ? kRough : kSmooth));
  evaluateCorners();
  climbToTop();
}

ProfilePoint Profile::pointAt(const std::vector<double>& scaled_values, const SessionLatents& start) const {
  const ChannelData& data = model_.likelihood.data();
  const LatentSpread& spread = model_.likelihood.spread();
  const std::vector<PoseEchoes> echoes =
      model_.source.echoes(mechanismsAt(scaled_values), model_.latents.actor_range_m);
  const bool likelier = &start != &here_.latents && model_.likelihood.logLikelihood(echoes, start) >
                                                        model_.likelihood.logLikelihood(echoes, here_.latents);
  SessionLatents fitted = likelier ? start : here_.latents;
  model_.likelihood.fit(echoes, fitted, kRefits);
  std::vector<double> by_pose;
  ProfilePoint point;
  point.log_likelihood = model_.likelihood.logLikelihood(echoes, fitted, &by_pose);
  point.by_location = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(data.locations.size()));
  for (std::size_t i = 0; i < by_pose.size(); ++i) {
    const double heading = fitted.yaw_rad[i] / model_.accuracy.heading_rad;
    point.by_location[data.poses[i].location] += by_pose[i] - 0.5 * heading * heading;
  }
  const Eigen::Index errors = static_cast<Eigen::Index>(fitted.actor_gain.size());
  point.errors.resize(2 * errors);
  point.errors << Eigen::Map<const Eigen::VectorXd>(fitted.actor_gain.data(), errors) / spread.actor_gain,
      Eigen::Map<const Eigen::VectorXd>(fitted.actor_range_m.data(), errors) / spread.actor_range_m;
  point.latents = std::move(fitted);
  return point;
}

void Profile::consider(const ProfilePoint& point, const std::vector<double>& scaled_values) {
  if (point.log_likelihood <= highest_) return;
  highest_ = point.log_likelihood;
  best_.scaled_values = scaled_values;
}

std::pair<double, double> Profile::limits(std::size_t j) const {
  const Coordinate& c = coordinates_[j];
  return std::minmax({c.scaled(c.min), c.scaled(c.max)});
}

Step Profile::stepAlong(std::size_t j, const Fall& wanted) {
  const std::vector<double>& fitted = fit_.scaled_values;
  const double slope = std::abs(coordinates_[j].slope(fitted[j]));
  const auto [low, high] = limits(j);
  const double widest = std::min(fitted[j] - low, high - fitted[j]);
  Step step;
  step.width = std::max(wanted.narrowest, 2 * fit_.standard_error[j] / slope);
  if (traces_[j]) step.width = std::min(step.width, kWidest);
  const auto within = [&](double width) { return widest > 0 ? std::min(width, widest) : width; };
  step.width = within(step.width);
  std::vector<double> moved = fitted;
  double last_width = 0;
  for (int i = 1;; ++i) {
    moved[j] = fitted[j] + step.width;
    step.ahead = i == 1 ? pointAt(moved, here_.latents)
                        : pointAt(moved, beyond(here_.latents, step.ahead, step.width / last_width));
    moved[j] = fitted[j] - step.width;
    step.behind = pointAt(moved, beyond(here_.latents, step.ahead, -1));
    last_width = step.width;
    const double fall = here_.log_likelihood - 0.5 * (step.ahead.log_likelihood + step.behind.log_likelihood);
    step.curvature = 2 * fall / (step.width * step.width);
    const bool narrower = fall > wanted.most && step.width > wanted.narrowest;
    if (i == kWidths || (fall >= wanted.least && !narrower)) break;
    const double other = step.width * std::clamp(std::sqrt(wanted.wanted / std::max(fall, 0.1)), 0.1, 4.0);
    const double next = within(std::max(other, wanted.narrowest));
    if (next == step.width) break;
    step.width = next;
  }
  const double least = 0.2 / (step.width * step.width);
  step.flat = step.curvature < least;
  step.curvature = std::max(step.curvature, least);
  for (double side : {-1.0, 1.0}) {
    moved = fitted;
    moved[j] += side * step.width;
    consider(side < 0 ? step.behind : step.ahead, moved);
  }
  return step;
}

void Profile::evaluateCorners() {
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates_.size());
  slope_ = Eigen::VectorXd::Zero(n);
  fall_ = Eigen::MatrixXd::Zero(n, n);
  scores_ = Eigen::MatrixXd::Zero(here_.by_location.size(), n);
  errors_ = Eigen::MatrixXd::Zero(here_.errors.size(), n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Step& a = steps_[static_cast<std::size_t>(j)];
    fall_(j, j) = a.curvature;
    if (a.flat) continue;
    slope_[j] = (a.ahead.log_likelihood - a.behind.log_likelihood) / (2 * a.width);
    scores_.col(j) = (a.ahead.by_location - a.behind.by_location) / (2 * a.width);
    errors_.col(j) = (a.ahead.errors - a.behind.errors) / (2 * a.width);
    for (Eigen::Index k = 0; k < j; ++k) {
      const Step& b = steps_[static_cast<std::size_t>(k)];
      if (b.flat) continue;
      std::vector<double> moved = fit_.scaled_values;
      moved[static_cast<std::size_t>(j)] += a.width;
      moved[static_cast<std::size_t>(k)] += b.width;
      const ProfilePoint corner = pointAt(moved, beyond(a.ahead.latents, b.ahead, 1));
      consider(corner, moved);
      const double both = corner.log_likelihood - a.ahead.log_likelihood - b.ahead.log_likelihood;
      const double most = kMostCorrelated * std::sqrt(a.curvature * b.curvature);
      fall_(j, k) = fall_(k, j) = std::clamp(-(both + here_.log_likelihood) / (a.width * b.width), -most, most);
    }
  }
}

void Profile::climbToTop() {
  covariance_ = positiveDefinite(fall_).inverse();
  to_top_ = covariance_ * slope_;
  top_ = fit_.scaled_values;
  SessionLatents latents = here_.latents;
  for (std::size_t j = 0; j < top_.size(); ++j) {
    const auto [low, high] = limits(j);
    const double width = steps_[j].width;
    top_[j] =
        std::clamp(fit_.scaled_values[j] + std::clamp(to_top_[static_cast<Eigen::Index>(j)], -width, width), low, high);
    latents = beyond(latents, steps_[j].ahead, (top_[j] - fit_.scaled_values[j]) / width);
  }
  geometric_ = geometricVarianceHere();
  consider(pointAt(top_, latents), top_);
}

Eigen::VectorXd Profile::geometricVarianceHere() const {
  std::vector<int> everyone(model_.likelihood.data().poses.size());
  std::iota(everyone.begin(), everyone.end(), 0);
  std::vector<std::vector<PathShift>> by_coordinate;
  for (std::size_t j = 0; j < coordinates_.size(); ++j) {
    std::vector<double> moved = fit_.scaled_values;
    moved[j] += kSmallChange;
    by_coordinate.push_back(model_.source.pathShifts(mechanismsAt(moved), mechanismsAt(fit_.scaled_values), everyone));
  }
  return geometricVariance(by_coordinate, static_cast<int>(model_.latents.actor_gain.size()) - 1,
                           static_cast<int>(everyone.size()), model_.accuracy, model_.likelihood.spread());
}

bool Profile::endsBeyondItsSteps() const {
  bool further = false;
  for (std::size_t j = 0; j < steps_.size(); ++j) {
    further = further || std::abs(to_top_[static_cast<Eigen::Index>(j)]) > steps_[j].width;
  }
  return best_.scaled_values != fit_.scaled_values && (further || best_.scaled_values != top_);
}

ProfiledValues Profile::withErrors() const {
  const Eigen::MatrixXd centred = scores_.rowwise() - scores_.colwise().mean();
  const double locations = static_cast<double>(scores_.rows());
  // An actor's error is the same at all places, so that its prior bounds it and the scatter over places does not show
  // it.
  const Eigen::MatrixXd scatter =
      centred.transpose() * centred * (locations / std::max(1.0, locations - 1)) + errors_.transpose() * errors_;
  const Eigen::MatrixXd robust = covariance_ * scatter * covariance_;
  ProfiledValues result = best_;
  for (std::size_t k = 0; k < coordinates_.size(); ++k) {
    const Eigen::Index j = static_cast<Eigen::Index>(k);
    double variance = locations > 2 ? std::max(robust(j, j), covariance_(j, j)) : covariance_(j, j);
    variance = std::max(variance, std::min(geometric_[j], kMostErrorRatio * kMostErrorRatio * variance));
    result.standard_error[k] =
        std::sqrt(std::max(0.0, variance)) * std::abs(coordinates_[k].slope(result.scaled_values[k]));
  }
  return result;
}

}  // namespace

ProfiledValues profiled(const ProfiledModel& model, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                        int again) {
  ProfiledValues values = fit;
  SessionLatents latents = model.latents;
  for (;; --again) {
    const Profile profile(model, parts, values, latents);
    if (!profile.endsBeyondItsSteps() || again <= 0) return profile.withErrors();
    values = profile.best();
    latents = profile.latents();
  }
}

bool profileParts(const ProfiledModel& model, const std::vector<Hypothesis>& parts, std::vector<ProfiledValues>& fits,
                  std::optional<std::size_t> only) {
  std::vector<std::size_t> few;
  std::size_t numbers = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (fits[i].scaled_values.empty() || fits[i].scaled_values.size() > kMostProfiled) continue;
    few.push_back(i);
    numbers += fits[i].scaled_values.size();
  }
  std::vector<std::vector<std::size_t>> groups;
  if (numbers <= kMostProfiled && !few.empty()) groups.push_back(few);
  for (std::size_t i : few) {
    if (numbers > kMostProfiled) groups.push_back({i});
  }
  bool all = true;
  for (const std::vector<std::size_t>& group : groups) {
    if (only && std::find(group.begin(), group.end(), *only) == group.end()) {
      all = false;
      continue;
    }
    std::vector<NamedParameters> beside = model.base;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const bool member = std::find(group.begin(), group.end(), i) != group.end();
      if (!member) replaceOrAppend(parts[i].at(fits[i].scaled_values), beside);
    }
    std::vector<Hypothesis> members;
    ProfiledValues joint;
    for (std::size_t i : group) {
      members.push_back(parts[i]);
      joint.scaled_values.insert(joint.scaled_values.end(), fits[i].scaled_values.begin(), fits[i].scaled_values.end());
      joint.standard_error.insert(joint.standard_error.end(), fits[i].standard_error.begin(),
                                  fits[i].standard_error.end());
    }
    joint = profiled({model.source, model.likelihood, model.accuracy, beside, model.latents}, members, joint);
    auto scaled_values = joint.scaled_values.begin(), error = joint.standard_error.begin();
    for (std::size_t i : group) {
      const auto count = static_cast<std::ptrdiff_t>(fits[i].scaled_values.size());
      fits[i] = {{scaled_values, scaled_values + count}, {error, error + count}};
      scaled_values += count;
      error += count;
    }
  }
  return all;
}

}  // namespace mmradartwin::diagnosis::fit
