#include "diagnosis/actor_shifts.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "diagnosis/likelihood/profiled_scores.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kSameVertex_m = 1e-6;
constexpr int kSlopes = 4;  // times that slopes are taken anew: displacements then stay within a tenth of a millimetre

/// Change of a path's one-way range by the displacement of what its interaction i meets: half of what both legs there
/// gain. Both faces of a corner are met in their common edge, which moves along a face's normal with that face.
Eigen::Vector3d rangeByDisplacement(const PathRecord& path, std::size_t i, const Scene& scene,
                                    const Eigen::Vector3d& radar) {
  const Eigen::Vector3d& at = path.vertices[i];
  const Eigen::Vector3d before = at - (i > 0 ? path.vertices[i - 1] : radar);
  const Eigen::Vector3d after = at - (i + 1 < path.vertices.size() ? path.vertices[i + 1] : radar);
  if (before.norm() > kSameVertex_m && after.norm() > kSameVertex_m) {
    return 0.5 * (before.normalized() + after.normalized());
  }
  const int facet = i < path.facets.size() ? path.facets[i] : -1;
  const Eigen::Vector3d direction = (at - radar).normalized();
  if (facet < 0 || facet >= static_cast<int>(scene.facets.size())) return direction;
  const Eigen::Vector3d normal = scene.facets[static_cast<std::size_t>(facet)].normal;
  return direction.dot(normal) * normal;
}

/// [actors][2] mean over the echoes of each actor, weighted by power, of the above, at a pose; where it sees none, the
/// direction to the actor's middle.
Eigen::MatrixX2d directionsAt(const Twin& twin, const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) {
  const Scene& scene = twin.tracedScene();
  const std::vector<Actor>& actors = scene.actors;
  const Eigen::Vector3d radar = T_map_radar.translation();
  Eigen::MatrixX2d directions = Eigen::MatrixX2d::Zero(static_cast<Eigen::Index>(actors.size()), 2);
  std::vector<double> powers(actors.size(), 0.0);
  for (const PathRecord& path : twin.receivedPaths(T_map_radar, twin.trace(T_map_radar, stamp_ns), stamp_ns)) {
    const double power = path.amplitude * path.amplitude;
    for (std::size_t i = 0; i < std::min(path.actors.size(), path.vertices.size()); ++i) {
      if (path.actors[i] < 0) continue;
      directions.row(path.actors[i]) += power * rangeByDisplacement(path, i, scene, radar).head<2>().transpose();
      powers[static_cast<std::size_t>(path.actors[i])] += power;
    }
  }
  for (std::size_t a = 0; a < actors.size(); ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    if (powers[a] > 0) {
      directions.row(row) /= powers[a];
      continue;
    }
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& v : actors[a].vertices) middle += v / static_cast<double>(actors[a].vertices.size());
    directions.row(row) = (middle - radar).head<2>().normalized().transpose();
  }
  return directions;
}

}  // namespace

ActorShifts::ActorShifts(DiagnosisContext& context, const ModelState& state)
    : globals_(state.latents.globals()),
      errors_(static_cast<int>(state.latents.actor_range_m.size())),
      scene_m_(context.accuracy.scene_m) {
  const Scores prior = context.likelihood.freeScores(state.basis, {}, {});
  prior_information_ = prior.information;
  prior_score_ = prior.total;
  const std::vector<int> poses = everyPose(state);
  terms_.resize(poses.size());
  for (int p : poses) {
    const Pose& pose = context.data.poses[static_cast<std::size_t>(p)].pose;
    Eigen::MatrixX2d& direction = terms_[static_cast<std::size_t>(p)].direction;
    direction = Eigen::MatrixX2d::Zero(errors_, 2);
    const Eigen::MatrixX2d seen = directionsAt(context.twin, pose.T_map_radar, pose.stamp_ns);
    for (int a = 0; a < static_cast<int>(seen.rows()); ++a) {
      direction.row(static_cast<Eigen::Index>(errorOf(a, static_cast<std::size_t>(errors_)))) = seen.row(a);
    }
    takeSlopes(context, state, p, state.latents.actor_range_m);
  }
  for (int i = 0; i < kSlopes; ++i) {
    const PosteriorShifts shifts = posterior(poses);
    for (int p : poses) {
      std::vector<double> range_m = rangesAt(p, shifts);
      for (double& r : range_m) r += shifts.shared_m;
      takeSlopes(context, state, p, range_m);
    }
  }
}

