#include "scan/planes/scan_frame.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "scan/planes/slanted_bounds.h"
#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

constexpr double kLeastFloor_m2 = 0.3;  // that a person stands on with both feet
constexpr double kNoUp = -100;          // score of an axis that no plane has as its normal

std::string number(double value, int digits = 2) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

/// What lies between the first and the last percent along each axis.
Eigen::Vector3d robustSizes(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sizes;
  std::vector<float> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < points.size(); ++i) values[i] = points[i][axis];
    const auto low = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 100);
    const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(values.size() / 100);
    std::nth_element(values.begin(), low, values.end());
    const double from = static_cast<double>(*low);
    std::nth_element(values.begin(), high, values.end());
    sizes[axis] = static_cast<double>(*high) - from;
  }
  return sizes;
}

struct NamedAxis {
  const char* name;
  Eigen::Vector3d axis;
  double prior;  ///< ln of how usual it is that a file's up is this axis, to the most usual one
};

std::vector<NamedAxis> axesOf(const RawScan& scan) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), z = Eigen::Vector3d::UnitZ();
  // Surveyors and robots write z up, phones and games y up; a depth camera looks along z with y down.
  if (scan.camera_axes)
    return {{"-y", -y, 0}, {"z", z, -6}, {"y", y, -6}, {"x", x, -6}, {"-z", -z, -6}, {"-x", -x, -6}};
  return {{"z", z, 0}, {"y", y, -0.5}, {"-y", -y, -2}, {"x", x, -3}, {"-z", -z, -3}, {"-x", -x, -3.5}};
}

/// Area of planes whose normal lies along an axis, or across it.
struct Alignment {
  double along_m2 = 0, across_m2 = 0;
};

Alignment alignmentWith(const std::vector<PlaneRegion>& regions, const Eigen::Vector3d& axis) {
  Alignment result;
  for (const PlaneRegion& r : regions) {
    const double cosine = std::abs(r.normal.dot(axis));
    if (cosine > std::cos(bounds::kCone_deg * bounds::kDegree)) result.along_m2 += r.area_m2;
    if (cosine < std::sin(bounds::kCone_deg * bounds::kDegree)) result.across_m2 += r.area_m2;
  }
  return result;
}

/// What of a scan tells which way is up.
struct UpSigns {
  const ScanSamples& samples;
  const std::vector<PlaneRegion>& regions;
  std::vector<int> furniture;  ///< samples that are on no plane as large as a wall's
};

UpSigns upSigns(const ScanSamples& samples, const std::vector<PlaneRegion>& regions) {
  UpSigns signs{samples, regions, {}};
  std::vector<char> on_shell(samples.size(), 0);
  for (const PlaneRegion& r : regions) {
    if (r.area_m2 < bounds::kShell_m2) continue;
    for (int i : r.samples) on_shell[static_cast<std::size_t>(i)] = 1;
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!on_shell[i]) signs.furniture.push_back(static_cast<int>(i));
  }
  return signs;
}

/// Lower and upper end along an axis, but for half a percent.
std::array<double, 2> endsAlong(const ScanSamples& samples, const Eigen::Vector3d& axis) {
  std::vector<float> along;
  for (const Eigen::Vector3f& p : samples.points) along.push_back(p.dot(axis.cast<float>()));
  const auto low = along.begin() + static_cast<std::ptrdiff_t>(along.size() / 200);
  std::nth_element(along.begin(), low, along.end());
  const double from = static_cast<double>(*low);
  const auto high = along.end() - 1 - static_cast<std::ptrdiff_t>(along.size() / 200);
  std::nth_element(along.begin(), high, along.end());
  return {from, static_cast<double>(*high)};
}

