#include "mmradartwin_sim/room_registration.h"

#include <pcl/features/normal_3d.h>
#include <pcl/filters/voxel_grid.h>
#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_rejection_surface_normal.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <random>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr float kVoxel_m = 0.05F;
constexpr std::size_t kFinePoints = 2500, kCoarsePoints = 600, kRivalRays = 60;
constexpr double kFineSpacing_m = 0.05, kCoarseSpacing_m = 0.12;
constexpr double kPatch_m = 0.5;             // errors of a scene are alike over so much of a surface
constexpr double kSameFit_m = 0.04, kSameFit_rad = 0.03;
constexpr double kRivalGrid_m = 0.5, kRivalGrid_rad = M_PI / 12;
constexpr std::size_t kMostRivals = 12;
constexpr double kRivalMargin = 0.06;        // of agreement; a fit must be better than any rival by this
constexpr std::uint32_t kSeed = 1;           // of the sampled points: the same scene gives the same points

struct Surface {
  Eigen::Vector3d point, normal;
};

/// Point-to-plane step for PCL's ICP. Its own solves an undamped system, which a flat wall makes singular: the step is
/// NaN then, and the search tree aborts the program.
class DampedPointToPlane : public pcl::registration::TransformationEstimation<pcl::PointNormal, pcl::PointNormal> {
 public:
  void estimateRigidTransformation(const Cloud& source, const Cloud& target, Matrix4& step) const override {
    Sum sum;
    for (std::size_t i = 0; i < std::min(source.size(), target.size()); ++i) sum.add(source[i], target[i]);
    step = sum.step();
  }
  void estimateRigidTransformation(const Cloud& source, const pcl::Indices& of, const Cloud& target,
                                   Matrix4& step) const override {
    Sum sum;
    for (std::size_t i = 0; i < std::min(of.size(), target.size()); ++i) sum.add(source[of[i]], target[i]);
    step = sum.step();
  }
  void estimateRigidTransformation(const Cloud& source, const pcl::Indices& of, const Cloud& target,
                                   const pcl::Indices& to, Matrix4& step) const override {
    Sum sum;
    for (std::size_t i = 0; i < std::min(of.size(), to.size()); ++i) sum.add(source[of[i]], target[to[i]]);
    step = sum.step();
  }
  void estimateRigidTransformation(const Cloud& source, const Cloud& target, const pcl::Correspondences& pairs,
                                   Matrix4& step) const override {
    Sum sum;
    for (const pcl::Correspondence& pair : pairs) sum.add(source[pair.index_query], target[pair.index_match]);
    step = sum.step();
  }

 private:
  struct Sum {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    double count = 0;
    void add(const pcl::PointNormal& a, const pcl::PointNormal& b) {
      const Eigen::Vector3d p = a.getVector3fMap().cast<double>(), n = b.getNormalVector3fMap().cast<double>();
      Vector6d J;
      J << n, p.cross(n);
      H += J * J.transpose();
      g += n.dot(p - b.getVector3fMap().cast<double>()) * J;
      count += 1;
    }
    Matrix4 step() const {
      Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
      if (count >= 6) {
        const Vector6d x = -(H + 1e-4 * count * Matrix6d::Identity()).ldlt().solve(g);
        const double turn = x.tail<3>().norm();
        if (turn > 1e-12) T.linear() = Eigen::AngleAxisd(turn, x.tail<3>() / turn).toRotationMatrix();
        T.translation() = x.head<3>();
      }
      return T.matrix().cast<float>();
    }
  };
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

std::string format(const char* text, double a, double b = 0, double c = 0) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), text, a, b, c);
  return line.data();
}

std::string poseText(const Eigen::Isometry3d& T) {
  const Eigen::Vector3d forward = T.linear().col(0);
  return format("x %.2f, y %.2f, heading %.0f deg", T.translation().x(), T.translation().y(),
                std::atan2(forward.y(), forward.x()) * 180 / M_PI);
}

}  // namespace

struct RoomRegistration::Impl {
  /// The measured points, thinned, in the camera's frame.
  struct Measured {
    std::vector<Surface> fine, coarse;
    std::vector<Eigen::Vector3d> rays;  ///< spread over the image, for verdicts
    Eigen::Vector3d axis;               ///< unit, towards the middle of the points
    double cos_cone = 1, farthest_m = 0;
    std::size_t voxels = 0;
  };
  struct Verdict {
    double agreement = 0, behind = 0, before = 0, coverage = 0, rms_m = 0;
  };

