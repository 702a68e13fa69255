#include "scan/things/things.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"
#include "scan/things/loose_surface.h"
#include "scan/things/thing_class.h"
#include "scan/things/thing_mesh.h"
#include "scan/things/thing_parts.h"
#include "scan/things/thing_shapes.h"

namespace mmradartwin {
namespace {

/// Of a cluster of no known class: may be cut at its upright plates, is such a plate, or is what that left.
enum class Cut { kMayBe, kPlate, kRest };

class ThingFinder {
 public:
  ThingFinder(const RawScan& scan, const ScanFrame& frame, const ScanOptions& options, const LooseSurface& surface)
      : scan_(scan),
        frame_(frame),
        options_(options),
        surface_(surface),
        samples_(surface.samples),
        regions_(surface.regions),
        room_(surface.room) {}

  Things run() {
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const int owner = room_.owner[i];
      if (owner < 0 || room_.planes[static_cast<std::size_t>(owner)].kind != PlaneKind::kFloor) continue;
      floor_.set(samples_.points[i].head<2>().cast<double>());
    }
    ThingParts found = thingParts(surface_);
    result_.crumbs = found.crumbs;
    tops_ = std::move(found.tops);
    for (const ThingPart& part : found.parts) addThing(part, Cut::kMayBe);
    nameThings();
    return std::move(result_);
  }

 private:
  /// A turned box is the room's where no flat part says by how much it is turned.
  std::vector<double> yawsFor(const std::vector<int>& indices) const {
    const double own = surface_.yawIn(indices);
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
    if (low.z() < 0.06) low.z() = bounds::kGap_m;
    if (high.z() > room_.height_m - 0.06) high.z() = room_.height_m - bounds::kGap_m;
    for (const ScanPlane& plane : room_.planes) {
      if (plane.kind != PlaneKind::kWall) continue;
      const Eigen::Vector3d n = box.toBox(plane.normal);
      for (int axis = 0; axis < 2; ++axis) {
        if (std::abs(n[axis]) < 0.9999) continue;
        // The wall as a limit of this axis; only where the box reaches it.
        const double wall = plane.offset_m / n[axis] + bounds::kGap_m * n[axis];
        double& end = n[axis] > 0 ? low[axis] : high[axis];
        const double other = n[axis] > 0 ? high[axis] : low[axis];
        const double behind = n[axis] > 0 ? wall - end : end - wall;
        const double depth = std::abs(other - end);
        const bool reaches = on_wall && depth < 0.06 && behind > -0.2 && depth < box.box.sizes()[1 - axis];
        if ((behind > 0 && behind < 0.1) || reaches) end = wall;
      }
    }
    for (int axis = 0; axis < 3; ++axis) {
      if (high[axis] - low[axis] < bounds::kThinnest_m) {
        const double middle = 0.5 * (high[axis] + low[axis]);
        low[axis] = middle - bounds::kThinnest_m / 2, high[axis] = middle + bounds::kThinnest_m / 2;
      }
    }
  }

  double seatBelow(const std::vector<int>& indices, double top_m) const {
    std::map<int, std::size_t> counts;
    for (int i : indices) {
      const int r = surface_.region_of[static_cast<std::size_t>(i)];
      if (r >= 0 && std::abs(regions_[static_cast<std::size_t>(r)].normal.z()) > bounds::kLevelPlane) ++counts[r];
    }
    double height = 0;
    std::size_t most = static_cast<std::size_t>(0.05 / samples_.area_m2());
    for (const auto& [r, count] : counts) {
      const double z = regions_[static_cast<std::size_t>(r)].middle.z();
      if (count > most && z < top_m - 0.1) most = count, height = z;
    }
    return height;
  }

