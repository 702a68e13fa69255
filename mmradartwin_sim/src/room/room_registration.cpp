#include "mmradartwin_sim/room_registration.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <utility>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/ray_caster.h"

namespace mmradartwin {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr double kCell_rad = 1.5 * M_PI / 180;  // of the camera's view: points within are averaged
constexpr std::size_t kFewestOfCell = 3;
constexpr std::size_t kCoarsePoints = 300;
constexpr double kFineSpacing_m = 0.05, kCoarseSpacing_m = 0.12;
constexpr std::size_t kFewestPairs = 100;
constexpr double kHuber = 1.5, kTrim = 4;  // standard deviations
constexpr double kSameNormal = 0.8;        // cosine
constexpr double kAlike = 4;               // cells whose noise is that of one: stereo matching works on windows
constexpr double kPatch_m = 0.5;           // errors of a scene are alike over so much of a surface
constexpr double kSameFit_m = 0.04, kSameFit_rad = 0.03;
// Starts around a guess, in shares of the reach of a search.
constexpr double kTurns[] = {0.0, -0.6, 0.6};
constexpr std::pair<double, double> kShifts[] = {{0.0, 0.0}, {0.6, 0.0}, {-0.6, 0.0}, {0.0, 0.6}, {0.0, -0.6}};
constexpr int kStarts = static_cast<int>(std::size(kTurns) * std::size(kShifts));
constexpr double kRivalMargin = 0.06;  // of agreement; a fit must be better than any rival by this
constexpr std::uint32_t kSeed = 1;     // of the sampled points: the same scene gives the same points

struct Surface {
  Eigen::Vector3d point, normal;
};

double angleOf(const Eigen::Matrix3d& rotation) { return Eigen::AngleAxisd(rotation).angle(); }

bool sameFit(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, double factor = 1) {
  return (a.translation() - b.translation()).norm() < factor * kSameFit_m &&
         angleOf(a.linear().transpose() * b.linear()) < factor * kSameFit_rad;
}

/// Every n-th element so that at most `most` are left.
template <typename T>
std::vector<T> thinned(const std::vector<T>& all, std::size_t most) {
  if (all.size() <= most) return all;
  std::vector<T> result;
  for (std::size_t i = 0; i < most; ++i) result.push_back(all[i * all.size() / most]);
  return result;
}

/// Points spread evenly over all surfaces, one per spacing^2.
std::vector<Surface> sampleSurfaces(const Scene& scene, double spacing_m) {
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Surface> samples;
  double owed = 0.5;
  for (const Actor& actor : scene.actors) {
    if (!actor.present) continue;
    for (const auto& t : actor.triangles) {
      const Eigen::Vector3d a = actor.vertices[t[0]], b = actor.vertices[t[1]] - a, c = actor.vertices[t[2]] - a;
      const Eigen::Vector3d cross = b.cross(c);
      if (!(cross.norm() > 1e-12)) continue;
      for (owed += 0.5 * cross.norm() / (spacing_m * spacing_m); owed >= 1; owed -= 1) {
        double u = unit(random), v = unit(random);
        if (u + v > 1) u = 1 - u, v = 1 - v;
        samples.push_back({a + u * b + v * c, cross.normalized()});
      }
    }
  }
  return samples;
}

std::string format(const char* text, double a, double b = 0, double c = 0, double d = 0) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), text, a, b, c, d);
  return line.data();
}

std::string poseText(const Eigen::Isometry3d& T) {
  const Eigen::Vector3d forward = T.linear().col(0);
  return format("x %.2f, y %.2f, z %.2f, heading %.1f deg", T.translation().x(), T.translation().y(),
                T.translation().z(), std::atan2(forward.y(), forward.x()) * 180 / M_PI);
}

}  // namespace

