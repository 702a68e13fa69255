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

constexpr int kRefits = 3;                ///< of the latents, at each place
constexpr std::size_t kMostProfiled = 6;  ///< numbers: each pair of them is a place
constexpr int kWidths = 3;                ///< that are tried of a step

constexpr double kWidest = 1;  ///< of the scale, where geometry is first looked at: slopes may know nothing of it

/// What a step should cost, in nats, and how narrow it may be.
struct Fall {
  double least, wanted, most;
  double narrowest;  ///< of the scale
};
constexpr Fall kSmooth = {1, 3, 15, 1e-6};
// Beside what paths that come and go within millimetres bring.
constexpr Fall kRough = {10, 25, 80, 0.1};
constexpr double kMostAlike = 0.95;  ///< correlation of two values in the likelihood's fall, and of more together

/// The likelihood at one place, all latents refitted.
struct Place {
  double log_likelihood = 0;
  Eigen::VectorXd by_location;  ///< [locations] with the prior of the headings there
  Eigen::VectorXd latents;      ///< [2 actors] in standard deviations
};

// Where paths begin and end tells of places, too, so that ranges and directions do not say all.
constexpr double kMostBlurred = 10;     ///< times the likelihood's own error
constexpr double kCarries = 0.1;        ///< of the pose's strongest amplitude: echoes that places are known by
constexpr double kSmallChange = 0.125;  ///< of the scale, for derivatives
constexpr double kShows = 1;            ///< information about a typical value from which on ranges know of it

