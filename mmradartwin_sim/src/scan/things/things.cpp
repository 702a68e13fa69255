#include "scan/things/things.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "scan/samples/cell_raster.h"
#include "scan/things/thing_mesh.h"
#include "scan/things/thing_shapes.h"

namespace mmradartwin {
namespace {

constexpr double kTouching_voxels = 2.6, kTouching_m = 0.052;  // neighbours on one surface, whatever the thinning
constexpr double kLeastThing_m2 = 0.06;                        // of surface: two hands
// A thing of no sure class has to be larger than a chair's back: what is smaller nobody could name, or give a material.
constexpr double kLeastUnsure_m2 = 0.25, kSure = 0.5;
constexpr double kPlate_m2 = 0.5;     // of an upright plate that is a part by itself: half of a door's leaf and more
constexpr double kThickest_m = 0.25;  // of a plate that has two faces: an inner wall
constexpr double kUpright = 0.1;      // cosine between an upright plate's normal and up
constexpr double kGap_m = 0.01;       // bodies end so far from what they stand on, so that no faces coincide
constexpr double kThinnest_m = 0.01;
constexpr double kTop_m[2] = {0.25, 1.25};  // heights of table tops
constexpr double kLowTable_m = 0.58;        // lower tops may be seats
constexpr double kSlab_m = 0.05;            // thickness of a top, at most

/// A level plate over free space.
struct TableTop {
  double height_m;
  CellRaster footprint{kSlab_m};
  std::vector<int> samples;
  UprightBox rim;  ///< its rectangle
};

struct Part {
  std::vector<int> samples;
  int top = -1;  ///< a table: index of its top
  int stands_on = -1;
};

/// Of a cluster of no known class: may be cut at its upright plates, is such a plate, or is what that left.
enum class Cut { kMayBe, kPlate, kRest };

class ThingFinder {
 public:
  ThingFinder(const RawScan& scan, const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
              const std::vector<PlaneRegion>& regions, const RoomPlanes& room)
      : scan_(scan),
        frame_(frame),
        options_(options),
        samples_(samples),
        regions_(regions),
        room_(room),
        tolerance_m_(planeTolerance(samples)) {}

  Things run() {
    region_of_.assign(samples_.size(), -1);
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      for (int i : regions_[r].samples) region_of_[static_cast<std::size_t>(i)] = static_cast<int>(r);
    }
    findFree();
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const int owner = room_.owner[i];
      if (owner < 0 || room_.planes[static_cast<std::size_t>(owner)].kind != PlaneKind::kFloor) continue;
      floor_.set(samples_.points[i].head<2>().cast<double>());
    }
    findTops();
    for (const Part& part : parts()) addThing(part, Cut::kMayBe);
    nameThings();
    return std::move(result_);
  }

 private:
  Eigen::Vector3d at(int i) const { return samples_.points[static_cast<std::size_t>(i)].cast<double>(); }