struct RoomRegistration::Impl {
  /// The measured points, one per cell of the view, in the camera's frame.
  struct Measured {
    std::vector<Eigen::Vector3d> all;
    std::vector<Surface> fine, coarse;                ///< those with a normal, which edges have not
    Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit, towards the middle of the points
    double cos_cone = 1, farthest_m = 0;
  };
  /// Sampled surfaces that are visible from a pose, about that place, where single precision is finest.
  struct Visible {
    Eigen::Vector3d origin;
    std::vector<Surface> surfaces;
    pcl::KdTreeFLANN<pcl::PointXYZ> tree;
  };
  /// One Gauss-Newton system: x, y, z and turns about map's axes through the camera.
  struct System {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    std::map<std::array<int, 3>, Vector6d> patches;  ///< g, by cube of kPatch_m
    double weights = 0, arm2 = 0;
    std::size_t pairs = 0;
  };
  struct Verdict {
    double agreement = 0, behind = 0, before = 0, coverage = 0, rms_m = 0;
  };

  Impl(const Scene& scene_, const RegistrationOptions& options_) : options(options_), scene(scene_), rays(scene_) {
    fine = sampleSurfaces(scene, kFineSpacing_m);
    coarse = sampleSurfaces(scene, kCoarseSpacing_m);
    if (coarse.empty()) throw InputError(scene.file + ": has no surface that a cloud could be registered to");
  }

  Measured prepare(const std::vector<Eigen::Vector3d>& cloud) const;
  std::optional<Visible> visible(const std::vector<Surface>& model, const Measured& measured,
                                 const Eigen::Isometry3d& T) const;
  System pairUp(const std::vector<Surface>& points, const Visible& target, double reach_m,
                const Eigen::Isometry3d& T) const;
  bool icp(const std::vector<Surface>& points, const std::vector<Surface>& model, const Measured& measured,
           double reach_m, Eigen::Isometry3d& T) const;
  bool coarseFit(const Measured& measured, Eigen::Isometry3d& T) const;
  /// Coarse fits from several starts around a guess, best first, each once.
  std::vector<Eigen::Isometry3d> fitAround(const Measured& measured, const Eigen::Isometry3d& start, double reach_m,
                                           double reach_rad) const;
  bool fineFit(const Measured& measured, Eigen::Isometry3d& T) const;
  bool estimateErrors(const Measured& measured, const Eigen::Isometry3d& T, Registration& result) const;
  Verdict judge(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T, double slack_m = 0) const;
  Registration finish(const Measured& measured, Eigen::Isometry3d T,
                      const std::optional<Eigen::Vector3d>& up_camera) const;

  /// Standard deviation of the distance between a point and a surface that its ray meets at this cosine.
  double sigma(double range_m, double cosine) const {
    return std::hypot(options.scene_error_m / 2, options.depth_noise_per_m * range_m * range_m * cosine);
  }

  RegistrationOptions options;
  const Scene& scene;
  RayCaster rays;
  std::vector<Surface> fine, coarse;
};

/// Averages over cells of the view, not of space: noise along the ray would smear a far surface over many cells of
/// space that then count alike, and a limit of depth would keep the near half of it alone.
RoomRegistration::Impl::Measured RoomRegistration::Impl::prepare(const std::vector<Eigen::Vector3d>& cloud) const {
  std::map<std::array<int, 2>, std::vector<std::pair<double, Eigen::Vector3d>>> cells;
  for (const Eigen::Vector3d& p : cloud) {
    const double r = p.norm();
    if (!(r > 0.5 * options.min_depth_m && r < 1.5 * options.max_depth_m)) continue;  // and NaN
    cells[{static_cast<int>(std::floor(std::atan2(p.y(), p.x()) / kCell_rad)),
           static_cast<int>(std::floor(std::asin(p.z() / r) / kCell_rad))}]
        .emplace_back(r, p);
  }
  Measured measured;
  std::map<std::array<int, 2>, Eigen::Vector3d> means;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (auto& [cell, points] : cells) {
    const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
    std::nth_element(points.begin(), middle, points.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    const double median_m = middle->first;
    const double spread_m = 3 * options.depth_noise_per_m * median_m * median_m + 0.01;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    std::size_t count = 0;
    for (const auto& [r, p] : points) {
      if (std::abs(r - median_m) <= spread_m) mean += p, ++count;  // at an edge: of the one side only
    }
    mean /= static_cast<double>(count);
    const double r = mean.norm();
    if (count < kFewestOfCell || r < options.min_depth_m || r > options.max_depth_m) continue;
    measured.all.push_back(mean);
    means.emplace(cell, mean);
    measured.farthest_m = std::max(measured.farthest_m, r);
    sum += mean / r;
  }
  if (sum.norm() > 1e-9) measured.axis = sum.normalized();
  for (const Eigen::Vector3d& p : measured.all) {
    measured.cos_cone = std::min(measured.cos_cone, measured.axis.dot(p.normalized()));
  }
  for (const auto& [cell, p] : means) {
    std::vector<Eigen::Vector3d> around;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const auto other = means.find({cell[0] + i, cell[1] + j});
        if (other == means.end() || (other->second - p).norm() > 0.3 * p.norm()) continue;
        around.push_back(other->second);
        middle += other->second;
      }
    }
    if (around.size() < 8) continue;
    middle /= static_cast<double>(around.size());
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (const Eigen::Vector3d& q : around) scatter += (q - middle) * (q - middle).transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(scatter);
    measured.fine.push_back({p, spectrum.eigenvectors().col(0)});
  }
  measured.coarse = thinned(measured.fine, kCoarsePoints);
  return measured;
}