/// How well an axis fits as up, as the logarithm of a likelihood: most rooms are 2.2 to 3.6 m high and lower than wide
/// (one in six is no wider than high), furniture stands in their lower half, and its upper sides are what is seen of
/// it. The shares are those of rooms at large, and of no scan.
double scoreOfUp(const UpSigns& signs, const Eigen::Vector3d& axis) {
  const Alignment aligned = alignmentWith(signs.regions, axis);
  double all_m2 = 1e-9, up_m2 = 0, down_m2 = 0;
  for (const PlaneRegion& r : signs.regions) {
    all_m2 += r.area_m2;
    const double cosine = r.normal.dot(axis);
    if (r.area_m2 < bounds::kShell_m2 && std::abs(cosine) > std::cos(bounds::kCone_deg * bounds::kDegree))
      (cosine > 0 ? up_m2 : down_m2) += r.area_m2;
  }
  if (aligned.along_m2 < 0.05 * all_m2) return kNoUp;
  const auto [low, high] = endsAlong(signs.samples, axis);
  const double height_m = high - low;
  // Across: the smaller of two sizes at right angles.
  const Eigen::Vector3d u = axis.unitOrthogonal(), v = axis.cross(u);
  double narrowest_m = 1e9;
  for (const Eigen::Vector3d& side : {u, v}) {
    const auto [from, to] = endsAlong(signs.samples, side);
    narrowest_m = std::min(narrowest_m, to - from);
  }
  double score = 4 * (aligned.along_m2 + aligned.across_m2) / all_m2;
  if (height_m < 2.2 || height_m > 3.6) score -= 2.5;
  if (height_m < 1.9 || height_m > 5) score -= 1.5;
  if (narrowest_m < height_m) score -= 1.6;
  double lower = 0, upper = 0;
  for (int i : signs.furniture) {
    const double at = signs.samples.points[static_cast<std::size_t>(i)].cast<double>().dot(axis) - low;
    lower += at > 0.05 * height_m && at < 0.45 * height_m;
    upper += at > 0.55 * height_m && at < 0.95 * height_m;
  }
  // All furniture may stand at one wall, so that neither share is proof.
  score += std::clamp(2.5 * (lower - upper) / (lower + upper + 1), -1.5, 1.0);
  if (signs.samples.oriented) score += (up_m2 - down_m2) / (up_m2 + down_m2 + 0.3);
  return score;
}

Eigen::Vector3d findUp(const RawScan& scan, const ScanSamples& samples, const std::vector<PlaneRegion>& regions) {
  const UpSigns signs = upSigns(samples, regions);
  Eigen::Vector3d best = Eigen::Vector3d::UnitZ();
  double best_score = 2 * kNoUp;
  for (const NamedAxis& candidate : axesOf(scan)) {
    // The planes near the axis say where it is; without any it cannot be up.
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const PlaneRegion& r : regions) {
      const double cosine = r.normal.dot(candidate.axis);
      if (std::abs(cosine) > std::cos(25 * bounds::kDegree)) sum += (cosine > 0 ? 1 : -1) * r.area_m2 * r.normal;
    }
    if (sum.isZero()) continue;
    const Eigen::Vector3d axis = sum.normalized();
    const double score = candidate.prior + scoreOfUp(signs, axis);
    if (score > best_score) best_score = score, best = axis;
  }
  // Axes of the file that no plane follows: the sensor's own attitude at the start. Planes alone decide.
  if (best_score < kNoUp / 2) {
    for (std::size_t i = 0; i < std::min<std::size_t>(regions.size(), 8); ++i) {
      for (double sign : {1.0, -1.0}) {
        const Eigen::Vector3d axis = sign * regions[i].normal;
        const double score = scoreOfUp(signs, axis) + 0.2 * axis.z();
        if (score > best_score) best_score = score, best = axis;
      }
    }
  }
  return best;
}

struct Level {
  Eigen::Vector3d up;
  double std_rad = 0;
};

/// up that the level planes have as normal and the upright ones lie along, by their areas; what is off by more than
/// three of its standard deviations and half a degree is no plane of that kind.
Level levelBy(const std::vector<PlaneRegion>& regions, Eigen::Vector3d up) {
  double cone = bounds::kCone_deg * bounds::kDegree;
  Level level{up, 0};
  for (int round = 0; round < 6; ++round, cone = std::max(0.5 * cone, 0.6 * bounds::kDegree)) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    double weights = 0, squares = 0;
    for (const PlaneRegion& r : regions) {
      if (r.area_m2 < 0.3) continue;
      const double angle = std::acos(std::min(1.0, std::abs(r.normal.dot(level.up))));
      const bool level_plane = angle < M_PI / 4;
      const double off = level_plane ? angle : M_PI / 2 - angle;
      if (off > std::max(cone, 3 * r.angle_std_rad) || off > bounds::kCone_deg * bounds::kDegree) continue;
      const double weight = r.area_m2 / (std::pow(r.angle_std_rad, 2) + std::pow(0.1 * bounds::kDegree, 2));
      sum += (level_plane ? -weight : weight) * r.normal * r.normal.transpose();
      weights += weight;
      squares += weight * weight * (off * off + std::pow(r.angle_std_rad, 2));
    }
    if (weights == 0) break;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spectrum(sum);
    const Eigen::Vector3d found = spectrum.eigenvectors().col(0);
    level.up = found.dot(level.up) < 0 ? Eigen::Vector3d(-found) : found;
    level.std_rad = std::sqrt(squares) / weights;
  }
  return level;
}

