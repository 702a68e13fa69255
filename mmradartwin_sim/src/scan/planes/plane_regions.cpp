#include "scan/planes/plane_regions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kSameSide = 0.94;           // cosine of 20 deg: normals of few noisy neighbours scatter
constexpr double kLeastTolerance_m = 0.006;  // rounding of voxels alone
const double kSameTurn = std::cos(bounds::kSameTurn_deg * bounds::kDegree);  // of parts of one plane

/// Sums of points, from which their plane follows at any time.
class PlaneSums {
 public:
  explicit PlaneSums(const Eigen::Vector3d& about) : about_(about) {}
  void add(const Eigen::Vector3d& p) {
    const Eigen::Vector3d d = p - about_;
    ++count_;
    sum_ += d;
    squares_ += d * d.transpose();
  }
  std::size_t count() const { return count_; }
  Eigen::Vector3d mean() const { return about_ + sum_ / static_cast<double>(count_); }
  Eigen::Matrix3d covariance() const {
    const Eigen::Vector3d m = sum_ / static_cast<double>(count_);
    return squares_ / static_cast<double>(count_) - m * m.transpose();
  }

 private:
  Eigen::Vector3d about_, sum_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares_ = Eigen::Matrix3d::Zero();
  std::size_t count_ = 0;
};

class Growth {
 public:
  Growth(const ScanSamples& samples, double smallest_m2)
      : samples_(samples),
        smallest_(static_cast<std::size_t>(smallest_m2 / samples.area_m2())),
        owner_(samples.size(), -1) {}