std::optional<RoomRegistration::Impl::Visible> RoomRegistration::Impl::visible(const std::vector<Surface>& model,
                                                                               const Measured& measured,
                                                                               const Eigen::Isometry3d& T) const {
  Visible result;
  result.origin = T.translation();
  const Eigen::Vector3d axis = T.linear() * measured.axis;
  // A wider cone and reach than the camera's: the estimate may be off.
  const double cos_cone = std::cos(std::min(M_PI, std::acos(std::clamp(measured.cos_cone, -1.0, 1.0)) + 0.35));
  const double reach_m = measured.farthest_m + 0.7;
  std::vector<Eigen::Vector3d> places;
  std::vector<const Surface*> candidates;
  for (const Surface& s : model) {
    const Eigen::Vector3d ray = s.point - result.origin;
    const double r = ray.norm();
    if (r > reach_m || ray.dot(axis) < cos_cone * r) continue;
    places.push_back(s.point);
    candidates.push_back(&s);
  }
  const std::vector<char> seen = rays.visible(result.origin, places, std::vector<double>(places.size(), 0.02));
  pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!seen[i]) continue;
    const Eigen::Vector3d ray = places[i] - result.origin;
    result.surfaces.push_back({ray, candidates[i]->normal});
    cloud->push_back(
        pcl::PointXYZ(static_cast<float>(ray.x()), static_cast<float>(ray.y()), static_cast<float>(ray.z())));
  }
  if (result.surfaces.size() < kFewestPairs) return std::nullopt;
  result.tree.setInputCloud(cloud);
  return result;
}

/// Pairs every point with the nearest visible sample within reach_m; weights by Huber's rule, with nothing beyond
/// kTrim.
RoomRegistration::Impl::System RoomRegistration::Impl::pairUp(const std::vector<Surface>& points, const Visible& target,
                                                              double reach_m, const Eigen::Isometry3d& T) const {
  System system;
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  for (const Surface& point : points) {
    const Eigen::Vector3d arm = T.linear() * point.point, p = arm + T.translation() - target.origin;
    const pcl::PointXYZ query(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z()));
    if (target.tree.nearestKSearch(query, 1, nearest, squared) < 1) continue;
    const Surface& s = target.surfaces[static_cast<std::size_t>(nearest[0])];
    // Near an edge the nearest sample may be of the other face: that would pull all edges one way.
    if (std::abs(s.normal.dot(T.linear() * point.normal)) < kSameNormal) continue;
    const double r = arm.norm(), distance = s.normal.dot(p - s.point);
    const double sd = std::max(reach_m / kTrim, sigma(r, std::abs(s.normal.dot(arm)) / r));
    // Beside a surface's end the distance to its plane says nothing.
    const double beside2 = squared[0] - distance * distance;
    const double z = std::abs(distance) / sd;
    if (z > kTrim || beside2 > std::max(reach_m * reach_m, 0.01)) continue;
    const double weight = std::min(1.0, kHuber / std::max(z, 1e-9)) / (sd * sd);
    Vector6d J;
    J << s.normal, arm.cross(s.normal);
    system.H += weight * J * J.transpose();
    system.g += weight * distance * J;
    system.weights += weight;
    system.arm2 += weight * arm.squaredNorm();
    ++system.pairs;
    const Eigen::Vector3d place = p + target.origin;
    system.patches
        .try_emplace(
            {static_cast<int>(std::floor(place.x() / kPatch_m)), static_cast<int>(std::floor(place.y() / kPatch_m)),
             static_cast<int>(std::floor(place.z() / kPatch_m))},
            Vector6d::Zero())
        .first->second += weight * distance * J;
  }
  return system;
}