/// Variance of the coordinates as ranges and directions of the strong echoes know them, where actors have range errors
/// of their own and poses heading errors of their own: those errors are the same in all echoes of one actor or pose,
/// however many there are. 0 for a coordinate that moves no echo.
Eigen::VectorXd geometricVariance(const std::vector<std::vector<PathShift>>& by_coordinate, int actors, int poses,
                                  const PoseAccuracy& accuracy, const LatentSpread& spread) {
  // What the scene lacks has a range error of its own, too: it stands behind the actors.
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
  // A pose's own place is as wrong in all its echoes: together they know a range as one of them does.
  std::vector<double> echoes(strongest.size(), 0.0);
  const auto carries = [&](const PathShift& p) { return p.amplitude >= kCarries * strongest[p.place]; };
  for (const auto& [key, path] : shifts.front()) echoes[path->place] += carries(*path);
  for (const auto& [key, path] : shifts.front()) {
    if (!carries(*path)) continue;
    Eigen::VectorXd range = Eigen::VectorXd::Zero(all), azimuth = Eigen::VectorXd::Zero(all);
    bool shared = true;
    for (Eigen::Index j = 0; j < n && shared; ++j) {
      const auto& of = shifts[static_cast<std::size_t>(j)];
      const auto at = of.find(key);
      shared = at != of.end();
      if (!shared) break;
      range[j] = at->second->range_m / kSmallChange / range_m;
      azimuth[j] = at->second->azimuth_rad / kSmallChange / accuracy.path_angle_rad;
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
  return (own > kShows).select(variance, 0.0);
}

/// The likelihood's fall with the same curvatures, but falling to all sides: differences of a rough likelihood do not
/// add up to a top. No direction is flatter than that of two values so much alike.
Eigen::MatrixXd fallingToAllSides(const Eigen::MatrixXd& fall) {
  const Eigen::VectorXd scale = fall.diagonal().cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> alike(scale.cwiseInverse().asDiagonal() * fall *
                                                             scale.cwiseInverse().asDiagonal());
  const Eigen::MatrixXd to = scale.asDiagonal() * alike.eigenvectors();
  return to * alike.eigenvalues().cwiseMax(1 - kMostAlike).asDiagonal() * to.transpose();
}

/// A step to both sides of the fit along one coordinate.
struct Step {
  double width = 0;
  Place ahead, behind;
  double curvature = 0;
  bool flat = false;  ///< the likelihood does not fall: its width is all that is known of an error
};

}  // namespace

ProfiledValues profiled(ExpectedEchoes& source, const ChannelLikelihood& model,
                        const std::vector<NamedParameters>& base, const SessionLatents& nuisance,
                        const PoseAccuracy& accuracy, const std::vector<Hypothesis>& parts, const ProfiledValues& fit,
                        int again) {
  std::vector<Coordinate> coordinates;
  std::vector<char> traces;  // by coordinate
  for (const Hypothesis& h : parts) {
    coordinates.insert(coordinates.end(), h.coordinates.begin(), h.coordinates.end());
    traces.resize(coordinates.size(), source.altersGeometry(h.at(std::vector<double>(h.coordinates.size(), 1.0))));
  }
  const bool rough = std::count(traces.begin(), traces.end(), 1) > 0;
  const ChannelData& data = model.data();
  const LatentSpread spread = model.spread();
  const Eigen::Index locations = static_cast<Eigen::Index>(data.locations.size());
  const Eigen::Index n = static_cast<Eigen::Index>(coordinates.size());
  const auto mechanismsAt = [&](const std::vector<double>& at) { return mechanismsWith(base, parts, at); };
  const auto look = [&](const std::vector<double>& at) {
    SessionLatents fitted = nuisance;
    const std::vector<PoseEchoes> echoes = source.echoes(mechanismsAt(at), fitted.actor_range_m);
    model.fit(echoes, fitted, kRefits);
    std::vector<double> by_pose;
    Place place;
    place.log_likelihood = model.logLikelihood(echoes, fitted, &by_pose);
    place.by_location = Eigen::VectorXd::Zero(locations);
    for (std::size_t i = 0; i < by_pose.size(); ++i) {
      const double heading = fitted.yaw_rad[i] / accuracy.heading_rad;
      place.by_location[data.poses[i].location] += by_pose[i] - 0.5 * heading * heading;
    }
    const Eigen::Index actors = static_cast<Eigen::Index>(fitted.actor_gain.size());
    place.latents.resize(2 * actors);
    place.latents << Eigen::Map<const Eigen::VectorXd>(fitted.actor_gain.data(), actors) / spread.actor_gain,
        Eigen::Map<const Eigen::VectorXd>(fitted.actor_range_m.data(), actors) / spread.actor_range_m;
    return place;
  };
  const auto limits = [&](Eigen::Index j) {
    const Coordinate& c = coordinates[static_cast<std::size_t>(j)];
    return std::minmax({c.scaled_values(c.min), c.scaled_values(c.max)});
  };
  const std::vector<double>& scaled_values = fit.scaled_values;
  const Fall wanted = rough ? kRough : kSmooth;
  const Place here = look(scaled_values);
  // The best place of all that are looked at.
  double highest = here.log_likelihood;
  std::vector<double> highest_at = scaled_values;
  const auto consider = [&](const Place& place, const std::vector<double>& at) {
    if (place.log_likelihood <= highest) return;
    highest = place.log_likelihood;
    highest_at = at;
  };
  std::vector<Step> steps;
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::size_t k = static_cast<std::size_t>(j);
    const double slope = std::abs(coordinates[k].slope(scaled_values[k]));
    const auto [low, high] = limits(j);
    const double widest = std::min(scaled_values[k] - low, high - scaled_values[k]);
    Step step;
    step.width = std::max(wanted.narrowest, 2 * fit.standard_error[k] / slope);
    if (traces[k]) step.width = std::min(step.width, kWidest);
    for (int i = 1;; ++i) {
      if (widest > 0) step.width = std::min(step.width, widest);
      std::vector<double> at = scaled_values;
      at[k] = scaled_values[k] + step.width;
      step.ahead = look(at);
      at[k] = scaled_values[k] - step.width;
      step.behind = look(at);
      const double fall = here.log_likelihood - 0.5 * (step.ahead.log_likelihood + step.behind.log_likelihood);
      step.curvature = 2 * fall / (step.width * step.width);
      const bool narrower = fall > wanted.most && step.width > wanted.narrowest;
      if (i == kWidths || (fall >= wanted.least && !narrower)) break;
      step.width *= std::clamp(std::sqrt(wanted.wanted / std::max(fall, 0.1)), 0.1, 4.0);
      step.width = std::max(step.width, wanted.narrowest);
    }
    const double least = 0.2 / (step.width * step.width);
    step.flat = step.curvature < least;
    step.curvature = std::max(step.curvature, least);
    for (double side : {-1.0, 1.0}) {
      std::vector<double> at = scaled_values;
      at[k] += side * step.width;
      consider(side < 0 ? step.behind : step.ahead, at);
    }
    steps.push_back(std::move(step));
  }
  Eigen::VectorXd slope = Eigen::VectorXd::Zero(n);
  Eigen::MatrixXd fall = Eigen::MatrixXd::Zero(n, n), scores = Eigen::MatrixXd::Zero(locations, n),
                  latents = Eigen::MatrixXd::Zero(here.latents.size(), n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const Step& a = steps[static_cast<std::size_t>(j)];
    fall(j, j) = a.curvature;
    if (a.flat) continue;
    slope[j] = (a.ahead.log_likelihood - a.behind.log_likelihood) / (2 * a.width);
    scores.col(j) = (a.ahead.by_location - a.behind.by_location) / (2 * a.width);
    latents.col(j) = (a.ahead.latents - a.behind.latents) / (2 * a.width);
    for (Eigen::Index k = 0; k < j; ++k) {
      const Step& b = steps[static_cast<std::size_t>(k)];
      if (b.flat) continue;
      std::vector<double> at = scaled_values;
      at[static_cast<std::size_t>(j)] += a.width;
      at[static_cast<std::size_t>(k)] += b.width;
      const Place corner = look(at);
      consider(corner, at);
      const double both = corner.log_likelihood - a.ahead.log_likelihood - b.ahead.log_likelihood;
      const double most = kMostAlike * std::sqrt(a.curvature * b.curvature);
      fall(j, k) = fall(k, j) = std::clamp(-(both + here.log_likelihood) / (a.width * b.width), -most, most);
    }
  }
  const Eigen::MatrixXd centred = scores.rowwise() - scores.colwise().mean();
  const double count = static_cast<double>(locations);
  // Errors of actors are the same at all places: their priors say how far they reach.
  const Eigen::MatrixXd scatter =
      centred.transpose() * centred * (count / std::max(1.0, count - 1)) + latents.transpose() * latents;
  const Eigen::MatrixXd covariance = fallingToAllSides(fall).inverse();
  const Eigen::MatrixXd robust = covariance * scatter * covariance;
  const Eigen::VectorXd to_top = covariance * slope;
  std::vector<double> top = scaled_values;
  Eigen::VectorXd widths(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::size_t k = static_cast<std::size_t>(j);
    const auto [low, high] = limits(j);
    widths[j] = steps[k].width;
    top[k] = std::clamp(scaled_values[k] + std::clamp(to_top[j], -steps[k].width, steps[k].width), low, high);
  }
  std::vector<int> everyone(data.poses.size());
  std::iota(everyone.begin(), everyone.end(), 0);
  std::vector<std::vector<PathShift>> by_coordinate;
  for (std::size_t k = 0; k < coordinates.size(); ++k) {
    std::vector<double> at = scaled_values;
    at[k] += kSmallChange;
    by_coordinate.push_back(source.pathShifts(mechanismsAt(at), mechanismsAt(scaled_values), everyone));
  }
  const Eigen::VectorXd geometric = geometricVariance(by_coordinate, static_cast<int>(nuisance.actor_gain.size()) - 1,
                                                      static_cast<int>(everyone.size()), accuracy, spread);
  ProfiledValues result = fit;
  consider(look(top), top);
  result.scaled_values = highest_at;
  // A slope so long was no top, and its steps tell no width.
  const bool further = (to_top.cwiseAbs().array() > widths.array()).any();
  if (result.scaled_values != scaled_values && (further || result.scaled_values != top) && again > 0) {
    return profiled(source, model, base, nuisance, accuracy, parts, result, again - 1);
  }
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::size_t k = static_cast<std::size_t>(j);
    double variance = locations > 2 ? std::max(robust(j, j), covariance(j, j)) : covariance(j, j);
    variance = std::max(variance, std::min(geometric[j], kMostBlurred * kMostBlurred * variance));
    result.standard_error[k] =
        std::sqrt(std::max(0.0, variance)) * std::abs(coordinates[k].slope(result.scaled_values[k]));
  }
  return result;
}