bool isLevelTo(const PlaneRegion& r, const Eigen::Vector3d& up, double lean_deg = bounds::kLevel_deg) {
  return std::abs(r.normal.dot(up)) > std::cos(lean_deg * bounds::kDegree);
}

struct HorizontalLevel {
  double height_m, area_m2;
};

/// Heights of level planes, lowest first; those closer than bounds::kSameSurface_m are the larger one's.
std::vector<HorizontalLevel> levelsOf(const std::vector<PlaneRegion>& regions, const Eigen::Vector3d& up) {
  std::vector<HorizontalLevel> levels;
  for (const PlaneRegion& r : regions) {  // largest first
    if (!isLevelTo(r, up)) continue;
    const double height = r.middle.dot(up);
    const auto same = std::find_if(levels.begin(), levels.end(), [height](const HorizontalLevel& l) {
      return std::abs(l.height_m - height) < bounds::kSameSurface_m;
    });
    if (same == levels.end()) {
      levels.push_back({height, r.area_m2});
    } else {
      same->area_m2 += r.area_m2;
    }
  }
  std::sort(levels.begin(), levels.end(),
            [](const HorizontalLevel& a, const HorizontalLevel& b) { return a.height_m < b.height_m; });
  return levels;
}

double largestOf(const std::vector<HorizontalLevel>& levels) {
  double largest_m2 = 0;
  for (const HorizontalLevel& l : levels) largest_m2 = std::max(largest_m2, l.area_m2);
  return largest_m2;
}

double leastFloor_m2(const std::vector<HorizontalLevel>& levels) {
  return std::max(kLeastFloor_m2, bounds::kShareOfLargestLevel * largestOf(levels));
}

/// The lowest large one; null where there is none.
const HorizontalLevel* floorOf(const std::vector<HorizontalLevel>& levels) {
  const double least_m2 = leastFloor_m2(levels);
  const auto lowest =
      std::find_if(levels.begin(), levels.end(), [&](const HorizontalLevel& l) { return l.area_m2 > least_m2; });
  return lowest == levels.end() ? nullptr : &*lowest;
}

/// A depth camera sees a floor far away at a grazing angle, so that it may lean by some degrees. A large plane that is
/// about level, lies below all level ones, and has nothing of the scan behind it is the floor for all that: it becomes
/// level. Returns by how much it leant, degrees; 0 where there is none.
double levelLeaningFloor(const ScanSamples& samples, const Eigen::Vector3d& up, std::vector<PlaneRegion>& regions) {
  const std::vector<HorizontalLevel> levels = levelsOf(regions, up);
  const HorizontalLevel* level = floorOf(levels);
  const double least_m2 = leastFloor_m2(levels);
  PlaneRegion* lowest = nullptr;
  for (PlaneRegion& r : regions) {
    if (r.area_m2 < least_m2 || isLevelTo(r, up) || !isLevelTo(r, up, bounds::kCone_deg)) continue;
    const double height_m = r.middle.dot(up);
    if (level && height_m > level->height_m - bounds::kSameSurface_m) continue;
    PlaneRegion facing = r;
    if (facing.normal.dot(up) < 0) facing.normal *= -1, facing.offset_m *= -1;
    if (boundsRoom(samples, facing) && (!lowest || height_m < lowest->middle.dot(up))) lowest = &r;
  }
  if (!lowest) return 0;
  const PlaneRegion floor = *lowest;
  for (PlaneRegion& r : regions) {
    const bool is_part = std::abs(floor.distance(r.middle)) < bounds::kSameSurface_m;
    if (!is_part || !isLevelTo(r, up, bounds::kCone_deg)) continue;
    r.normal = r.normal.dot(up) < 0 ? Eigen::Vector3d(-up) : up;
    r.offset_m = r.normal.dot(r.middle);
    measurePlane(samples, r);
  }
  return std::acos(std::min(1.0, std::abs(floor.normal.dot(up)))) / bounds::kDegree;
}

