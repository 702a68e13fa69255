#include "scan/things/thing_shapes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

// Corners by bits of x, y and z; counter-clockwise as seen from outside.
constexpr int kBoxFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
constexpr int kSides = 24;  // of a tessellated cylinder: sagitta below a hundredth of the radius

/// Share within the tolerance, rms and largest of what lies within it.
template <typename Distance>
void measureShape(const ScanSamples& samples, const std::vector<int>& indices, double tolerance_m,
                  const Distance& distance, double& share, double& rms_m, double& largest_m) {
  std::size_t near = 0;
  double squares = 0;
  largest_m = 0;
  for (int i : indices) {
    const double d = std::abs(distance(samples.at(i)));
    if (d > tolerance_m) continue;
    ++near;
    squares += d * d;
    largest_m = std::max(largest_m, d);
  }
  share = indices.empty() ? 0 : static_cast<double>(near) / static_cast<double>(indices.size());
  rms_m = near ? std::sqrt(squares / static_cast<double>(near)) : 0;
}

double quantile(std::vector<double>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

double distanceToBox(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& p) {
  const Eigen::Vector3d outside = (box.min() - p).cwiseMax(p - box.max());
  const double most = outside.maxCoeff();
  return most > 0 ? outside.cwiseMax(0).norm() : most;
}

UprightBox boxAlong(const ScanSamples& samples, const std::vector<int>& indices, double yaw_rad, double tolerance_m) {
  UprightBox fit;
  fit.yaw_rad = yaw_rad;
  std::vector<Eigen::Vector3d> points, normals;
  for (int i : indices) {
    points.push_back(fit.toBox(samples.at(i)));
    normals.push_back(fit.toBox(samples.normals[static_cast<std::size_t>(i)].cast<double>()));
  }
  const auto faces = static_cast<std::size_t>(0.01 / samples.area_m2());  // samples that make a face
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& p : points) values.push_back(p[axis]);
    std::vector<double> sorted = values;
    const double low = quantile(sorted, 0.005), high = quantile(sorted, 0.995);
    for (bool upper : {false, true}) {
      const double end = upper ? high : low;
      std::vector<double> face;
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (std::abs(normals[k][axis]) > 0.85 && std::abs(values[k] - end) < 2 * tolerance_m) face.push_back(values[k]);
      }
      const double at = face.size() > std::max<std::size_t>(faces, 12) ? quantile(face, 0.5) : end;
      (upper ? fit.box.max() : fit.box.min())[axis] = at;
    }
  }
  measureShape(
      samples, indices, tolerance_m, [&](const Eigen::Vector3d& p) { return distanceToBox(fit.box, fit.toBox(p)); },
      fit.share, fit.rms_m, fit.largest_m);
  return fit;
}

}  // namespace

Eigen::Vector3d UprightBox::toBox(const Eigen::Vector3d& p) const {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * p.x() + s * p.y(), -s * p.x() + c * p.y(), p.z()};
}
Eigen::Vector3d UprightBox::toMap(const Eigen::Vector3d& p) const {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z()};
}

UprightBox fitBox(const ScanSamples& samples, const std::vector<int>& indices, const std::vector<double>& yaws_rad,
                  double tolerance_m) {
  UprightBox best;
  best.share = -1;
  for (double yaw : yaws_rad) {
    const UprightBox fit = boxAlong(samples, indices, yaw, tolerance_m);
    // The first directions are the room's: others must hold clearly more.
    const double margin = best.share < 0 ? 0 : 0.05;
    const bool smaller = fit.share > best.share - 0.02 && fit.box.volume() < 0.85 * best.box.volume();
    if (fit.share > best.share + margin || (best.share >= 0 && smaller)) best = fit;
  }
  return best;
}