  void addThing(const ThingPart& part, Cut cut) {
    ScanThing thing;
    thing.samples = part.samples.size();
    const double tolerance = std::max(surface_.toleranceOf(part.samples), bounds::kLeastFit_m);
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
    if (guess.confidence < bounds::kSure &&
        static_cast<double>(part.samples.size()) * samples_.area_m2() < bounds::kLeastUnsure_m2) {
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
      if (standing.low_m < 0.06) standing.low_m = bounds::kGap_m;
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
  bool cutAtPlates(const ThingPart& part) {
    std::map<int, std::vector<int>> flat;
    for (int i : part.samples) {
      const int r = surface_.region_of[static_cast<std::size_t>(i)];
      if (r >= 0 && std::abs(regions_[static_cast<std::size_t>(r)].normal.z()) < bounds::kUprightPlane)
        flat[r].push_back(i);
    }
    std::vector<ThingPart> plates;
    std::map<int, char> taken;
    for (const auto& [r, own] : flat) {  // regions come largest first
      if (static_cast<double>(own.size()) * samples_.area_m2() < bounds::kLeastPlate_m2 || taken.count(own.front()))
        continue;
      const PlaneRegion& front = regions_[static_cast<std::size_t>(r)];
      const Plate plate = plateOf(samples_, own, front.normal, front.offset_m, bounds::kThinnest_m);
      ThingPart cut{{}, -1, -1};
      for (int i : part.samples) {
        if (taken.count(i)) continue;
        const Eigen::Vector3d from = samples_.at(i) - plate.corner;
        const double a = from.dot(plate.e1) / plate.e1.squaredNorm(), b = from.dot(plate.e2) / plate.e2.squaredNorm();
        const double d = front.distance(samples_.at(i));
        const bool within = a > -0.05 && a < 1.05 && b > -0.05 && b < 1.05;
        // Its back, which faces the other way, and its edges are of it, too.
        if (surface_.region_of[static_cast<std::size_t>(i)] == r ||
            (within && d < planeTolerance(samples_, front) && d > -bounds::kThickestPlate_m))
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
    for (const ThingPart& plate : plates) addThing(plate, Cut::kPlate);
    for (std::vector<int>& own : surface_.connected(rest)) {
      if (static_cast<double>(own.size()) * samples_.area_m2() < bounds::kLeastThing_m2) {
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
    for (int i : indices)
      upright += std::abs(samples_.normals[static_cast<std::size_t>(i)].z()) < bounds::kUprightNormal;
    return static_cast<double>(upright) / static_cast<double>(indices.size());
  }

  /// No box: its flat parts as plates where they are a share of it, else its own surface with fewer triangles. False
  /// where neither can be made.
  bool addPlatesOrMesh(const std::vector<int>& indices, double least_share, ScanThing& thing) const {
    std::map<int, std::vector<int>> flat;
    for (int i : indices) {
      const int r = surface_.region_of[static_cast<std::size_t>(i)];
      if (r >= 0) flat[r].push_back(i);
    }
    std::size_t on_plates = 0;
    for (auto r = flat.begin(); r != flat.end();) {
      const bool large = static_cast<double>(r->second.size()) * samples_.area_m2() > bounds::kLeastPlane_m2;
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
      Plate plate = plateOf(samples_, own, region.normal, region.offset_m, bounds::kThinnest_m);
      // Plates that meet at an edge end short of each other.
      const Eigen::Vector3d d1 = plate.e1.normalized(), d2 = plate.e2.normalized();
      plate.corner += bounds::kGap_m * (d1 + d2);
      plate.e1 -= 2 * bounds::kGap_m * d1, plate.e2 -= 2 * bounds::kGap_m * d2;
      if (plate.e1.dot(d1) > 0.03 && plate.e2.dot(d2) > 0.03) addPlate(plate, thing);
    }
    thing.rms_m = std::sqrt(squares / static_cast<double>(on_plates));
    thing.largest_m = surface_.toleranceOf(indices);
    return !thing.triangles.empty();
  }

  /// The other side of a plate that has its first side already.
  bool isBackOfOther(int r, const std::map<int, std::vector<int>>& flat) const {
    const PlaneRegion& back = regions_[static_cast<std::size_t>(r)];
    return std::any_of(flat.begin(), flat.end(), [&](const auto& other) {
      if (other.first >= r) return false;  // regions come largest first
      const PlaneRegion& front = regions_[static_cast<std::size_t>(other.first)];
      if (front.normal.dot(back.normal) > -0.98 || std::abs(front.distance(back.middle)) > 0.08) return false;
      const Plate plate = plateOf(samples_, other.second, front.normal, front.offset_m, bounds::kThinnest_m);
      const Eigen::Vector3d from = back.middle - plate.corner;
      const double a = from.dot(plate.e1) / plate.e1.squaredNorm(), b = from.dot(plate.e2) / plate.e2.squaredNorm();
      return a > 0 && a < 1 && b > 0 && b < 1;
    });
  }

  /// A top as a slab, and each thing below it as a box of its own.
  void addTable(const ThingPart& part, ScanThing& thing) const {
    const TableTop& top = tops_[static_cast<std::size_t>(part.top)];
    UprightBox slab = fitBox(samples_, top.samples, yawsFor(part.samples),
                             std::max(surface_.toleranceOf(top.samples), bounds::kLeastFit_m));
    slab.box.max().z() = top.height_m;
    slab.box.min().z() = std::min(slab.box.min().z(), top.height_m - 0.02);
    clear(slab, false);
    addBox(slab, thing);
    thing.shape = ThingShape::kBox;
    thing.rms_m = slab.rms_m, thing.largest_m = slab.largest_m;
    std::vector<int> below(part.samples.begin() + static_cast<std::ptrdiff_t>(top.samples.size()), part.samples.end());
    for (const std::vector<int>& leg : surface_.connected(below)) {
      if (leg.size() < 12) continue;
      UprightBox box = fitBox(samples_, leg, yawsFor(leg), std::max(surface_.toleranceOf(leg), bounds::kLeastFit_m));
      box.box.max().z() = std::min(box.box.max().z(), slab.box.min().z() - bounds::kGap_m);
      clear(box, false);
      if (box.box.sizes().minCoeff() > 0) addBox(box, thing);
    }
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
  const LooseSurface& surface_;
  const ScanSamples& samples_;
  const std::vector<PlaneRegion>& regions_;
  const RoomPlanes& room_;
  std::vector<TableTop> tops_;
  CellRaster floor_{bounds::kCell_m};
  Things result_;
};

}  // namespace

Things thingsOf(const RawScan& scan, const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
                const std::vector<PlaneRegion>& regions, const RoomPlanes& room) {
  const LooseSurface surface = looseSurface(samples, regions, room);
  return ThingFinder(scan, frame, options, surface).run();
}

}  // namespace mmradartwin