/// True where a mesh is wound so that its floor faces down: another hand's triangles.
bool isInsideOut(const std::vector<PlaneRegion>& regions, const Eigen::Vector3d& up, double floor_m) {
  double faces_up = 0;
  for (const PlaneRegion& r : regions) {
    const double cosine = r.normal.dot(up);
    const bool on_floor = std::abs(r.middle.dot(up) - floor_m) < bounds::kSameSurface_m;
    if (on_floor && isLevelTo(r, up)) faces_up += cosine * r.area_m2;
  }
  return faces_up < 0;
}

/// Mean height of all points of level planes near a height, twice, the second time without what lies off.
double heightOf(const ScanSamples& samples, const std::vector<PlaneRegion>& regions, const Eigen::Vector3d& up,
                double height_m) {
  const Eigen::Vector3f axis = up.cast<float>();
  for (int round = 0; round < 2; ++round) {
    double sum = 0;
    std::size_t count = 0;
    for (const PlaneRegion& r : regions) {
      const double tolerance_m = planeTolerance(samples, r);
      if (!isLevelTo(r, up) || std::abs(r.middle.dot(up) - height_m) > tolerance_m) continue;
      for (int i : r.samples) {
        const auto s = static_cast<std::size_t>(i);
        for (std::size_t k = samples.dense_first[s]; k < samples.dense_first[s + 1]; ++k) {
          const auto along = static_cast<double>(axis.dot(samples.dense[k]));
          if (std::abs(along - height_m) < 2 * tolerance_m) sum += along, ++count;
        }
      }
    }
    if (count) height_m = sum / static_cast<double>(count);
  }
  return height_m;
}

/// The turn that makes a named axis of a file z and is nothing but an exchange of axes.
Eigen::Matrix3d exchangeOfAxes(const std::string& up) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  if (up == "y") R << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == "-y") R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // a camera's z is x, forward
  if (up == "-z") R << 1, 0, 0, 0, -1, 0, 0, 0, -1;
  if (up == "x") R << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  if (up == "-x") R << 0, -1, 0, 0, 0, 1, -1, 0, 0;
  return R;
}

std::string wordsOf(const ScanFrame& frame) {
  std::string words = frame.unit_name == "mm" ? "millimetres" : frame.unit_name == "cm" ? "centimetres" : "metres";
  if (frame.unit_name.empty()) words = number(frame.unit_m, 4) + " m a unit";
  words += ", " + frame.up_name + " up";
  if (frame.tilt_deg > 0.05) words += " but for a tilt of " + number(frame.tilt_deg, 1) + " deg";
  words += ", floor ";
  if (std::abs(frame.floor_m) < 0.005) {
    words += "at the origin";
  } else {
    words += number(std::abs(frame.floor_m)) + " m " + (frame.floor_m < 0 ? "below" : "above") + " the origin";
  }
  if (frame.floor_leans_deg > 0) words += " (it leans by " + number(frame.floor_leans_deg, 1) + " deg in the scan)";
  words += frame.has_ceiling ? ", ceiling at " + number(frame.ceiling_m) + " m" : ", no ceiling";
  return words + ", noise " + number(1e3 * frame.noise_m, 1) + " mm";
}

}  // namespace

double unitOfScan(const RawScan& scan) {
  if (scan.metres) return 1;
  const Eigen::Vector3d sizes = robustSizes(scan.points);
  for (double unit : {1.0, 0.001, 0.01}) {
    const double smallest = unit * sizes.minCoeff();
    if (smallest > bounds::kRoom_m[0] && smallest < bounds::kRoom_m[1] && unit * sizes.maxCoeff() < bounds::kWidest_m)
      return unit;
  }
  // A part of a room, of one plane perhaps: by its largest size.
  for (double unit : {1.0, 0.001, 0.01}) {
    const double largest = unit * sizes.maxCoeff();
    if (largest > 1.5 && largest < 30) return unit;
  }
  throw InputError(scan.file + ": is " + number(sizes.x()) + " by " + number(sizes.y()) + " by " + number(sizes.z()) +
                   " units wide, which is no room in m, cm or mm; cut it to the room, or state --unit");
}