BoxEvidence evidenceOf(const ScanSamples& samples, const std::vector<int>& indices, const UprightBox& box,
                       double tolerance_m) {
  BoxEvidence evidence;
  std::vector<CellRaster> faces(5, CellRaster(bounds::kCell_m));  // -x, x, -y, y, top
  std::size_t on = 0, inward = 0;
  for (int i : indices) {
    const Eigen::Vector3d p = box.toBox(samples.at(i));
    const Eigen::Vector3d n = box.toBox(samples.normals[static_cast<std::size_t>(i)].cast<double>());
    for (int f = 0; f < 5; ++f) {
      const int axis = f / 2;
      const bool upper = f % 2 == 1 || axis == 2;
      const double end = upper ? box.box.max()[axis] : box.box.min()[axis];
      if (std::abs(p[axis] - end) > tolerance_m || std::abs(n[axis]) < 0.7) continue;
      faces[static_cast<std::size_t>(f)].set({p[(axis + 1) % 3], p[(axis + 2) % 3]});
      ++on;
      inward += samples.oriented && (upper ? -n[axis] : n[axis]) > 0;
      break;
    }
  }
  const Eigen::Vector3d size = box.box.sizes();
  const double all = 2 * (size.x() + size.y()) * size.z() + size.x() * size.y();
  double covered = 0;
  for (const CellRaster& face : faces) covered += face.area_m2();
  evidence.covered = all > 0 ? covered / all : 0;
  evidence.inward = on ? static_cast<double>(inward) / static_cast<double>(on) : 0;
  return evidence;
}

Plate plateOf(const ScanSamples& samples, const std::vector<int>& indices, const Eigen::Vector3d& normal,
              double offset_m, double thickness_m) {
  const bool level = std::abs(normal.z()) > bounds::kLevelPlane;
  // A level plate along its own sides, by the smallest rectangle; others along the level.
  Eigen::Vector3d u =
      level ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(Eigen::Vector3d::UnitZ().cross(normal).normalized());
  u = (u - u.dot(normal) * normal).normalized();
  Plate best;
  double smallest = 1e300;
  for (int turn = 0; turn < (level ? 18 : 1); ++turn) {
    const Eigen::Vector3d a = Eigen::AngleAxisd(turn * M_PI / 36, normal) * u, b = normal.cross(a);
    std::vector<double> along, across;
    for (int i : indices) {
      const Eigen::Vector3d p = samples.at(i);
      along.push_back(a.dot(p)), across.push_back(b.dot(p));
    }
    const double a0 = quantile(along, 0.01), a1 = quantile(along, 0.99), b0 = quantile(across, 0.01),
                 b1 = quantile(across, 0.99);
    if ((a1 - a0) * (b1 - b0) > smallest) continue;
    smallest = (a1 - a0) * (b1 - b0);
    best = {offset_m * normal + a0 * a + b0 * b, (a1 - a0) * a, (b1 - b0) * b, -thickness_m * normal};
  }
  return best;
}

void addPlate(const Plate& plate, ScanThing& thing) {
  const int base = static_cast<int>(thing.vertices.size());
  for (int i = 0; i < 8; ++i) {
    thing.vertices.push_back(plate.corner + (i & 1 ? 1 : 0) * plate.e1 + (i & 2 ? 1 : 0) * plate.e2 +
                             (i & 4 ? 0 : 1) * plate.back);
    thing.bounds.extend(thing.vertices.back());
  }
  for (const auto& f : kBoxFaces) {
    thing.triangles.push_back({base + f[0], base + f[1], base + f[2]});
    thing.triangles.push_back({base + f[0], base + f[2], base + f[3]});
  }
}

UprightCylinder fitCylinder(const ScanSamples& samples, const std::vector<int>& indices, double tolerance_m) {
  UprightCylinder fit;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  std::vector<double> heights;
  if (indices.empty()) return fit;
  const Eigen::Vector3d about = samples.at(indices[0]);
  for (int i : indices) {
    const Eigen::Vector3d p = samples.at(i) - about;
    heights.push_back(p.z() + about.z());
    if (std::abs(samples.normals[static_cast<std::size_t>(i)].z()) > 0.5F) continue;
    const Eigen::Vector3d row(p.x(), p.y(), 1);
    A += row * row.transpose();
    b += row * (p.x() * p.x() + p.y() * p.y());
  }
  if (A(2, 2) < 30) return fit;
  const Eigen::Vector3d solution = A.ldlt().solve(b);
  const Eigen::Vector2d center = 0.5 * solution.head<2>();
  fit.radius_m = std::sqrt(std::max(0.0, solution.z() + center.squaredNorm()));
  fit.center = center + about.head<2>();
  fit.low_m = quantile(heights, 0.005), fit.high_m = quantile(heights, 0.995);
  const auto distance = [&fit](const Eigen::Vector3d& p) {
    const double side = (p.head<2>() - fit.center).norm() - fit.radius_m;
    const double end = std::max(fit.low_m - p.z(), p.z() - fit.high_m);
    return std::max(side, end) > 0 ? std::hypot(std::max(side, 0.0), std::max(end, 0.0)) : std::max(side, end);
  };
  measureShape(samples, indices, tolerance_m, distance, fit.share, fit.rms_m, fit.largest_m);
  return fit;
}