bool RoomRegistration::Impl::icp(const std::vector<Surface>& points, const std::vector<Surface>& model,
                                 const Measured& measured, double reach_m, Eigen::Isometry3d& T) const {
  const std::optional<Visible> target = visible(model, measured, T);
  if (!target) return false;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const System system = pairUp(points, *target, reach_m, T);
    if (system.pairs < kFewestPairs) return false;
    // Damped a little: a flat wall alone leaves three directions open, which must not run away.
    Matrix6d damping = Matrix6d::Identity();
    damping.bottomRightCorner<3, 3>() *= system.arm2 / system.weights;
    const Vector6d step = -(system.H + 1e-4 * system.weights * damping).ldlt().solve(system.g);
    if (!step.allFinite() || step.head<3>().norm() > 1 || step.tail<3>().norm() > 1) return false;
    const double turn = step.tail<3>().norm();
    T.translation() += step.head<3>();
    if (turn > 1e-12) {
      T.linear() = (Eigen::AngleAxisd(turn, step.tail<3>() / turn) * Eigen::Quaterniond(T.linear()))
                       .normalized()
                       .toRotationMatrix();
    }
    const double small = reach_m > 0 ? 1e-3 : 1e-4;
    if (step.head<3>().norm() < small && turn < small) break;
  }
  return true;
}

bool RoomRegistration::Impl::coarseFit(const Measured& measured, Eigen::Isometry3d& T) const {
  for (const double reach_m : {0.8, 0.35}) {
    if (!icp(measured.coarse, coarse, measured, reach_m, T)) return false;
  }
  return true;
}

bool RoomRegistration::Impl::fineFit(const Measured& measured, Eigen::Isometry3d& T) const {
  for (const double reach_m : {0.25, 0.12, 0.0}) {
    if (!icp(measured.fine, fine, measured, reach_m, T)) return false;
  }
  return true;
}

/// Covariance and information of a fit. False where they do not exist.
bool RoomRegistration::Impl::estimateErrors(const Measured& measured, const Eigen::Isometry3d& T,
                                            Registration& result) const {
  const std::optional<Visible> target = visible(fine, measured, T);
  if (!target) return false;
  const System system = pairUp(measured.fine, *target, 0, T);
  if (system.pairs < kFewestPairs) return false;
  const double arm_m = std::sqrt(system.arm2 / system.weights);
  Vector6d unit;
  unit << 1, 1, 1, 1 / arm_m, 1 / arm_m, 1 / arm_m;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> spectrum(unit.asDiagonal() * system.H * unit.asDiagonal() /
                                                         system.weights);
  result.information = spectrum.eigenvalues()(0);
  result.weakest = unit.asDiagonal() * spectrum.eigenvectors().col(0);
  if (!(result.information > 1e-9)) return true;
  const Matrix6d inverse = system.H.ldlt().solve(Matrix6d::Identity());
  Matrix6d middle = kAlike * system.H;                                                   // what the model expects, and
  for (const auto& [cell, score] : system.patches) middle += score * score.transpose();  // what is there
  result.covariance = inverse * middle * inverse;
  return true;
}