ScanFrame bringIntoMap(const RawScan& scan, const ScanOptions& options, double unit_m, ScanSamples& samples,
                       std::vector<PlaneRegion>& regions) {
  ScanFrame frame;
  frame.unit_m = unit_m;
  frame.unit_name = unit_m == 1 ? "m" : unit_m == 0.01 ? "cm" : unit_m == 0.001 ? "mm" : "";
  frame.spacing_m = samples.spacing_m;
  frame.noise_m = samples.noise_m;
  Level level{options.up ? options.up->normalized() : findUp(scan, samples, regions), 0};
  if (options.level) level = levelBy(regions, level.up);
  frame.up = level.up;
  frame.tilt_std_deg = level.std_rad / bounds::kDegree;
  const Alignment aligned = alignmentWith(regions, frame.up);
  if (aligned.across_m2 < 1) {
    throw InputError(scan.file + ": shows " +
                     (aligned.along_m2 > 1 ? "one level surface and nothing upright" : "no flat surface") +
                     ", so that it is no room; scan the walls, too");
  }
  double nearest = -1;
  Eigen::Vector3d axis = frame.up;
  for (const NamedAxis& candidate : axesOf(scan)) {
    const double cosine = candidate.axis.dot(frame.up);
    if (cosine > nearest) nearest = cosine, frame.up_name = candidate.name, axis = candidate.axis;
  }
  frame.tilt_deg = std::acos(std::min(1.0, nearest)) / bounds::kDegree;
  const Eigen::Matrix3d exchange = exchangeOfAxes(frame.up_name);
  const Eigen::Matrix3d R =
      Eigen::Quaterniond::FromTwoVectors(exchange * frame.up, Eigen::Vector3d::UnitZ()).toRotationMatrix() * exchange;

  if (!options.floor_m) frame.floor_leans_deg = levelLeaningFloor(samples, frame.up, regions);
  const std::vector<HorizontalLevel> levels = levelsOf(regions, frame.up);
  const double largest_m2 = largestOf(levels);
  const Eigen::Vector3d offset = unit_m * scan.offset;
  double floor = 0;
  if (options.floor_m) {
    floor = *options.floor_m - axis.dot(offset);
  } else {
    const HorizontalLevel* lowest = floorOf(levels);
    if (!lowest) {
      throw InputError(scan.file + ": shows no floor; say where it is by --floor, and which way is up by --up");
    }
    floor = lowest->height_m;
  }
  for (const HorizontalLevel& l : levels) {
    if (l.area_m2 > bounds::kShareOfLargestLevel * largest_m2 && l.height_m > floor + bounds::kLeastCeiling_m) {
      frame.has_ceiling = true;
      frame.ceiling_m = l.height_m - floor;
    }
  }
  if (!options.floor_m) floor = heightOf(samples, regions, frame.up, floor);
  if (frame.has_ceiling) frame.ceiling_m = heightOf(samples, regions, frame.up, floor + frame.ceiling_m) - floor;
  frame.floor_m = floor + axis.dot(offset);
  if (samples.oriented && isInsideOut(regions, frame.up, floor)) {
    for (Eigen::Vector3f& n : samples.normals) n *= -1;
    for (PlaneRegion& r : regions) r.normal *= -1, r.offset_m *= -1;
  }
  frame.origin_m = R * offset;
  const Eigen::Vector3d shift(0, 0, -floor);
  frame.T_map_file.linear() = R;
  frame.T_map_file.translation() = shift - R * offset;
  frame.words = wordsOf(frame);

  const Eigen::Matrix3f Rf = R.cast<float>();
  const Eigen::Vector3f shift_f = shift.cast<float>();
  for (Eigen::Vector3f& p : samples.points) p = Rf * p + shift_f;
  for (Eigen::Vector3f& p : samples.dense) p = Rf * p + shift_f;
  for (Eigen::Vector3f& n : samples.normals) n = Rf * n;
  for (Eigen::Vector3f& e : samples.error_m) e = Rf * e;
  for (PlaneRegion& r : regions) {
    r.normal = R * r.normal;
    r.middle = R * r.middle + shift;
    r.offset_m += r.normal.dot(shift);
  }
  return frame;
}

}  // namespace mmradartwin
