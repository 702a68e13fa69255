#include "scan/samples/scan_samples.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include "mmradartwin_dsp/input_error.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kMostSamples = 450000;  // else the voxels grow: a large flat has 500 m2 of surface
constexpr double kWide_m = 0.8;               // the scale at which noise is measured: slower than a scanner's ripple
constexpr std::size_t kWidePlaces = 3000;     // at which it is measured: an effort
constexpr double kLeastSight = 0.17;     // cosine between a plane's normal and the ray of sight: 10 deg above the plane
constexpr double kWidestReach_m = 0.15;  // of neighbours: corners of furniture are rounded by as much

struct DensePoint {
  std::uint64_t voxel;
  std::uint32_t index;
};

/// Voxels in one number, so that sorting brings a voxel's points together.
class VoxelKey {
 public:
  VoxelKey(const std::vector<Eigen::Vector3f>& points, double side_m) : side_m_(static_cast<float>(side_m)) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& p : points) box.extend(p);
    low_ = box.min();
    if ((box.sizes() / side_m_).maxCoeff() > 2e6F) throw InputError("a scan this wide holds no room; cut it to one");
  }
  std::uint64_t of(const Eigen::Vector3f& p) const {
    const Eigen::Vector3f cell = (p - low_) / side_m_;
    return (static_cast<std::uint64_t>(cell.z()) << 42) | (static_cast<std::uint64_t>(cell.y()) << 21) |
           static_cast<std::uint64_t>(cell.x());
  }

 private:
  float side_m_;
  Eigen::Vector3f low_;
};

struct DenseCloud {
  std::vector<Eigen::Vector3f> points, normals;  // normals times area; of a cloud none
  std::vector<Eigen::Vector3f> colors;
  std::vector<int> triangles;  // of a mesh, that each point lies on
};

Eigen::Vector3f colorOf(const RawScan& scan, std::size_t i) {
  return Eigen::Vector3f(scan.colors[i][0], scan.colors[i][1], scan.colors[i][2]) / 255;
}

/// A cloud's points themselves; of a mesh, points spread over its triangles, one at least for each.
DenseCloud densePoints(const RawScan& scan, double unit_m) {
  DenseCloud dense;
  const auto unit = static_cast<float>(unit_m);
  const bool colored = scan.colors.size() == scan.points.size() && !scan.colors.empty();
  if (scan.triangles.empty()) {
    dense.points.reserve(scan.points.size());
    for (const Eigen::Vector3f& p : scan.points) dense.points.push_back(unit * p);
    for (std::size_t i = 0; colored && i < scan.colors.size(); ++i) dense.colors.push_back(colorOf(scan, i));
    return dense;
  }
  dense.points.reserve(scan.triangles.size());
  dense.normals.reserve(scan.triangles.size());
  for (const auto& t : scan.triangles) {
    const auto at = [&](int k) { return static_cast<std::size_t>(t[static_cast<std::size_t>(k)]); };
    const Eigen::Vector3f a = unit * scan.points[at(0)], b = unit * scan.points[at(1)] - a,
                          c = unit * scan.points[at(2)] - a;
    const Eigen::Vector3f n = 0.5F * b.cross(c);
    const double share = n.norm() / (0.5 * bounds::kFinest_m * bounds::kFinest_m);
    if (share > 1e7) continue;  // a triangle of thousands of square metres is no surface of a room
    const int count = std::max(1, static_cast<int>(share));
    for (int k = 0; k < count; ++k) {
      // The R2 sequence fills the triangle evenly; its first point is the centroid of a triangle that has one point.
      double u = 1.0 / 3, v = 1.0 / 3;
      if (count > 1) {
        u = std::fmod(0.5 + 0.7548776662466927 * (k + 1), 1.0), v = std::fmod(0.5 + 0.5698402909980532 * (k + 1), 1.0);
        if (u + v > 1) u = 1 - u, v = 1 - v;
      }
      dense.points.push_back(a + static_cast<float>(u) * b + static_cast<float>(v) * c);
      dense.normals.push_back(n / static_cast<float>(count));
      dense.triangles.push_back(static_cast<int>(&t - scan.triangles.data()));
      if (colored) {
        dense.colors.push_back((colorOf(scan, at(0)) + colorOf(scan, at(1)) + colorOf(scan, at(2))) / 3);
      }
    }
    if (dense.points.size() > 40000000) throw InputError(scan.file + ": its surface is that of no room; cut it to one");
  }
  return dense;
}