  Impl(const Scene& scene_, const RegistrationOptions& options_) : options(options_), scene(scene_), rays(scene_) {
    fine = sampleSurfaces(scene, kFineSpacing_m);
    coarse = sampleSurfaces(scene, kCoarseSpacing_m);
    if (coarse.empty()) throw InputError(scene.file + ": has no surface that a cloud could be registered to");
    for (const Surface& s : coarse) bounds.extend(s.point);
  }

  Measured prepare(const std::vector<Eigen::Vector3d>& cloud) const;
  Cloud::Ptr visibleModel(const std::vector<Surface>& model, const Measured& measured,
                          const Eigen::Isometry3d& T) const;
  bool icp(const std::vector<Surface>& points, const std::vector<Surface>& model, const Measured& measured,
           double reach_m, int iterations, Eigen::Isometry3d& T) const;
  bool coarseFit(const Measured& measured, Eigen::Isometry3d& T) const;
  bool fineFit(const Measured& measured, Eigen::Isometry3d& T) const;
  bool polish(const Measured& measured, Eigen::Isometry3d& T, Registration& result) const;
  Verdict judge(const std::vector<Eigen::Vector3d>& points, const Eigen::Isometry3d& T, double slack_m = 0) const;
  Registration finish(const Measured& measured, Eigen::Isometry3d T,
                      const std::optional<Eigen::Vector3d>& up_camera) const;
  std::vector<Eigen::Isometry3d> rivals(const Measured& measured, const Eigen::Isometry3d& T) const;
  void refuseRivals(const Measured& measured, bool everywhere, const std::optional<Eigen::Vector3d>& up_camera,
                    const std::vector<Eigen::Isometry3d>& others, Registration& result) const;

  double sigma(double distance_m) const {
    return std::hypot(options.scene_error_m / 2, options.depth_noise_per_m * distance_m * distance_m);
  }

  RegistrationOptions options;
  const Scene& scene;
  RayCaster rays;
  std::vector<Surface> fine, coarse;
  Eigen::AlignedBox3d bounds;
};

RoomRegistration::Impl::Measured RoomRegistration::Impl::prepare(const std::vector<Eigen::Vector3d>& cloud) const {
  pcl::PointCloud<pcl::PointXYZ>::Ptr raw(new pcl::PointCloud<pcl::PointXYZ>);
  for (const Eigen::Vector3d& p : cloud) {
    const double r = p.norm();
    if (!(r >= options.min_depth_m && r <= options.max_depth_m)) continue;  // and NaN
    raw->push_back(pcl::PointXYZ(static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())));
  }
  Measured measured;
  pcl::PointCloud<pcl::PointXYZ>::Ptr thin(new pcl::PointCloud<pcl::PointXYZ>);
  if (raw->empty()) return measured;
  pcl::VoxelGrid<pcl::PointXYZ> grid;
  grid.setLeafSize(kVoxel_m, kVoxel_m, kVoxel_m);
  grid.setInputCloud(raw);
  grid.filter(*thin);
  measured.voxels = thin->size();
  if (static_cast<int>(measured.voxels) < options.min_points) return measured;

  pcl::PointCloud<pcl::Normal> normals;
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;  // turns normals towards the origin, the camera
  estimation.setInputCloud(thin);
  estimation.setSearchMethod(pcl::search::KdTree<pcl::PointXYZ>::Ptr(new pcl::search::KdTree<pcl::PointXYZ>));
  estimation.setKSearch(16);
  estimation.compute(normals);
  std::vector<Surface> all;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < thin->size(); ++i) {
    const Surface s{thin->at(i).getVector3fMap().cast<double>(), normals.at(i).getNormalVector3fMap().cast<double>()};
    if (!s.normal.allFinite()) continue;
    all.push_back(s);
    sum += s.point.normalized();
    measured.farthest_m = std::max(measured.farthest_m, s.point.norm());
  }
  measured.axis = sum.norm() > 1e-9 ? Eigen::Vector3d(sum.normalized()) : Eigen::Vector3d::UnitX();
  for (const Surface& s : all) measured.cos_cone = std::min(measured.cos_cone, measured.axis.dot(s.point.normalized()));
  std::shuffle(all.begin(), all.end(), std::mt19937(kSeed));
  measured.fine = thinned(all, kFinePoints);
  measured.coarse = thinned(all, kCoarsePoints);
  for (const Surface& s : measured.fine) measured.rays.push_back(s.point);
  return measured;
}