  /// What neither lies on a plane, nor next to one where corners are rounded and noise is worst, nor outside.
  void findFree() {
    free_.assign(samples_.size(), 0);
    std::vector<std::vector<Eigen::Vector2d>> floors;
    const ScanPlane* floor = nullptr;
    for (const ScanPlane& p : room_.planes) {
      if (p.kind == PlaneKind::kFloor) floors.push_back(p.outline), floor = &p;
    }
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (room_.owner[i] != -1) continue;
      const Eigen::Vector3d p = at(static_cast<int>(i));
      bool inside = p.z() > -tolerance_m_ && p.z() < room_.height_m + tolerance_m_;
      if (inside && floor) {
        const Eigen::Vector2d q(floor->u.dot(p), floor->v.dot(p));
        inside = std::any_of(floors.begin(), floors.end(), [&q](const auto& loop) { return holds(loop, q); });
      }
      if (inside) free_[i] = !nearPlane(p) || isOnLargePlate(static_cast<int>(i));
    }
  }

  static bool holds(const std::vector<Eigen::Vector2d>& loop, const Eigen::Vector2d& p) {
    bool inside = false;
    for (std::size_t i = 0, k = loop.size() - 1; i < loop.size(); k = i++) {
      const Eigen::Vector2d &a = loop[i], &b = loop[k];
      if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x())
        inside = !inside;
    }
    return inside;
  }

  bool nearPlane(const Eigen::Vector3d& p) const {
    const double reach_m = std::max(1.5 * tolerance_m_, 0.02);
    int corner = 0;  // planes within the reach of rounding
    for (const ScanPlane& plane : room_.planes) {
      const double d = std::abs(plane.normal.dot(p) - plane.offset_m);
      if (d > 3 * reach_m) continue;
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& q : plane.outline) box.extend(q);
      const Eigen::Vector2d q(plane.u.dot(p), plane.v.dot(p));
      if (box.exteriorDistance(q) > reach_m) continue;
      if (d < reach_m) return true;
      ++corner;
    }
    return corner > 1;
  }

  /// A carpet or a board is a flat part of its own, however near it lies to the plane behind it.
  bool isOnLargePlate(int i) const {
    const int r = region_of_[static_cast<std::size_t>(i)];
    return r >= 0 && regions_[static_cast<std::size_t>(r)].area_m2 > 0.3;
  }

  /// Level flat parts at a table's height under which there is more room than surface.
  void findTops() {
    top_of_.assign(samples_.size(), -1);
    for (const PlaneRegion& r : regions_) {
      if (std::abs(r.normal.z()) < 0.9999 || r.area_m2 < 0.15 || r.middle.z() < kTop_m[0] || r.middle.z() > kTop_m[1])
        continue;
      if (samples_.oriented && r.normal.z() < 0) continue;
      std::size_t free = 0;
      for (int i : r.samples) free += free_[static_cast<std::size_t>(i)] != 0;
      if (2 * free < r.samples.size() || isSeat(r) || !hollowBelow(r)) continue;
      TableTop top{r.middle.z(),
                   CellRaster(kSlab_m),
                   {},
                   fitBox(samples_, r.samples, {room_.yaw_rad, yawIn(r.samples)}, tolerance_m_)};
      for (int i : r.samples) {
        const Eigen::Vector2d p = at(i).head<2>();
        for (int dx = -1; dx <= 1; ++dx) {
          for (int dy = -1; dy <= 1; ++dy) top.footprint.set(p + kSlab_m * Eigen::Vector2d(dx, dy));
        }
      }
      const int id = static_cast<int>(tops_.size());
      for (std::size_t i = 0; i < samples_.size(); ++i) {
        const Eigen::Vector3d p = at(static_cast<int>(i));
        if (!free_[i] || top_of_[i] >= 0 || p.z() > top.height_m + std::max(tolerance_m_, 0.02) ||
            p.z() < top.height_m - 0.06)
          continue;
        if (!covers(top, p) && !isWithinRim(top, p)) continue;
        top_of_[i] = id;
        top.samples.push_back(static_cast<int>(i));
      }
      if (static_cast<double>(top.samples.size()) * samples_.area_m2() > 0.1) {
        tops_.push_back(std::move(top));
      } else {
        for (int i : top.samples) top_of_[static_cast<std::size_t>(i)] = -1;
      }
    }
  }

  /// A low top with a back over its rim, or no larger than a seat.
  bool isSeat(const PlaneRegion& r) const {
    if (r.middle.z() > kLowTable_m) return false;
    if (r.area_m2 < 0.3) return true;
    CellRaster footprint(kSlab_m);
    for (int i : r.samples) {
      for (int dx = -2; dx <= 2; ++dx) {
        for (int dy = -2; dy <= 2; ++dy) footprint.set(at(i).head<2>() + kSlab_m * Eigen::Vector2d(dx, dy));
      }
    }
    std::size_t above = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Eigen::Vector3f& p = samples_.points[i];
      if (!free_[i] || static_cast<double>(p.z()) < r.middle.z() + 0.1 || p.z() > 1.4F) continue;
      above += footprint.has(footprint.index(static_cast<double>(p.x())), footprint.index(static_cast<double>(p.y())));
    }
    return above > r.samples.size() / 10;
  }

  static bool covers(const TableTop& top, const Eigen::Vector3d& p) {
    return top.footprint.has(top.footprint.index(p.x()), top.footprint.index(p.y()));
  }

  /// Things on a table hide parts of its top.
  static bool isWithinRim(const TableTop& top, const Eigen::Vector3d& p) {
    const Eigen::Vector3d q = top.rim.toBox(p);
    const Eigen::Vector2d outside = (top.rim.box.min() - q).cwiseMax(q - top.rim.box.max()).head<2>();
    return outside.maxCoeff() < 0.03;
  }

  /// A table's rim has little surface below it; a cabinet's has its sides, of which a scan sees two at least.
  bool hollowBelow(const PlaneRegion& top) const {
    const UprightBox rim = fitBox(samples_, top.samples, {room_.yaw_rad, yawIn(top.samples)}, tolerance_m_);
    const double high = top.middle.z() - 0.1, low = std::min(0.1, 0.3 * high);
    CellRaster sides(kSlab_m);
    const Eigen::Vector3d sizes = rim.box.sizes();
    if (std::min(sizes.x(), sizes.y()) < 0.3) return false;  // a back's upper side, a sill
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (!free_[i]) continue;
      const Eigen::Vector3d p = rim.toBox(at(static_cast<int>(i)));
      if (p.z() < low || p.z() > high) continue;
      const Eigen::Vector2d to_low = (p - rim.box.min()).head<2>(), to_high = (rim.box.max() - p).head<2>();
      const double inside = std::min(to_low.minCoeff(), to_high.minCoeff());
      if (inside < -0.06 || inside > 0.06) continue;
      // The rim unrolled.
      const bool along_x =
          std::min(std::abs(to_low.y()), std::abs(to_high.y())) < std::min(std::abs(to_low.x()), std::abs(to_high.x()));
      const double upper = along_x ? (to_high.y() < to_low.y() ? 100 : 0) : (to_high.x() < to_low.x() ? 300 : 200);
      sides.set({upper + (along_x ? p.x() - rim.box.min().x() : p.y() - rim.box.min().y()), p.z()});
    }
    const double around = 2 * (sizes.x() + sizes.y()) * (high - low);
    return sides.area_m2() < 0.33 * around;
  }

  /// Connected parts, with tables cut off.
  std::vector<Part> parts() {
    std::vector<Part> tables(tops_.size()), others;
    for (std::size_t t = 0; t < tops_.size(); ++t)
      tables[t].samples = tops_[t].samples, tables[t].top = static_cast<int>(t);
    const auto touching_m = static_cast<float>(std::min(kTouching_voxels * samples_.spacing_m, kTouching_m));
    std::vector<char> seen(samples_.size(), 0);
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      if (!free_[s] || seen[s] || top_of_[s] >= 0) continue;
      std::vector<int> queue = {static_cast<int>(s)};
      seen[s] = 1;
      for (std::size_t q = 0; q < queue.size(); ++q) {
        const auto i = static_cast<std::size_t>(queue[q]);
        for (std::size_t k = samples_.first[i]; k < samples_.first[i + 1]; ++k) {
          const auto j = static_cast<std::size_t>(samples_.neighbour[k]);
          if (seen[j] || !free_[j] || top_of_[j] >= 0) continue;
          if ((samples_.points[i] - samples_.points[j]).squaredNorm() > touching_m * touching_m) continue;
          seen[j] = 1;
          queue.push_back(static_cast<int>(j));
        }
      }
      std::sort(queue.begin(), queue.end());
      Part part{std::move(queue), -1, -1};
      place(part, tables, others);
    }
    tables.insert(tables.end(), others.begin(), others.end());
    return tables;
  }

  /// Below a table: a part of it. Above: on it.
  void place(Part& part, std::vector<Part>& tables, std::vector<Part>& others) {
    Eigen::AlignedBox3d box;
    for (int i : part.samples) box.extend(at(i));
    for (std::size_t t = 0; t < tops_.size(); ++t) {
      std::size_t covered = 0;
      for (int i : part.samples) covered += covers(tops_[t], at(i));
      if (2 * covered < part.samples.size()) continue;
      if (box.max().z() < tops_[t].height_m + tolerance_m_) {
        tables[t].samples.insert(tables[t].samples.end(), part.samples.begin(), part.samples.end());
        return;
      }
      if (box.min().z() > tops_[t].height_m - kSlab_m && box.min().z() < tops_[t].height_m + 0.12)
        part.stands_on = static_cast<int>(t);
    }
    if (static_cast<double>(part.samples.size()) * samples_.area_m2() < kLeastThing_m2) {
      result_.crumbs += part.samples.size();
      return;
    }
    others.push_back(std::move(part));
  }

  /// Direction of the largest upright flat part, which is regularised already; else of the normals.
  double yawIn(const std::vector<int>& indices) const {
    std::map<int, std::size_t> counts;
    double sum_sin = 0, sum_cos = 0;
    for (int i : indices) {
      const int r = region_of_[static_cast<std::size_t>(i)];
      const Eigen::Vector3f& n = samples_.normals[static_cast<std::size_t>(i)];
      if (std::abs(n.z()) > 0.3F) continue;
      const double angle = 4 * std::atan2(static_cast<double>(n.y()), static_cast<double>(n.x()));
      sum_sin += std::sin(angle), sum_cos += std::cos(angle);
      if (r >= 0 && std::abs(regions_[static_cast<std::size_t>(r)].normal.z()) < 0.1) ++counts[r];
    }
    int largest = -1;
    for (const auto& [r, count] : counts) {
      if (count > 40 && (largest < 0 || count > counts[largest])) largest = r;
    }
    if (largest >= 0) {
      const Eigen::Vector3d& n = regions_[static_cast<std::size_t>(largest)].normal;
      return std::atan2(n.y(), n.x());
    }
    return std::hypot(sum_sin, sum_cos) > 0 ? 0.25 * std::atan2(sum_sin, sum_cos) : room_.yaw_rad;
  }

  /// A turned box is the room's where no flat part says by how much it is turned.
  std::vector<double> yawsFor(const std::vector<int>& indices) const {
    const double own = yawIn(indices);
    const double off = own - room_.yaw_rad - M_PI / 2 * std::round((own - room_.yaw_rad) / (M_PI / 2));
    if (std::abs(off) < 1e-6) return {room_.yaw_rad};
    return {room_.yaw_rad, own};
  }

  double distanceToWall(const UprightBox& box, bool& along) const {
    double nearest = 100;
    for (const ScanPlane& plane : room_.planes) {
      if (plane.kind != PlaneKind::kWall) continue;
      double low = 1e9, high = -1e9;
      Eigen::AlignedBox1d span;
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector3d p =
            box.toMap({(i & 1 ? box.box.max() : box.box.min()).x(), (i & 2 ? box.box.max() : box.box.min()).y(), 0});
        const double d = plane.normal.dot(p) - plane.offset_m;
        low = std::min(low, d), high = std::max(high, d);
        span.extend(Eigen::Matrix<double, 1, 1>(plane.u.dot(p)));
      }
      Eigen::AlignedBox1d wall;
      for (const Eigen::Vector2d& q : plane.outline) wall.extend(Eigen::Matrix<double, 1, 1>(q.x()));
      if (!span.intersects(wall) || std::abs(low) > nearest || high < -0.05) continue;
      nearest = std::abs(low);
      along = high - low < 0.5 * span.sizes()[0];
    }
    return nearest;
  }

  /// Ends a box short of floor, ceiling and the walls that it touches, and gives it a thickness.
  void clear(UprightBox& box, bool on_wall) const {
    Eigen::Vector3d &low = box.box.min(), &high = box.box.max();
    if (low.z() < 0.06) low.z() = kGap_m;
    if (high.z() > room_.height_m - 0.06) high.z() = room_.height_m - kGap_m;
    for (const ScanPlane& plane : room_.planes) {
      if (plane.kind != PlaneKind::kWall) continue;
      const Eigen::Vector3d n = box.toBox(plane.normal);
      for (int axis = 0; axis < 2; ++axis) {
        if (std::abs(n[axis]) < 0.9999) continue;
        // The wall as a limit of this axis; only where the box reaches it.
        const double wall = plane.offset_m / n[axis] + kGap_m * n[axis];
        double& end = n[axis] > 0 ? low[axis] : high[axis];
        const double other = n[axis] > 0 ? high[axis] : low[axis];
        const double behind = n[axis] > 0 ? wall - end : end - wall;
        const double depth = std::abs(other - end);
        const bool reaches = on_wall && depth < 0.06 && behind > -0.2 && depth < box.box.sizes()[1 - axis];
        if ((behind > 0 && behind < 0.1) || reaches) end = wall;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (high[axis] - low[axis] < kThinnest_m) {
        const double middle = 0.5 * (high[axis] + low[axis]);
        low[axis] = middle - kThinnest_m / 2, high[axis] = middle + kThinnest_m / 2;
      }
    }
  }

  double seatBelow(const std::vector<int>& indices, double top_m) const {
    std::map<int, std::size_t> counts;
    for (int i : indices) {
      const int r = region_of_[static_cast<std::size_t>(i)];
      if (r >= 0 && std::abs(regions_[static_cast<std::size_t>(r)].normal.z()) > 0.95) ++counts[r];
    }
    double height = 0;
    std::size_t most = static_cast<std::size_t>(0.05 / samples_.area_m2());
    for (const auto& [r, count] : counts) {
      const double z = regions_[static_cast<std::size_t>(r)].middle.z();
      if (count > most && z < top_m - 0.1) most = count, height = z;
    }
    return height;
  }

  void addThing(const Part& part, Cut cut) {
    ScanThing thing;
    thing.samples = part.samples.size();
    const double tolerance = std::max(tolerance_m_, 0.015);
    UprightBox box = fitBox(samples_, part.samples, yawsFor(part.samples), tolerance);
    const UprightCylinder cylinder = fitCylinder(samples_, part.samples, tolerance);
    const FittedSphere sphere = fitSphere(samples_, part.samples, tolerance);
    bool along = false;
    ThingSigns signs{};
    const Eigen::Vector3d sizes = box.box.sizes();
    signs.length_m = std::max(sizes.x(), sizes.y()), signs.width_m = std::min(sizes.x(), sizes.y());
    signs.low_m = box.box.min().z(), signs.high_m = box.box.max().z();
    signs.room_m = room_.height_m;
    signs.wall_m = distanceToWall(box, along);
    signs.flat_on_wall = along && signs.wall_m < 0.2;
    signs.box_share = box.share;
    signs.seat_m = seatBelow(part.samples, signs.high_m);
    signs.round = cylinder.share > box.share;
    signs.on_table = part.stands_on >= 0;
    signs.table_top = part.top >= 0;
    const BoxEvidence evidence = evidenceOf(samples_, part.samples, box, tolerance);
    signs.upright_share = uprightShare(part.samples);
    signs.is_box = box.share > 0.7 && (evidence.covered > 0.5 || floorBelow(box) < 0.4) && evidence.covered > 0.25 &&
                   evidence.inward < 0.25;
    ClassGuess guess = classOf(signs);
    if (cut == Cut::kPlate && guess.klass == "unknown") guess = {"partition", 0.6, "an upright plate that stands free"};
    if (guess.klass == "unknown" && !signs.is_box && cut == Cut::kMayBe && cutAtPlates(part)) return;
    if (guess.confidence < kSure && static_cast<double>(part.samples.size()) * samples_.area_m2() < kLeastUnsure_m2) {
      result_.scraps += part.samples.size();
      return;
    }
    thing.klass = guess.klass, thing.class_confidence = guess.confidence, thing.why = guess.why;
    thing.watertight = true;
    const bool boxes = options_.things == ThingForms::kBoxes;
    if (options_.things == ThingForms::kMeshes && addMesh(scan_, samples_, frame_, options_, part.samples, thing)) {
      // The scan's own surface.
    } else if (part.top >= 0) {
      addTable(part, thing);
    } else if (!boxes && sphere.share > 0.85 && sphere.share > box.share + 0.1 && sphere.radius_m < 0.6) {
      thing.shape = ThingShape::kSphere;
      thing.rms_m = sphere.rms_m, thing.largest_m = sphere.largest_m;
      addSphere(sphere, thing);
    } else if (cylinder.share > 0.8 && cylinder.share > box.share + 0.05 && cylinder.radius_m < 0.8) {
      thing.shape = ThingShape::kCylinder;
      thing.rms_m = cylinder.rms_m, thing.largest_m = cylinder.largest_m;
      UprightCylinder standing = cylinder;
      if (standing.low_m < 0.06) standing.low_m = kGap_m;
      addCylinder(standing, thing);
    } else if (signs.is_box || boxes || sizes.minCoeff() < 0.06 ||
               !addPlatesOrMesh(part.samples, cut == Cut::kPlate ? 0.3 : 0.6, thing)) {
      thing.shape = sizes.minCoeff() < 0.04 ? ThingShape::kPlate : ThingShape::kBox;
      thing.rms_m = box.rms_m, thing.largest_m = box.largest_m;
      clear(box, signs.flat_on_wall);
      addBox(box, thing);
    }
    result_.things.push_back(std::move(thing));
    result_.samples.push_back(part.samples);
  }

  /// Partitions and parts of walls tie what leans on them to one cluster, as tables tie what stands on them. Each such
  /// plate with its back becomes a part of its own, and so does what then hangs together. False where there is none.
  bool cutAtPlates(const Part& part) {
    std::map<int, std::vector<int>> flat;
    for (int i : part.samples) {
      const int r = region_of_[static_cast<std::size_t>(i)];
      if (r >= 0 && std::abs(regions_[static_cast<std::size_t>(r)].normal.z()) < kUpright) flat[r].push_back(i);
    }
    std::vector<Part> plates;
    std::map<int, char> taken;
    for (const auto& [r, own] : flat) {  // regions come largest first
      if (static_cast<double>(own.size()) * samples_.area_m2() < kPlate_m2 || taken.count(own.front())) continue;
      const PlaneRegion& front = regions_[static_cast<std::size_t>(r)];
      const Plate plate = plateOf(samples_, own, front.normal, front.offset_m, kThinnest_m);
      Part cut{{}, -1, -1};
      for (int i : part.samples) {
        if (taken.count(i)) continue;
        const Eigen::Vector3d from = at(i) - plate.corner;
        const double a = from.dot(plate.e1) / plate.e1.squaredNorm(), b = from.dot(plate.e2) / plate.e2.squaredNorm();
        const double d = front.distance(at(i));
        const bool within = a > -0.05 && a < 1.05 && b > -0.05 && b < 1.05;
        // Its back, which faces the other way, and its edges are of it, too.
        if (region_of_[static_cast<std::size_t>(i)] == r || (within && d < tolerance_m_ && d > -kThickest_m))
          cut.samples.push_back(i);
      }
      for (int i : cut.samples) taken[i] = 1;
      plates.push_back(std::move(cut));
    }
    if (plates.empty()) return false;
    std::vector<int> rest;
    for (int i : part.samples) {
      if (!taken.count(i)) rest.push_back(i);
    }
    for (const Part& plate : plates) addThing(plate, Cut::kPlate);
    for (std::vector<int>& own : connected(rest)) {
      std::sort(own.begin(), own.end());
      if (static_cast<double>(own.size()) * samples_.area_m2() < kLeastThing_m2) {
        result_.crumbs += own.size();
      } else {
        addThing({std::move(own), -1, part.stands_on}, Cut::kRest);
      }
    }
    return true;
  }

  /// Share of a box's footprint, its rim left out, where the scan has the floor: a body hides it.
  double floorBelow(const UprightBox& box) const {
    const Eigen::Vector3d low = box.box.min(), high = box.box.max();
    std::size_t seen = 0, all = 0;
    for (double x = low.x() + 0.1; x < high.x() - 0.1; x += 0.05) {
      for (double y = low.y() + 0.1; y < high.y() - 0.1; y += 0.05) {
        const Eigen::Vector3d p = box.toMap({x, y, 0});
        ++all;
        seen += floor_.has(floor_.index(p.x()), floor_.index(p.y()));
      }
    }
    return all && low.z() < 0.3 ? static_cast<double>(seen) / static_cast<double>(all) : 0;
  }

  double uprightShare(const std::vector<int>& indices) const {
    std::size_t upright = 0;
    for (int i : indices) upright += std::abs(samples_.normals[static_cast<std::size_t>(i)].z()) < 0.3F;
    return static_cast<double>(upright) / static_cast<double>(indices.size());
  }

  /// No box: its flat parts as plates where they are a share of it, else its own surface with fewer triangles. False
  /// where neither can be made.
  bool addPlatesOrMesh(const std::vector<int>& indices, double least_share, ScanThing& thing) const {
    std::map<int, std::vector<int>> flat;
    for (int i : indices) {
      const int r = region_of_[static_cast<std::size_t>(i)];
      if (r >= 0) flat[r].push_back(i);
    }
    std::size_t on_plates = 0;
    for (auto r = flat.begin(); r != flat.end();) {
      const bool large = static_cast<double>(r->second.size()) * samples_.area_m2() > 0.04;
      if (large) on_plates += r->second.size();
      r = large ? std::next(r) : flat.erase(r);
    }
    if (static_cast<double>(on_plates) < least_share * static_cast<double>(indices.size()))
      return addMesh(scan_, samples_, frame_, options_, indices, thing);
    thing.shape = ThingShape::kPlate;
    double squares = 0;
    for (const auto& [r, own] : flat) {
      const PlaneRegion& region = regions_[static_cast<std::size_t>(r)];
      squares += region.rms_m * region.rms_m * static_cast<double>(own.size());
      if (isBackOfOther(r, flat)) continue;
      Plate plate = plateOf(samples_, own, region.normal, region.offset_m, kThinnest_m);
      // Plates that meet at an edge end short of each other.
      const Eigen::Vector3d d1 = plate.e1.normalized(), d2 = plate.e2.normalized();
      plate.corner += kGap_m * (d1 + d2);
      plate.e1 -= 2 * kGap_m * d1, plate.e2 -= 2 * kGap_m * d2;
      if (plate.e1.dot(d1) > 0.03 && plate.e2.dot(d2) > 0.03) addPlate(plate, thing);
    }
    thing.rms_m = std::sqrt(squares / static_cast<double>(on_plates));
    thing.largest_m = tolerance_m_;
    return !thing.triangles.empty();
  }

  /// The other side of a plate that has its first side already.
  bool isBackOfOther(int r, const std::map<int, std::vector<int>>& flat) const {
    const PlaneRegion& back = regions_[static_cast<std::size_t>(r)];
    return std::any_of(flat.begin(), flat.end(), [&](const auto& other) {
      if (other.first >= r) return false;  // regions come largest first
      const PlaneRegion& front = regions_[static_cast<std::size_t>(other.first)];
      if (front.normal.dot(back.normal) > -0.98 || std::abs(front.distance(back.middle)) > 0.08) return false;
      const Plate plate = plateOf(samples_, other.second, front.normal, front.offset_m, kThinnest_m);
      const Eigen::Vector3d from = back.middle - plate.corner;
      const double a = from.dot(plate.e1) / plate.e1.squaredNorm(), b = from.dot(plate.e2) / plate.e2.squaredNorm();
      return a > 0 && a < 1 && b > 0 && b < 1;
    });
  }

  /// A top as a slab, and each thing below it as a box of its own.
  void addTable(const Part& part, ScanThing& thing) const {
    const TableTop& top = tops_[static_cast<std::size_t>(part.top)];
    UprightBox slab = fitBox(samples_, top.samples, yawsFor(part.samples), std::max(tolerance_m_, 0.015));
    slab.box.max().z() = top.height_m;
    slab.box.min().z() = std::min(slab.box.min().z(), top.height_m - 0.02);
    clear(slab, false);
    addBox(slab, thing);
    thing.shape = ThingShape::kBox;
    thing.rms_m = slab.rms_m, thing.largest_m = slab.largest_m;
    std::vector<int> below(part.samples.begin() + static_cast<std::ptrdiff_t>(top.samples.size()), part.samples.end());
    for (const std::vector<int>& leg : connected(below)) {
      if (leg.size() < 12) continue;
      UprightBox box = fitBox(samples_, leg, yawsFor(leg), std::max(tolerance_m_, 0.015));
      box.box.max().z() = std::min(box.box.max().z(), slab.box.min().z() - kGap_m);
      clear(box, false);
      if (box.box.sizes().minCoeff() > 0) addBox(box, thing);
    }
  }

  std::vector<std::vector<int>> connected(const std::vector<int>& indices) const {
    std::vector<std::vector<int>> found;
    std::map<int, bool> open;
    for (int i : indices) open[i] = true;
    const auto touching_m = static_cast<float>(std::min(kTouching_voxels * samples_.spacing_m, kTouching_m));
    for (auto& [start, is_open] : open) {
      if (!is_open) continue;
      is_open = false;
      std::vector<int> queue = {start};
      for (std::size_t q = 0; q < queue.size(); ++q) {
        const auto i = static_cast<std::size_t>(queue[q]);
        for (std::size_t k = samples_.first[i]; k < samples_.first[i + 1]; ++k) {
          const auto next = open.find(samples_.neighbour[k]);
          if (next == open.end() || !next->second) continue;
          if ((samples_.points[i] - samples_.points[static_cast<std::size_t>(next->first)]).norm() > touching_m)
            continue;
          next->second = false;
          queue.push_back(next->first);
        }
      }
      found.push_back(queue);
    }
    return found;
  }

  /// By class, from the largest to the smallest.
  void nameThings() {
    std::vector<std::size_t> order(result_.things.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
      return result_.things[a].samples > result_.things[b].samples;
    });
    std::map<std::string, int> counts;
    Things sorted;
    for (std::size_t i : order) {
      ScanThing& thing = result_.things[i];
      thing.name = thing.klass + "_" + std::to_string(++counts[thing.klass]);
      sorted.things.push_back(std::move(thing));
      sorted.samples.push_back(std::move(result_.samples[i]));
    }
    sorted.crumbs = result_.crumbs;
    sorted.scraps = result_.scraps;
    sorted.notes = result_.notes;
    result_ = std::move(sorted);
  }

  const RawScan& scan_;
  const ScanFrame& frame_;
  const ScanOptions& options_;
  const ScanSamples& samples_;
  const std::vector<PlaneRegion>& regions_;
  const RoomPlanes& room_;
  const double tolerance_m_;
  std::vector<char> free_;
  std::vector<int> region_of_, top_of_;
  std::vector<TableTop> tops_;
  CellRaster floor_{0.05};
  Things result_;
};

}  // namespace

Things thingsOf(const RawScan& scan, const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
                const std::vector<PlaneRegion>& regions, const RoomPlanes& room) {
  return ThingFinder(scan, frame, options, samples, regions, room).run();
}

}  // namespace mmradartwin