  std::vector<PlaneRegion> run(const Progress& progress) {
    std::vector<int> order(samples_.size());
    std::iota(order.begin(), order.end(), 0);
    const auto flatness = [this](int i) { return samples_.flatness_m[static_cast<std::size_t>(i)]; };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return flatness(a) < flatness(b); });
    for (std::size_t k = 0; k < order.size(); ++k) {
      if (k % 20000 == 0 && progress) progress(static_cast<double>(k) / static_cast<double>(order.size()), "planes");
      const int seed = order[k];
      if (owner_[static_cast<std::size_t>(seed)] != -1 || normalOf(seed).isZero()) continue;
      // Two sheets a voxel or two apart are no flatter than that, and each of them is a plane.
      const double noise_m = samples_.noiseAlong(seed, normalOf(seed).cast<double>());
      if (flatness(seed) > std::max(2 * noise_m, samples_.spacing_m)) continue;
      grow(seed);
    }
    join();
    std::vector<PlaneRegion> kept;
    for (PlaneRegion& r : regions_) {
      if (r.samples.size() >= smallest_) kept.push_back(std::move(r));
    }
    std::stable_sort(kept.begin(), kept.end(),
                     [](const PlaneRegion& a, const PlaneRegion& b) { return a.samples.size() > b.samples.size(); });
    return kept;
  }

 private:
  const Eigen::Vector3f& normalOf(int i) const { return samples_.normals[static_cast<std::size_t>(i)]; }
  bool fits(int i, const Eigen::Vector3d& normal, const Eigen::Vector3d& mean) const {
    const double cosine = normalOf(i).cast<double>().dot(normal);
    if ((samples_.oriented ? cosine : std::abs(cosine)) < kSameSide) return false;
    return std::abs(normal.dot(samples_.at(i) - mean)) < planeTolerance(samples_, i, normal);
  }

  void grow(int seed) {
    const int id = static_cast<int>(regions_.size());
    PlaneSums sums(samples_.at(seed));
    Eigen::Vector3d normal = normalOf(seed).cast<double>(), mean = samples_.at(seed);
    std::vector<int> queue = {seed};
    owner_[static_cast<std::size_t>(seed)] = id;
    std::size_t next_fit = 24;
    for (std::size_t at = 0; at < queue.size(); ++at) {
      const auto i = static_cast<std::size_t>(queue[at]);
      sums.add(samples_.at(queue[at]));
      if (sums.count() >= next_fit) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(sums.covariance());
        const Eigen::Vector3d fitted = spectrum.eigenvectors().col(0);
        normal = fitted.dot(normal) < 0 ? Eigen::Vector3d(-fitted) : fitted;
        mean = sums.mean();
        next_fit = next_fit * 3 / 2;
      }
      for (std::size_t k = samples_.first[i]; k < samples_.first[i + 1]; ++k) {
        const int j = samples_.neighbour[k];
        int& owner = owner_[static_cast<std::size_t>(j)];
        if (owner == -1 && fits(j, normal, mean)) {
          owner = id;
          queue.push_back(j);
        }
      }
    }
    PlaneRegion region;
    region.normal = normal;
    region.offset_m = normal.dot(mean);
    region.samples = std::move(queue);
    // Parts too small to stand alone may join others; crumbs are given back.
    if (region.samples.size() < std::max<std::size_t>(24, smallest_ / 4)) {
      for (int i : region.samples) owner_[static_cast<std::size_t>(i)] = -2;
      return;
    }
    std::sort(region.samples.begin(), region.samples.end());
    fitPlane(samples_, 0, region);
    drop(region);
    regions_.push_back(std::move(region));
  }

  /// Gives back what the fitted plane does not hold.
  void drop(PlaneRegion& region) {
    std::vector<int> kept;
    for (int i : region.samples) {
      if (std::abs(region.distance(samples_.at(i))) < planeTolerance(samples_, i, region.normal)) {
        kept.push_back(i);
      } else {
        owner_[static_cast<std::size_t>(i)] = -1;
      }
    }
    region.samples = std::move(kept);
  }

  bool alike(const PlaneRegion& a, const PlaneRegion& b) const {
    const double cosine = a.normal.dot(b.normal);
    if ((samples_.oriented ? cosine : std::abs(cosine)) < kSameTurn) return false;
    const double slack = planeTolerance(samples_, b);
    return std::abs(a.distance(b.middle)) < slack && std::abs(b.distance(a.middle)) < slack;
  }

  void join() {
    for (bool joined = true; joined;) {
      joined = false;
      std::vector<std::set<int>> touching(regions_.size());
      for (std::size_t i = 0; i < samples_.size(); ++i) {
        const int a = owner_[i];
        if (a < 0) continue;
        for (std::size_t k = samples_.first[i]; k < samples_.first[i + 1]; ++k) {
          const int b = owner_[static_cast<std::size_t>(samples_.neighbour[k])];
          if (b >= 0 && b != a) touching[static_cast<std::size_t>(a)].insert(b);
        }
      }
      std::vector<int> order(regions_.size());
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(), [this](int a, int b) {
        return regions_[static_cast<std::size_t>(a)].samples.size() >
               regions_[static_cast<std::size_t>(b)].samples.size();
      });
      std::vector<char> taken(regions_.size(), 0);
      for (int large : order) {
        PlaneRegion& a = regions_[static_cast<std::size_t>(large)];
        if (taken[static_cast<std::size_t>(large)] || a.samples.empty()) continue;
        for (int small : touching[static_cast<std::size_t>(large)]) {
          PlaneRegion& b = regions_[static_cast<std::size_t>(small)];
          if (taken[static_cast<std::size_t>(small)] || b.samples.empty() || b.samples.size() > a.samples.size())
            continue;
          if (!alike(a, b)) continue;
          for (int i : b.samples) owner_[static_cast<std::size_t>(i)] = large;
          a.samples.insert(a.samples.end(), b.samples.begin(), b.samples.end());
          b.samples.clear();
          taken[static_cast<std::size_t>(large)] = taken[static_cast<std::size_t>(small)] = 1;
          joined = true;
        }
        if (!taken[static_cast<std::size_t>(large)]) continue;
        std::sort(a.samples.begin(), a.samples.end());
        fitPlane(samples_, 0, a);
      }
    }
  }

  const ScanSamples& samples_;
  const std::size_t smallest_;
  std::vector<int> owner_;  // region of each sample; -1 none, -2 a crumb
  std::vector<PlaneRegion> regions_;
};

}  // namespace

double planeTolerance(const ScanSamples& samples) { return std::max(kLeastTolerance_m, 3 * samples.noise_m); }

double planeTolerance(const ScanSamples& samples, int i, const Eigen::Vector3d& normal) {
  return std::max(kLeastTolerance_m, 3 * samples.noiseAlong(i, normal));
}