Cloud::Ptr RoomRegistration::Impl::visibleModel(const std::vector<Surface>& model, const Measured& measured,
                                                const Eigen::Isometry3d& T) const {
  const Eigen::Vector3d from = T.translation(), axis = T.linear() * measured.axis;
  // A wider cone and reach than the camera's: the estimate may be off.
  const double cos_cone = std::cos(std::min(M_PI, std::acos(std::clamp(measured.cos_cone, -1.0, 1.0)) + 0.35));
  const double reach_m = measured.farthest_m + 0.7;
  Cloud::Ptr visible(new Cloud);
  for (const Surface& s : model) {
    const Eigen::Vector3d ray = s.point - from;
    const double r = ray.norm();
    if (r > reach_m || ray.dot(axis) < cos_cone * r || !rays.visible(from, s.point, 0.02)) continue;
    const Eigen::Vector3f n = (s.normal.dot(ray) > 0 ? Eigen::Vector3d(-s.normal) : s.normal).cast<float>();
    pcl::PointNormal p;
    p.getVector3fMap() = ray.cast<float>();  // about the camera, where single precision is finest
    p.getNormalVector3fMap() = n;
    visible->push_back(p);
  }
  return visible;
}

bool RoomRegistration::Impl::icp(const std::vector<Surface>& points, const std::vector<Surface>& model,
                                 const Measured& measured, double reach_m, int iterations,
                                 Eigen::Isometry3d& T) const {
  const Cloud::Ptr target = visibleModel(model, measured, T);
  if (target->size() < 50) return false;
  Cloud::Ptr source(new Cloud);
  for (const Surface& s : points) {
    pcl::PointNormal p;
    p.getVector3fMap() = (T.linear() * s.point).cast<float>();
    p.getNormalVector3fMap() = (T.linear() * s.normal).cast<float>();
    source->push_back(p);
  }
  pcl::IterativeClosestPointWithNormals<pcl::PointNormal, pcl::PointNormal> icp;
  pcl::registration::CorrespondenceRejectorSurfaceNormal::Ptr facing(
      new pcl::registration::CorrespondenceRejectorSurfaceNormal);
  facing->setThreshold(std::cos(50 * M_PI / 180));
  icp.addCorrespondenceRejector(facing);
  icp.setTransformationEstimation(DampedPointToPlane::Ptr(new DampedPointToPlane));
  icp.setMaxCorrespondenceDistance(reach_m);
  icp.setMaximumIterations(iterations);
  icp.setTransformationEpsilon(1e-9);
  icp.setInputSource(source);
  icp.setInputTarget(target);
  Cloud moved;
  icp.align(moved);
  const Eigen::Matrix4d step = icp.getFinalTransformation().cast<double>();
  if (!icp.hasConverged() || !step.allFinite()) return false;
  const Eigen::Vector3d from = T.translation();
  Eigen::Isometry3d turned = Eigen::Isometry3d::Identity();
  turned.linear() = Eigen::Quaterniond(Eigen::Matrix3d(step.topLeftCorner<3, 3>())).normalized().toRotationMatrix();
  turned.translation() = step.topRightCorner<3, 1>();
  T = Eigen::Translation3d(from) * turned * Eigen::Translation3d(-from) * T;
  return true;
}

bool RoomRegistration::Impl::coarseFit(const Measured& measured, Eigen::Isometry3d& T) const {
  for (const double reach_m : {0.8, 0.35}) {
    if (!icp(measured.coarse, coarse, measured, reach_m, 20, T)) return false;
  }
  return true;
}

bool RoomRegistration::Impl::fineFit(const Measured& measured, Eigen::Isometry3d& T) const {
  for (const double reach_m : {0.25, 0.12}) {
    if (!icp(measured.fine, fine, measured, reach_m, 15, T)) return false;
  }
  return true;
}