std::vector<DensePoint> inVoxels(const std::vector<Eigen::Vector3f>& points, double& side_m) {
  std::vector<DensePoint> order(points.size());
  for (;; side_m *= 1.25) {
    const VoxelKey key(points, side_m);
    for (std::size_t i = 0; i < points.size(); ++i) order[i] = {key.of(points[i]), static_cast<std::uint32_t>(i)};
    std::sort(order.begin(), order.end(), [](const DensePoint& a, const DensePoint& b) {
      return a.voxel != b.voxel ? a.voxel < b.voxel : a.index < b.index;
    });
    std::size_t voxels = 0;
    for (std::size_t i = 0; i < order.size(); ++i) voxels += i == 0 || order[i].voxel != order[i - 1].voxel;
    if (voxels <= kMostSamples) return order;
  }
}

struct LocalPlane {
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  float rms_m = 0;
};

template <typename Indices>
LocalPlane planeThrough(const std::vector<Eigen::Vector3f>& points, const Indices& indices) {
  LocalPlane plane;
  if (indices.size() < 6) return plane;
  const Eigen::Vector3f about = points[static_cast<std::size_t>(indices[0])];
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (int i : indices) sum += points[static_cast<std::size_t>(i)] - about;
  const Eigen::Vector3f mean = sum / static_cast<float>(indices.size());
  Eigen::Matrix3f scatter = Eigen::Matrix3f::Zero();
  for (int i : indices) {
    const Eigen::Vector3f d = points[static_cast<std::size_t>(i)] - about - mean;
    scatter += d * d.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> spectrum(scatter);
  plane.normal = spectrum.eigenvectors().col(0);
  plane.rms_m = std::sqrt(std::max(0.0F, spectrum.eigenvalues()[0]) / static_cast<float>(indices.size() - 3));
  return plane;
}

class Thinning {
 public:
  Thinning(const RawScan& scan, double unit_m, const Progress& progress)
      : progress_(progress),
        sight_from_m_(scan.camera_axes ? std::optional<Eigen::Vector3d>(-unit_m * scan.offset) : std::nullopt) {
    DenseCloud dense = densePoints(scan, unit_m);
    if (dense.points.size() < 1000) throw InputError(scan.file + ": has no surface to speak of");
    samples_.spacing_m = bounds::kFinest_m;
    const std::vector<DensePoint> order = inVoxels(dense.points, samples_.spacing_m);
    samples_.oriented = !dense.normals.empty();
    samples_.dense.reserve(order.size());
    for (std::size_t i = 0; i < order.size();) {
      std::size_t end = i;
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      Eigen::Vector3f color = Eigen::Vector3f::Zero(), area = Eigen::Vector3f::Zero();
      samples_.dense_first.push_back(samples_.dense.size());
      for (; end < order.size() && order[end].voxel == order[i].voxel; ++end) {
        const std::size_t k = order[end].index;
        sum += dense.points[k].cast<double>();
        samples_.dense.push_back(dense.points[k]);
        if (samples_.oriented) samples_.dense_triangle.push_back(dense.triangles[k]);
        if (samples_.oriented) area += dense.normals[k];
        if (!dense.colors.empty()) color += dense.colors[k];
      }
      const auto count = static_cast<float>(end - i);
      samples_.points.push_back((sum / static_cast<double>(end - i)).cast<float>());
      if (samples_.oriented) area_.push_back(area);
      if (!dense.colors.empty()) samples_.colors.push_back(color / count);
      i = end;
    }
    samples_.dense_first.push_back(samples_.dense.size());
  }

  ScanSamples run() {
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    for (const Eigen::Vector3f& p : samples_.points) cloud->push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    tree_.setInputCloud(cloud);
    measureNoise();
    if (sight_from_m_) measureErrors();
    findNormals();
    return std::move(samples_);
  }

 private:
  std::vector<int> within(std::size_t i, double reach_m) const {
    std::vector<int> found;
    std::vector<float> squared;
    const Eigen::Vector3f& p = samples_.points[i];
    tree_.radiusSearch(pcl::PointXYZ(p.x(), p.y(), p.z()), reach_m, found, squared);
    std::sort(found.begin(), found.end());
    return found;
  }

  /// rms distance from planes of kWide_m at places spread over the scan: what a quarter of them is below, since
  /// furniture and corners are in most of the others.
  void measureNoise() {
    const std::size_t places = std::min(kWidePlaces, samples_.size());
    std::vector<float> rms(places, -1);
    tbb::parallel_for(std::size_t{0}, places, [&](std::size_t k) {
      const std::vector<int> around = within(k * samples_.size() / places, kWide_m / 2);
      if (around.size() >= 30) rms[k] = planeThrough(samples_.points, around).rms_m;
    });
    rms.erase(std::remove(rms.begin(), rms.end(), -1.0F), rms.end());
    std::sort(rms.begin(), rms.end());
    samples_.noise_m = rms.empty() ? bounds::kFinest_m : static_cast<double>(rms[rms.size() / 10]);
  }

  /// A depth camera triangulates: its depth z errs by b z^2 (Khoshelham and Elberink, Accuracy and Resolution of Kinect
  /// Depth Data, 2012), the point by b z p. b is found from the planes of the same places, of which the normal sees a
  /// part.
  void measureErrors() {
    const std::size_t places = std::min(kWidePlaces, samples_.size());
    std::vector<double> factors(places, -1);
    tbb::parallel_for(std::size_t{0}, places, [&](std::size_t k) {
      const std::size_t i = k * samples_.size() / places;
      const std::vector<int> around = within(i, kWide_m / 2);
      if (around.size() < 30) return;
      const LocalPlane plane = planeThrough(samples_.points, around);
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (int n : around) middle += samples_.at(n) / static_cast<double>(around.size());
      const Eigen::Vector3d p = middle - *sight_from_m_;
      // Planes that are seen at a grazing angle say nothing of the depth's error.
      const double seen = std::abs(plane.normal.cast<double>().dot(p));
      if (seen > kLeastSight * p.norm()) factors[k] = static_cast<double>(plane.rms_m) / (p.z() * seen);
    });
    factors.erase(std::remove(factors.begin(), factors.end(), -1.0), factors.end());
    if (factors.empty()) return;
    std::sort(factors.begin(), factors.end());
    const double b = factors[factors.size() / 10];
    for (const Eigen::Vector3f& sample : samples_.points) {
      const Eigen::Vector3d p = sample.cast<double>() - *sight_from_m_;
      samples_.error_m.push_back((b * p.z() * p).cast<float>());
    }
    std::vector<float> sizes;
    for (const Eigen::Vector3f& e : samples_.error_m) sizes.push_back(e.norm());
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    samples_.noise_m = static_cast<double>(sizes[sizes.size() / 2]);  // that is said of the scan
  }

  void findNormals() {
    const std::size_t count = samples_.size();
    // Noise turns a normal by about noise / (reach / 2 * sqrt(neighbours)); noisy scans need a wider reach.
    const auto reach_m = [this](std::size_t i) {
      const double noise_m =
          samples_.error_m.empty() ? samples_.noise_m : static_cast<double>(samples_.error_m[i].norm());
      return std::max(bounds::kReachOfNormals_voxels * samples_.spacing_m, std::min(5 * noise_m, kWidestReach_m));
    };
    std::vector<std::vector<int>> around(count);
    samples_.normals.assign(count, Eigen::Vector3f::Zero());
    samples_.flatness_m.assign(count, 0);
    std::atomic<std::size_t> done{0};
    tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) {
      around[i] = within(i, reach_m(i));
      if (samples_.oriented) {
        // The other side of a thin plate is another plane.
        const auto other = [&](int k) { return area_[static_cast<std::size_t>(k)].dot(area_[i]) < 0; };
        around[i].erase(std::remove_if(around[i].begin(), around[i].end(), other), around[i].end());
      }
      const LocalPlane plane = planeThrough(samples_.points, around[i]);
      samples_.normals[i] = plane.normal;
      samples_.flatness_m[i] = plane.rms_m;
      if (samples_.oriented) {
        Eigen::Vector3f area = Eigen::Vector3f::Zero();
        for (int k : around[i]) area += area_[static_cast<std::size_t>(k)];
        if (area.dot(samples_.normals[i]) < 0) samples_.normals[i] *= -1;
      }
      const std::size_t now = ++done;
      if (now % 20000 == 0 && progress_) progress_(static_cast<double>(now) / static_cast<double>(count), "normals");
    });
    samples_.first.assign(1, 0);
    for (std::vector<int>& list : around) {
      samples_.neighbour.insert(samples_.neighbour.end(), list.begin(), list.end());
      samples_.first.push_back(samples_.neighbour.size());
      list = {};
    }
  }

  const Progress& progress_;
  const std::optional<Eigen::Vector3d> sight_from_m_;  // of one frame of a camera, axes of the file
  ScanSamples samples_;
  std::vector<Eigen::Vector3f> area_;  // normal times area of a sample's triangles
  pcl::KdTreeFLANN<pcl::PointXYZ> tree_;
};

}  // namespace

ScanSamples thinScan(const RawScan& scan, double unit_m, const Progress& progress) {
  return Thinning(scan, unit_m, progress).run();
}

}  // namespace mmradartwin