/// Casts the camera's rays. Distances are taken across the surface that a ray meets: a floor seen at a glance would
/// make every millimetre of the pose a centimetre of range.
RoomRegistration::Impl::Verdict RoomRegistration::Impl::judge(const std::vector<Eigen::Vector3d>& points,
                                                              const Eigen::Isometry3d& T, double slack_m) const {
  int agree = 0, behind = 0, before = 0, missed = 0;
  double sum2 = 0;
  for (const Eigen::Vector3d& p : points) {
    const double r = p.norm();
    const Eigen::Vector3d direction = T.linear() * (p / r);
    const auto hit = rays.firstHit(T.translation(), direction, std::numeric_limits<double>::infinity());
    if (!hit) {
      ++missed;
      continue;
    }
    const double excess = r - hit->distance_m;  // > 0: measured behind the surface
    const double cosine = hit->facet >= 0 ? std::abs(scene.facets[hit->facet].normal.dot(direction)) : 1;
    const double limit = slack_m + options.scene_error_m + 2.5 * sigma(r, std::max(cosine, 0.3));
    if (std::abs(excess) * cosine <= limit && std::abs(excess) < 8 * limit) {
      ++agree;
      sum2 += excess * excess * cosine * cosine;
    } else if (excess > 0) {
      ++behind;
    } else {
      ++before;
    }
  }
  Verdict verdict;
  const double met = std::max(1, agree + behind + before);
  verdict.agreement = agree / met;
  verdict.behind = behind / met;
  verdict.before = before / met;
  verdict.coverage = points.empty() ? 0 : 1 - static_cast<double>(missed) / static_cast<double>(points.size());
  verdict.rms_m = agree ? std::sqrt(sum2 / agree) : 0;
  return verdict;
}

Registration RoomRegistration::Impl::finish(const Measured& measured, Eigen::Isometry3d T,
                                            const std::optional<Eigen::Vector3d>& up_camera) const {
  Registration result;
  result.points = static_cast<int>(measured.all.size());
  const bool fitted = fineFit(measured, T) && estimateErrors(measured, T, result);
  result.T_map_camera = T;
  const Verdict verdict = judge(measured.all, T);
  result.agreement = verdict.agreement;
  result.behind = verdict.behind;
  result.before = verdict.before;
  result.coverage = verdict.coverage;
  result.rms_m = verdict.rms_m;
  const Vector6d deviation = result.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const double tilt = up_camera ? std::acos(std::clamp((T.linear() * *up_camera).z(), -1.0, 1.0)) : 0;
  if (!fitted) {
    result.reason = "the cloud meets no surface of the scene near the guess; give a 2D Pose Estimate";
  } else if (verdict.coverage < options.min_coverage) {
    result.reason = format("the scene has nothing behind %.0f %% of the cloud; is it the right scene, and whole?",
                           100 * (1 - verdict.coverage));
  } else if (verdict.agreement < options.min_agreement || verdict.behind > options.max_behind) {
    result.reason = format(
        "only %.0f %% of the cloud stands where the scene has a surface, %.0f %% behind one; give a "
        "2D Pose Estimate, or see whether the scene is that of this room",
        100 * verdict.agreement, 100 * verdict.behind);
  } else if (result.information < options.min_information) {
    const bool turn = result.weakest.tail<3>().norm() > result.weakest.head<3>().norm();
    const Eigen::Vector3d d = turn ? result.weakest.tail<3>().normalized() : result.weakest.head<3>().normalized();
    result.reason = std::string("what the camera sees does not fix the pose ") + (turn ? "about" : "along") +
                    format(" (%.1f %.1f %.1f) of map; turn it towards a corner or furniture", d.x(), d.y(), d.z());
  } else if (deviation.head<3>().maxCoeff() > options.max_std_m ||
             deviation.tail<3>().maxCoeff() > options.max_std_rad) {
    result.reason = format("the fit is uncertain by %.1f cm and %.2f deg; go nearer, or turn towards a corner",
                           100 * deviation.head<3>().maxCoeff(), deviation.tail<3>().maxCoeff() * 180 / M_PI);
  } else if (tilt > options.max_tilt_rad) {
    result.reason = format("the fit stands %.1f deg off the vertical that the IMU measures", tilt * 180 / M_PI);
  }
  result.trusted = result.reason.empty();
  return result;
}