/// Gauss-Newton on the same point-to-plane distances with the weights that the camera's noise asks for; leaves
/// covariance and information.
bool RoomRegistration::Impl::polish(const Measured& measured, Eigen::Isometry3d& T, Registration& result) const {
  const Cloud::Ptr target = visibleModel(fine, measured, T);
  if (target->size() < 50) return false;
  const Eigen::Vector3d origin = T.translation();
  pcl::KdTreeFLANN<pcl::PointNormal> tree;
  tree.setInputCloud(target);
  pcl::Indices nearest(1);
  std::vector<float> squared(1);
  for (int iteration = 0; iteration < 10; ++iteration) {
    Matrix6d H = Matrix6d::Zero(), scaled = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    std::map<std::array<int, 3>, Vector6d> patches;
    double weights = 0, arm2 = 0;
    std::vector<std::pair<Vector6d, double>> rows;
    for (const Surface& s : measured.fine) {
      const Eigen::Vector3d arm = T.linear() * s.point, p = arm + T.translation() - origin;
      pcl::PointNormal query;
      query.getVector3fMap() = p.cast<float>();
      if (tree.nearestKSearch(query, 1, nearest, squared) < 1) continue;
      const pcl::PointNormal& q = target->at(nearest[0]);
      const Eigen::Vector3d n = q.getNormalVector3fMap().cast<double>();
      const double distance = n.dot(p - q.getVector3fMap().cast<double>()), r = s.point.norm();
      const double sd = std::hypot(options.scene_error_m / 2,
                                   options.depth_noise_per_m * r * r * std::abs(n.dot(arm)) / r);
      // Beside a surface's end the nearest sample is no measure of the distance to its plane.
      if (squared[0] > 0.01 + 9 * sd * sd || n.dot(T.linear() * s.normal) < 0.5) continue;
      const double z = std::abs(distance) / sd;
      if (z > 4) continue;
      const double weight = std::min(1.0, 1.5 / std::max(z, 1e-9)) / (sd * sd);
      Vector6d J;
      J << n, arm.cross(n);
      H += weight * J * J.transpose();
      g += weight * distance * J;
      patches.try_emplace({static_cast<int>(std::floor(p.x() / kPatch_m)), static_cast<int>(std::floor(p.y() / kPatch_m)),
                           static_cast<int>(std::floor(p.z() / kPatch_m))},
                          Vector6d::Zero())
          .first->second += weight * distance * J;
      rows.emplace_back(J, weight);
      weights += weight;
      arm2 += weight * arm.squaredNorm();
    }
    if (rows.size() < 100) return false;
    const double arm_m = std::sqrt(arm2 / weights);
    for (auto& [J, weight] : rows) {
      J.tail<3>() /= arm_m;
      scaled += weight / weights * J * J.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Matrix6d> spectrum(scaled);
    result.information = spectrum.eigenvalues()(0);
    result.weakest = spectrum.eigenvectors().col(0);
    result.weakest.tail<3>() /= arm_m;  // unit length of (metres, radians times the points' distance)
    if (!(result.information > 1e-9)) return true;
    const Matrix6d inverse = H.ldlt().solve(Matrix6d::Identity());
    const Vector6d step = -(inverse * g);
    if (!step.allFinite() || step.norm() > 0.5) return false;
    if (step.norm() < 1e-6 || iteration == 9) {
      Matrix6d middle = H;  // what the model expects, and
      for (const auto& [cell, score] : patches) middle += score * score.transpose();  // what is there
      result.covariance = inverse * middle * inverse;
      return true;
    }
    const double turn = step.tail<3>().norm();
    T.translation() += step.head<3>();
    if (turn > 1e-12) T.linear() = Eigen::AngleAxisd(turn, step.tail<3>() / turn).toRotationMatrix() * T.linear();
  }
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
    const double limit = slack_m + 2 * options.scene_error_m + 2.5 * sigma(r) * std::max(cosine, 0.3);
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
  result.points = static_cast<int>(measured.voxels);
  const bool polished = fineFit(measured, T) && polish(measured, T, result);
  result.T_map_camera = T;
  const Verdict verdict = judge(measured.rays, T);
  result.agreement = verdict.agreement;
  result.behind = verdict.behind;
  result.before = verdict.before;
  result.coverage = verdict.coverage;
  result.rms_m = verdict.rms_m;
  const Vector6d deviation = result.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const double tilt = up_camera ? std::acos(std::clamp((T.linear() * *up_camera).z(), -1.0, 1.0)) : 0;
  if (!polished) {
    result.reason = "the cloud meets no surface of the scene near the guess; give a 2D Pose Estimate";
  } else if (verdict.coverage < options.min_coverage) {
    result.reason = format("the scene has nothing behind %.0f %% of the cloud; is it the right scene, and whole?",
                           100 * (1 - verdict.coverage));
  } else if (verdict.agreement < options.min_agreement || verdict.behind > options.max_behind) {
    result.reason = format("only %.0f %% of the cloud stands where the scene has a surface, %.0f %% behind one; give a "
                           "2D Pose Estimate, or see whether the scene is that of this room",
                           100 * verdict.agreement, 100 * verdict.behind);
  } else if (result.information < options.min_information) {
    const bool turn = result.weakest.tail<3>().norm() > result.weakest.head<3>().norm();
    const Eigen::Vector3d d = turn ? result.weakest.tail<3>().normalized() : result.weakest.head<3>().normalized();
    result.reason = std::string("what the camera sees does not fix the pose ") + (turn ? "about" : "along") +
                    format(" (%.1f %.1f %.1f) of map; turn it towards a corner or furniture", d.x(), d.y(), d.z());
  } else if (deviation.head<3>().maxCoeff() > options.max_std_m || deviation.tail<3>().maxCoeff() > options.max_std_rad) {
    result.reason = format("the fit is uncertain by %.1f cm and %.2f deg; go nearer, or turn towards a corner",
                           100 * deviation.head<3>().maxCoeff(), deviation.tail<3>().maxCoeff() * 180 / M_PI);
  } else if (tilt > options.max_tilt_rad) {
    result.reason = format("the fit stands %.1f deg off the vertical that the IMU measures", tilt * 180 / M_PI);
  }
  result.trusted = result.reason.empty();
  return result;
}

/// Poses all over the scene, at the fit's height and tilt, from which the cloud would look much as it does.
std::vector<Eigen::Isometry3d> RoomRegistration::Impl::rivals(const Measured& measured,
                                                              const Eigen::Isometry3d& T) const {
  const std::vector<Eigen::Vector3d> few = thinned(measured.rays, kRivalRays);
  std::vector<std::pair<double, Eigen::Isometry3d>> scored;
  for (double x = bounds.min().x(); x <= bounds.max().x(); x += kRivalGrid_m) {
    for (double y = bounds.min().y(); y <= bounds.max().y(); y += kRivalGrid_m) {
      for (double turn = 0; turn < 2 * M_PI - 1e-6; turn += kRivalGrid_rad) {
        Eigen::Isometry3d candidate = Eigen::Isometry3d::Identity();
        candidate.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T.linear();
        candidate.translation() = Eigen::Vector3d(x, y, T.translation().z());
        const Verdict verdict = judge(few, candidate, 0.35);
        if (verdict.coverage > 0.7 && verdict.agreement > 0.55) scored.emplace_back(verdict.agreement, candidate);
      }
    }
  }
  std::stable_sort(scored.begin(), scored.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Eigen::Isometry3d> result;
  for (const auto& [score, candidate] : scored) {
    const bool near = std::any_of(result.begin(), result.end(), [&c = candidate](const auto& r) {
      return (r.translation() - c.translation()).norm() < 0.8 && angleOf(r.linear().transpose() * c.linear()) < 0.4;
    });
    if (!near) result.push_back(candidate);
    if (result.size() == kMostRivals) break;
  }
  return result;
}

/// Looks for other poses that explain the cloud as well: along the weakest direction, where other starts ended, and
/// (`everywhere`) over the whole scene.
void RoomRegistration::Impl::refuseRivals(const Measured& measured, bool everywhere,
                                          const std::optional<Eigen::Vector3d>& up_camera,
                                          const std::vector<Eigen::Isometry3d>& others, Registration& result) const {
  std::vector<Eigen::Isometry3d> starts = others;
  for (const double side : {0.15, -0.15}) {
    const Vector6d step = side * result.weakest;
    Eigen::Isometry3d T = result.T_map_camera;
    T.translation() += step.head<3>();
    const double turn = step.tail<3>().norm();
    if (turn > 1e-9) T.linear() = Eigen::AngleAxisd(turn, step.tail<3>() / turn).toRotationMatrix() * T.linear();
    starts.push_back(T);
  }
  if (everywhere) {
    for (Eigen::Isometry3d T : rivals(measured, result.T_map_camera)) {
      if (coarseFit(measured, T)) starts.push_back(T);
    }
  }
  for (const Eigen::Isometry3d& start : starts) {
    if (sameFit(start, result.T_map_camera)) continue;
    if (judge(thinned(measured.rays, 400), start, 0.1).agreement < 0.5) continue;  // not worth a fine fit
    const Registration rival = finish(measured, start, up_camera);
    ++result.starts;
    if (sameFit(rival.T_map_camera, result.T_map_camera)) continue;
    if (rival.behind > 2 * options.max_behind || rival.coverage < options.min_coverage) continue;
    if (rival.agreement < result.agreement - kRivalMargin) continue;
    result.trusted = false;
    result.reason = "ambiguous: the cloud fits as well at " + poseText(rival.T_map_camera) + " as at " +
                    poseText(result.T_map_camera) + "; turn the camera to where the room differs";
    return;
  }
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
  result.points = static_cast<int>(measured.voxels);
  if (result.points < options.min_points || measured.fine.empty()) {
    result.reason = format("the cloud has only %.0f points (of 5 cm voxels) between %.1f and %.1f m", result.points,
                           options.min_depth_m, options.max_depth_m);
    return result;
  }
  Eigen::Isometry3d start = guess;
  if (up_camera) {
    start.linear() = Eigen::Quaterniond::FromTwoVectors(start.linear() * *up_camera, Eigen::Vector3d::UnitZ())
                         .toRotationMatrix() *
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
    // Little holds the pose in one direction: see whether it slides.
    if (result.trusted && result.information < 3 * options.min_information) {
      impl_->refuseRivals(measured, false, up_camera, {}, result);
    }
    if (result.trusted) return result;
  }
  // Several starts around the guess, best first.
  const double reach_m = kind == GuessKind::kTracking ? options.max_step_m : options.search_m;
  const double reach_rad = kind == GuessKind::kTracking ? options.max_step_rad : options.search_rad;
  std::vector<std::pair<double, Eigen::Isometry3d>> ends;
  int starts = 0;
  for (const double turn : {0.0, -0.6, 0.6}) {
    for (const auto& [dx, dy] : {std::pair(0.0, 0.0), {0.6, 0.0}, {-0.6, 0.0}, {0.0, 0.6}, {0.0, -0.6}}) {
      Eigen::Isometry3d T = start;
      T.translation() += reach_m * Eigen::Vector3d(dx, dy, 0);
      T.linear() = Eigen::AngleAxisd(reach_rad * turn, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T.linear();
      ++starts;
      if (!impl_->coarseFit(measured, T)) continue;
      const Impl::Verdict verdict = impl_->judge(thinned(measured.rays, 400), T, 0.05);
      ends.emplace_back(verdict.agreement * std::min(1.0, verdict.coverage / options.min_coverage), T);
    }
  }
  std::stable_sort(ends.begin(), ends.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<Eigen::Isometry3d> distinct;
  for (const auto& [score, T] : ends) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&t = T](const auto& d) { return sameFit(d, t, 2); });
    if (!known && distinct.size() < 4) distinct.push_back(T);
  }
  bool first = true;
  for (const Eigen::Isometry3d& T : distinct) {
    Registration fit = impl_->finish(measured, T, up_camera);
    if (first || (fit.trusted && !result.trusted) ||
        (fit.trusted == result.trusted && fit.agreement > result.agreement)) {
      result = fit;
    }
    first = false;
  }
  result.starts = starts;
  if (first) result.reason = "the cloud meets no surface of the scene near the guess; give a 2D Pose Estimate";
  refuseFar(result);
  if (result.trusted) impl_->refuseRivals(measured, kind == GuessKind::kPerson, up_camera, distinct, result);
  return result;
}

}  // namespace mmradartwin