FittedSphere fitSphere(const ScanSamples& samples, const std::vector<int>& indices, double tolerance_m) {
  FittedSphere fit;
  if (indices.size() < 30) return fit;
  Eigen::Matrix4d A = Eigen::Matrix4d::Zero();
  Eigen::Vector4d b = Eigen::Vector4d::Zero();
  const Eigen::Vector3d about = samples.at(indices[0]);
  for (int i : indices) {
    const Eigen::Vector3d p = samples.at(i) - about;
    const Eigen::Vector4d row(p.x(), p.y(), p.z(), 1);
    A += row * row.transpose();
    b += row * p.squaredNorm();
  }
  const Eigen::Vector4d solution = A.ldlt().solve(b);
  const Eigen::Vector3d center = 0.5 * solution.head<3>();
  fit.radius_m = std::sqrt(std::max(0.0, solution.w() + center.squaredNorm()));
  fit.center = center + about;
  measureShape(
      samples, indices, tolerance_m,
      [&fit](const Eigen::Vector3d& p) { return (p - fit.center).norm() - fit.radius_m; }, fit.share, fit.rms_m,
      fit.largest_m);
  return fit;
}

void addBox(const UprightBox& box, ScanThing& thing) {
  const int base = static_cast<int>(thing.vertices.size());
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner((i & 1 ? box.box.max() : box.box.min()).x(),
                                 (i & 2 ? box.box.max() : box.box.min()).y(),
                                 (i & 4 ? box.box.max() : box.box.min()).z());
    thing.vertices.push_back(box.toMap(corner));
    thing.bounds.extend(thing.vertices.back());
  }
  for (const auto& f : kBoxFaces) {
    thing.triangles.push_back({base + f[0], base + f[1], base + f[2]});
    thing.triangles.push_back({base + f[0], base + f[2], base + f[3]});
  }
}

void addCylinder(const UprightCylinder& c, ScanThing& thing) {
  const int base = static_cast<int>(thing.vertices.size());
  for (int k = 0; k < kSides; ++k) {
    const double angle = 2 * M_PI * k / kSides;
    const Eigen::Vector2d p = c.center + c.radius_m * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    thing.vertices.emplace_back(p.x(), p.y(), c.low_m);
    thing.vertices.emplace_back(p.x(), p.y(), c.high_m);
  }
  for (std::size_t k = thing.vertices.size() - 2 * kSides; k < thing.vertices.size(); ++k)
    thing.bounds.extend(thing.vertices[k]);
  for (int k = 0; k < kSides; ++k) {
    const int a = base + 2 * k, b = base + 2 * ((k + 1) % kSides);
    thing.triangles.push_back({a, b, b + 1});
    thing.triangles.push_back({a, b + 1, a + 1});
    if (k > 0 && k + 1 < kSides) {
      thing.triangles.push_back({base, b, a});
      thing.triangles.push_back({base + 1, a + 1, b + 1});
    }
  }
}

void addSphere(const FittedSphere& s, ScanThing& thing) {
  constexpr int kRings = 12;
  const int base = static_cast<int>(thing.vertices.size());
  for (int i = 1; i < kRings; ++i) {
    for (int k = 0; k < kSides; ++k) {
      const double t = M_PI * i / kRings, p = 2 * M_PI * k / kSides;
      thing.vertices.push_back(
          s.center + s.radius_m * Eigen::Vector3d(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)));
    }
  }
  thing.vertices.push_back(s.center + Eigen::Vector3d(0, 0, s.radius_m));
  thing.vertices.push_back(s.center - Eigen::Vector3d(0, 0, s.radius_m));
  thing.bounds.extend(Eigen::Vector3d(s.center.array() - s.radius_m));
  thing.bounds.extend(Eigen::Vector3d(s.center.array() + s.radius_m));
  const int north = base + (kRings - 1) * kSides, south = north + 1, last = north - kSides;
  for (int k = 0; k < kSides; ++k) {
    const int next = (k + 1) % kSides;
    for (int i = 0; i + 2 < kRings; ++i) {
      const int a = base + i * kSides;
      thing.triangles.push_back({a + k, a + kSides + k, a + kSides + next});
      thing.triangles.push_back({a + k, a + kSides + next, a + next});
    }
    thing.triangles.push_back({north, base + k, base + next});
    thing.triangles.push_back({south, last + next, last + k});
  }
}

}  // namespace mmradartwin