void profileParts(ExpectedEchoes& source, const ChannelLikelihood& model, const std::vector<NamedParameters>& base,
                  const SessionLatents& nuisance, const PoseAccuracy& accuracy, const std::vector<Hypothesis>& parts,
                  std::vector<ProfiledValues>& fits) {
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
  for (const std::vector<std::size_t>& group : groups) {
    std::vector<NamedParameters> beside = base;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (std::find(group.begin(), group.end(), i) == group.end())
        replaceOrAppend(parts[i].at(fits[i].scaled_values), beside);
    }
    std::vector<Hypothesis> members;
    ProfiledValues all;
    for (std::size_t i : group) {
      members.push_back(parts[i]);
      all.scaled_values.insert(all.scaled_values.end(), fits[i].scaled_values.begin(), fits[i].scaled_values.end());
      all.standard_error.insert(all.standard_error.end(), fits[i].standard_error.begin(), fits[i].standard_error.end());
    }
    all = profiled(source, model, beside, nuisance, accuracy, members, all);
    auto scaled_values = all.scaled_values.begin(), error = all.standard_error.begin();
    for (std::size_t i : group) {
      const auto count = static_cast<std::ptrdiff_t>(fits[i].scaled_values.size());
      fits[i] = {{scaled_values, scaled_values + count}, {error, error + count}};
      scaled_values += count;
      error += count;
    }
  }
}

}  // namespace mmradartwin::diagnosis::fit