void ActorShifts::takeSlopes(DiagnosisContext& context, const ModelState& state, int pose,
                             const std::vector<double>& range_m) {
  SessionLatents latents = state.latents;
  latents.actor_range_m = range_m;
  const PoseEchoes echoes = context.echoes.echoes(state.mechanisms, {pose}, range_m).front();
  const Basis basis = context.likelihood.basisAt(pose, echoes, latents);
  const Scores scores = context.likelihood.freeScores(basis, {}, {pose});
  const Scores prior = context.likelihood.freeScores(basis, {}, {});
  Eigen::VectorXd at = Eigen::VectorXd::Zero(globals_);
  for (int e = 0; e < errors_; ++e) at[globals_ - errors_ + e] = range_m[static_cast<std::size_t>(e)];
  PoseTerms& terms = terms_[static_cast<std::size_t>(pose)];
  terms.information = scores.information - prior.information;
  terms.weighted = scores.total - prior.total + terms.information * at;
}

PosteriorShifts ActorShifts::posterior(const std::vector<int>& poses) const {
  // Unknowns: all globals but the ranges, two components of each actor's displacement, the range that all share.
  const int others = globals_ - errors_, all = others + 2 * errors_ + 1;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(all, all);
  Eigen::VectorXd weighted = Eigen::VectorXd::Zero(all);
  information.topLeftCorner(others, others) = prior_information_.topLeftCorner(others, others);
  weighted.head(others) = prior_score_.head(others);
  for (int k = others; k < all - 1; ++k) information(k, k) = 1 / (scene_m_ * scene_m_);
  for (int p : poses) {
    const PoseTerms& terms = terms_[static_cast<std::size_t>(p)];
    Eigen::MatrixXd globals_by = Eigen::MatrixXd::Zero(globals_, all);
    globals_by.topLeftCorner(others, others).setIdentity();
    for (int e = 0; e < errors_; ++e) {
      globals_by.block(others + e, others + 2 * e, 1, 2) = terms.direction.row(e);
      globals_by(others + e, all - 1) = 1;
    }
    information += globals_by.transpose() * terms.information * globals_by;
    weighted += globals_by.transpose() * terms.weighted;
  }
  const Eigen::MatrixXd covariance =
      likelihood::regularised(information).ldlt().solve(Eigen::MatrixXd::Identity(all, all));
  const Eigen::VectorXd mean = covariance * weighted;
  PosteriorShifts shifts;
  shifts.actors.resize(static_cast<std::size_t>(errors_));
  shifts.shared_m = mean[all - 1];
  for (int e = 0; e < errors_; ++e) {
    ActorShift& shift = shifts.actors[static_cast<std::size_t>(e)];
    shift.mean_m = mean.segment<2>(others + 2 * e);
    shift.covariance_m2 = covariance.block<2, 2>(others + 2 * e, others + 2 * e);
  }
  return shifts;
}

std::vector<double> ActorShifts::rangesAt(int pose, const PosteriorShifts& shifts) const {
  const Eigen::MatrixX2d& direction = terms_[static_cast<std::size_t>(pose)].direction;
  std::vector<double> ranges(shifts.actors.size());
  for (std::size_t e = 0; e < ranges.size(); ++e) {
    ranges[e] = direction.row(static_cast<Eigen::Index>(e)).dot(shifts.actors[e].mean_m);
  }
  return ranges;
}

}  // namespace mmradartwin::diagnosis