double planeTolerance(const ScanSamples& samples, const PlaneRegion& region) {
  if (samples.error_m.empty() || region.samples.empty()) return planeTolerance(samples);
  double sum = 0;
  for (int i : region.samples) sum += samples.noiseAlong(i, region.normal);
  return std::max(kLeastTolerance_m, 3 * sum / static_cast<double>(region.samples.size()));
}

void measurePlane(const ScanSamples& samples, PlaneRegion& region) {
  if (region.samples.empty()) return;
  const Eigen::Vector3d u = region.normal.unitOrthogonal(), v = region.normal.cross(u);
  std::map<std::pair<int, int>, std::pair<double, double>> patches;  // sum and count
  PlaneSums sums(samples.at(region.samples.front()));
  double squares = 0;
  for (int i : region.samples) {
    const Eigen::Vector3d p = samples.at(i);
    const double d = region.distance(p);
    sums.add(p);
    squares += d * d;
    auto& patch = patches[{static_cast<int>(std::floor(u.dot(p) / bounds::kDriftPatch_m)),
                           static_cast<int>(std::floor(v.dot(p) / bounds::kDriftPatch_m))}];
    patch.first += d, patch.second += 1;
  }
  const auto count = static_cast<double>(region.samples.size());
  region.middle = sums.mean();
  region.area_m2 = count * samples.area_m2();
  region.rms_m = std::sqrt(squares / count);
  double bow = 0;
  for (const auto& [place, patch] : patches) bow += patch.first * patch.first / patch.second;
  region.bow_m = std::sqrt(bow / count);
  // A patch is one measurement of the plane: its samples err together.
  const double whole_patches = std::max(1.0, region.area_m2 / (bounds::kDriftPatch_m * bounds::kDriftPatch_m));
  const double one_m = std::max(region.bow_m, region.rms_m / std::sqrt(std::max(1.0, count / whole_patches)));
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(sums.covariance());
  const double reach_m = std::sqrt(std::max(1e-6, spectrum.eigenvalues()[1]));  // the shorter way in the plane
  region.offset_std_m = one_m / std::sqrt(whole_patches);
  region.angle_std_rad = region.offset_std_m / reach_m;
}

void fitPlane(const ScanSamples& samples, double least_m, PlaneRegion& region) {
  for (int round = 0; round < 2; ++round) {
    PlaneSums sums(samples.at(region.samples.front()));
    for (int i : region.samples) {
      const Eigen::Vector3d p = samples.at(i);
      const double tolerance_m = std::max(least_m, planeTolerance(samples, i, region.normal));
      if (round == 0 || std::abs(region.distance(p)) < tolerance_m) sums.add(p);
    }
    if (sums.count() < 3) break;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(sums.covariance());
    const Eigen::Vector3d fitted = spectrum.eigenvectors().col(0);
    region.normal = fitted.dot(region.normal) < 0 ? Eigen::Vector3d(-fitted) : fitted;
    region.offset_m = region.normal.dot(sums.mean());
  }
  measurePlane(samples, region);
}

std::vector<PlaneRegion> growPlanes(const ScanSamples& samples, double smallest_m2, const Progress& progress) {
  return Growth(samples, smallest_m2).run(progress);
}

void fitOffset(const ScanSamples& samples, PlaneRegion& region) {
  std::vector<double> along;
  for (int i : region.samples) {
    const auto s = static_cast<std::size_t>(i);
    for (std::size_t k = samples.dense_first[s]; k < samples.dense_first[s + 1]; ++k) {
      along.push_back(region.normal.dot(samples.dense[k].cast<double>()));
    }
  }
  if (along.empty()) return;
  const auto median = [](std::vector<double>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  region.offset_m = median(along);
  std::vector<double> off;
  for (double a : along) off.push_back(std::abs(a - region.offset_m));
  const double limit_m = std::max(2 * 1.4826 * median(off), 0.001);  // of a normal distribution: its deviation
  for (int round = 0; round < 3; ++round) {
    double sum = 0;
    std::size_t count = 0;
    for (double a : along) {
      if (std::abs(a - region.offset_m) < limit_m) sum += a - region.offset_m, ++count;
    }
    if (count) region.offset_m += sum / static_cast<double>(count);
  }
}

}  // namespace mmradartwin