std::vector<Eigen::Isometry3d> RoomRegistration::Impl::fitAround(const Measured& measured,
                                                                 const Eigen::Isometry3d& start, double reach_m,
                                                                 double reach_rad) const {
  std::vector<std::pair<double, Eigen::Isometry3d>> ends;
  for (const double turn : kTurns) {
    for (const auto& [dx, dy] : kShifts) {
      Eigen::Isometry3d T = start;
      T.translation() += reach_m * Eigen::Vector3d(dx, dy, 0);
      T.linear() = Eigen::AngleAxisd(reach_rad * turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T.linear();
      if (!coarseFit(measured, T)) continue;
      const Verdict verdict = judge(thinned(measured.all, kCoarsePoints), T, 0.05);
      ends.emplace_back(verdict.agreement * std::min(1.0, verdict.coverage / options.min_coverage), T);
    }
  }
  std::stable_sort(ends.begin(), ends.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Eigen::Isometry3d> distinct;
  for (const auto& [score, T] : ends) {
    const bool known =
        std::any_of(distinct.begin(), distinct.end(), [&t = T](const auto& d) { return sameFit(d, t, 2); });
    if (!known && distinct.size() < 4) distinct.push_back(T);
  }
  return distinct;
}

RoomRegistration::RoomRegistration(const Scene& scene, const RegistrationOptions& options)
    : impl_(std::make_unique<Impl>(scene, options)) {}
RoomRegistration::~RoomRegistration() = default;
RoomRegistration::RoomRegistration(RoomRegistration&&) noexcept = default;

Registration RoomRegistration::locate(const std::vector<Eigen::Vector3d>& cloud_camera, const Eigen::Isometry3d& guess,
                                      GuessKind kind, const std::optional<Eigen::Vector3d>& up_camera) const {
  const RegistrationOptions& options = impl_->options;
  const Impl::Measured measured = impl_->prepare(cloud_camera);
  Registration result;
  result.T_map_camera = guess;
  result.points = static_cast<int>(measured.all.size());
  if (result.points < options.min_points) {
    result.reason = format("the cloud covers only %.0f cells (of 1.5 deg) of the view between %.1f and %.1f m",
                           result.points, options.min_depth_m, options.max_depth_m);
    return result;
  }
  Eigen::Isometry3d start = guess;
  if (up_camera) {
    start.linear() =
        Eigen::Quaterniond::FromTwoVectors(start.linear() * *up_camera, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
        start.linear();
  }
  const auto near = [&](const Eigen::Isometry3d& T) {
    const bool tracking = kind == GuessKind::kTracking;
    const double step_m = tracking ? options.max_step_m : 1.5 * options.search_m;
    const double step_rad = tracking ? options.max_step_rad : 1.5 * options.search_rad;
    return (T.translation() - start.translation()).norm() <= step_m &&
           angleOf(T.linear().transpose() * start.linear()) <= step_rad;
  };
  const auto refuseFar = [&](Registration& r) {
    if (!r.trusted || near(r.T_map_camera)) return;
    r.trusted = false;
    r.reason = "the cloud fits at " + poseText(r.T_map_camera) + ", too far from the guess at " + poseText(start) +
               "; give a 2D Pose Estimate there if that is right";
  };

  if (kind == GuessKind::kTracking) {
    result = impl_->finish(measured, start, up_camera);
    result.starts = 1;
    refuseFar(result);
    // Another start helps where the cloud does not fit, not where what is seen leaves the pose open.
    if (result.agreement >= options.min_agreement && result.behind <= options.max_behind) return result;
  }
  const double reach_m = kind == GuessKind::kTracking ? options.max_step_m : options.search_m;
  const double reach_rad = kind == GuessKind::kTracking ? options.max_step_rad : options.search_rad;
  std::vector<Registration> fits;
  for (const Eigen::Isometry3d& T : impl_->fitAround(measured, start, reach_m, reach_rad))
    fits.push_back(impl_->finish(measured, T, up_camera));
  std::stable_sort(fits.begin(), fits.end(), [](const Registration& a, const Registration& b) {
    return std::pair(a.trusted, a.agreement) > std::pair(b.trusted, b.agreement);
  });
  result = fits.empty() ? result : fits.front();
  result.starts = kStarts;
  if (fits.empty()) result.reason = "the cloud meets no surface of the scene near the guess; give a 2D Pose Estimate";
  for (const Registration& rival : fits) {
    if (!result.trusted || sameFit(rival.T_map_camera, result.T_map_camera)) continue;
    if (rival.behind > 2 * options.max_behind || rival.coverage < options.min_coverage) continue;
    if (rival.agreement < result.agreement - kRivalMargin) continue;
    result.trusted = false;
    result.reason = "ambiguous: the cloud fits as well at " + poseText(rival.T_map_camera) + " as at " +
                    poseText(result.T_map_camera) + "; turn the camera to where the room differs";
  }
  refuseFar(result);
  return result;
}

}  // namespace mmradartwin
