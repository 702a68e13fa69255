#include "scan/objects/placed_objects.h"

#include <pcl/kdtree/kdtree_flann.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "scan/samples/scan_bounds.h"
#include "scan/things/thing_mesh.h"
#include "scan/things/thing_shapes.h"

namespace mmradartwin {
namespace {

// An object's pose and the room's scan are some centimetres apart, and both are rounded at edges.
constexpr double kCovers_m = 0.05;
constexpr double kInsideWall_m = 0.05;                // so far a pose's error may put an object into a wall
constexpr double kMostOutside = 0.05;                 // share of its surface
constexpr double kMostShared = 0.05;                  // share of an object within another one
constexpr double kSmallest_m = 0.15, kLargest_m = 4;  // largest size of a thing that is worth a scan of its own
constexpr double kRest = 0.8;  // of a thing's samples near an object: what is left of it is no thing

/// An object's surface in map, its body where it is one, and a search in it.
struct PlacedObject {
  const ScanObject* object;
  ScanSamples samples;  ///< in map
  std::vector<int> all;
  UprightBox box;
  bool is_box = false;
  pcl::KdTreeFLANN<pcl::PointXYZ> tree;

  bool isNear(const Eigen::Vector3f& p, double reach_m) const {
    std::vector<int> found(1);
    std::vector<float> squared(1);
    return tree.nearestKSearch(pcl::PointXYZ(p.x(), p.y(), p.z()), 1, found, squared) > 0 &&
           static_cast<double>(squared[0]) < reach_m * reach_m;
  }
  /// Within its body, grown by so much.
  bool holds(const Eigen::Vector3d& p, double grown_m) const {
    if (!is_box) return false;
    const Eigen::Vector3d q = box.toBox(p), outside = (box.box.min() - q).cwiseMax(q - box.box.max());
    return outside.maxCoeff() < grown_m;
  }
};

std::string placeText(const Eigen::Vector3d& p) {
  std::array<char, 80> text{};
  std::snprintf(text.data(), text.size(), "(%.2f, %.2f, %.2f) m", p.x(), p.y(), p.z());
  return text.data();
}

std::string percent(double share) { return std::to_string(static_cast<int>(std::lround(100 * share))) + " %"; }

/// The room's unit where it fits, since one scanner writes both; else the only one that does.
double unitOfObject(const ScanObject& object, double room_unit_m) {
  if (object.unit_m) return *object.unit_m;
  if (object.scan.metres) return 1;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : object.scan.points) box.extend(p);
  const auto size = static_cast<double>(box.sizes().maxCoeff());
  std::vector<double> fitting;
  for (double unit_m : {1.0, 0.01, 0.001}) {
    if (unit_m * size >= kSmallest_m && unit_m * size <= kLargest_m) fitting.push_back(unit_m);
  }
  if (std::find(fitting.begin(), fitting.end(), room_unit_m) != fitting.end()) return room_unit_m;
  if (fitting.size() == 1) return fitting.front();
  throw InputError(object.scan.file + ": object " + object.name + " is " + std::to_string(size) +
                   " units wide, which is " + (fitting.empty() ? "no" : "a") + " thing's size in " +
                   (fitting.empty() ? "m, cm or mm" : "more than one unit") + "; state its unit");
}

std::string unitName(double unit_m) { return unit_m == 1 ? "metres" : unit_m < 0.005 ? "millimetres" : "centimetres"; }

void turnIntoMap(const Eigen::Isometry3d& T_map_object, const Eigen::Vector3d& offset_m, ScanSamples& samples) {
  for (Eigen::Vector3f& p : samples.points) p = (T_map_object * (p.cast<double>() + offset_m)).cast<float>();
  for (Eigen::Vector3f& n : samples.normals) n = (T_map_object.linear() * n.cast<double>()).cast<float>();
  for (Eigen::Vector3f& e : samples.error_m) e = (T_map_object.linear() * e.cast<double>()).cast<float>();
}

/// Directions of its upright faces: of the largest flat part, and of all its normals.
std::vector<double> yawsOf(const ScanSamples& samples, double room_yaw_rad) {
  std::vector<double> yaws = {room_yaw_rad};
  for (const PlaneRegion& region : growPlanes(samples, 0.02, nullptr)) {
    if (std::abs(region.normal.z()) > bounds::kUprightPlane) continue;
    yaws.push_back(std::atan2(region.normal.y(), region.normal.x()));
    break;
  }
  double sines = 0, cosines = 0;
  for (const Eigen::Vector3f& n : samples.normals) {
    if (std::abs(n.z()) > bounds::kUprightNormal) continue;
    const double angle = 4 * std::atan2(static_cast<double>(n.y()), static_cast<double>(n.x()));
    sines += std::sin(angle), cosines += std::cos(angle);
  }
  yaws.push_back(0.25 * std::atan2(sines, cosines));
  return yaws;
}

/// Within a floor's outline grown by what a pose may be wrong, and between floor and ceiling.
bool isInside(const RoomPlanes& room, const Eigen::Vector3d& p) {
  if (p.z() < -kInsideWall_m || p.z() > room.height_m + kInsideWall_m) return false;
  for (const ScanPlane& floor : room.planes) {
    if (floor.kind != PlaneKind::kFloor) continue;
    const Eigen::Vector2d q(floor.u.dot(p), floor.v.dot(p));
    bool inside = false;
    double edge_m = 1e9;
    for (std::size_t i = 0, k = floor.outline.size() - 1; i < floor.outline.size(); k = i++) {
      const Eigen::Vector2d &a = floor.outline[i], &b = floor.outline[k], ab = b - a;
      if ((a.y() > q.y()) != (b.y() > q.y()) && q.x() < ab.x() * (q.y() - a.y()) / ab.y() + a.x()) inside = !inside;
      const double along = std::clamp((q - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
      edge_m = std::min(edge_m, (q - a - along * ab).norm());
    }
    if (inside || edge_m < kInsideWall_m) return true;
  }
  return false;
}

void requireInside(const PlacedObject& placed, const RoomPlanes& room) {
  std::size_t outside = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& p : placed.samples.points) {
    outside += !isInside(room, p.cast<double>());
    middle += p.cast<double>();
  }
  const auto count = static_cast<double>(placed.samples.size());
  const double share = static_cast<double>(outside) / count;
  if (share < kMostOutside) return;
  Eigen::AlignedBox3d all;
  for (const ScanPlane& plane : room.planes) {
    for (const Eigen::Vector2d& q : plane.outline) all.extend(plane.at(q));
  }
  throw InputError(placed.object->scan.file + ": object " + placed.object->name + " lies by " + percent(share) +
                   " outside of the room: its middle is at " + placeText(middle / count) + ", the room reaches from " +
                   placeText(all.min()) + " to " + placeText(all.max()) + "; correct its pose or unit");
}

/// Places within a body, or on the surface of what is none.
std::vector<Eigen::Vector3d> placesIn(const PlacedObject& object) {
  std::vector<Eigen::Vector3d> places;
  if (!object.is_box) {
    for (const Eigen::Vector3f& p : object.samples.points) places.push_back(p.cast<double>());
    return places;
  }
  constexpr int kEach = 8;
  for (int i = 0; i < kEach * kEach * kEach; ++i) {
    const Eigen::Vector3d share = (Eigen::Array3d(i % kEach, i / kEach % kEach, i / kEach / kEach) + 0.5) / kEach;
    places.push_back(object.box.toMap(object.box.box.min() + share.cwiseProduct(object.box.box.sizes())));
  }
  return places;
}

/// What stands on, under or beside another one shares no more than errors of poses do.
void requireApart(const PlacedObject& a, const PlacedObject& b) {
  if (a.is_box && !b.is_box) return;  // seen the other way round
  std::size_t shared = 0;
  const std::vector<Eigen::Vector3d> places = placesIn(a);
  for (const Eigen::Vector3d& p : places) {
    shared += b.is_box ? b.holds(p, -kCovers_m / 2) : b.isNear(p.cast<float>(), b.samples.spacing_m);
  }
  const double share = static_cast<double>(shared) / static_cast<double>(places.size());
  if (share < kMostShared) return;
  throw InputError("objects " + a.object->name + " and " + b.object->name + " fill the same place (" + percent(share) +
                   " of " + a.object->name + "); correct a pose, or take one out");
}

/// Ends a body short of what it touches.
void endShort(const RoomPlanes& room, UprightBox& box) {
  Eigen::Vector3d &low = box.box.min(), &high = box.box.max();
  if (low.z() < kInsideWall_m) low.z() = bounds::kGap_m;
  if (high.z() > room.height_m - kInsideWall_m) high.z() = room.height_m - bounds::kGap_m;
  for (const ScanPlane& plane : room.planes) {
    const Eigen::Vector3d n = box.toBox(plane.normal);
    if (plane.kind != PlaneKind::kWall) continue;
    for (int axis = 0; axis < 2; ++axis) {
      if (std::abs(n[axis]) < 0.9999) continue;
      double& end = n[axis] > 0 ? low[axis] : high[axis];
      const double beyond = n[axis] > 0 ? plane.offset_m - end : end + plane.offset_m;  // behind the wall
      if (std::abs(beyond) < kInsideWall_m) end += n[axis] > 0 ? beyond + bounds::kGap_m : -beyond - bounds::kGap_m;
    }
  }
}

void endShort(const RoomPlanes& room, ScanThing& thing) {
  thing.bounds.setEmpty();
  for (Eigen::Vector3d& v : thing.vertices) {
    for (const ScanPlane& plane : room.planes) {
      if (plane.kind == PlaneKind::kDoor || plane.kind == PlaneKind::kWindow || plane.kind == PlaneKind::kPanel)
        continue;
      const double before = plane.normal.dot(v) - plane.offset_m;
      if (before < bounds::kGap_m && before > -2 * kInsideWall_m) v += (bounds::kGap_m - before) * plane.normal;
    }
    thing.bounds.extend(v);
  }
}

/// Its name's beginning, where that tells what it is: "cabinet" of "cabinet_north".
std::string klassOf(const std::string& name) {
  std::string klass = name.substr(0, name.find_first_of("_-.0123456789"));
  std::transform(klass.begin(), klass.end(), klass.begin(), [](unsigned char c) { return std::tolower(c); });
  return klass;
}

class ObjectPlacer {
 public:
  ObjectPlacer(const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples, RoomPlanes& room)
      : frame_(frame), options_(options), samples_(samples), room_(room) {}

  PlacedObjects run() {
    placed_.resize(options_.objects.size());
    for (std::size_t k = 0; k < placed_.size(); ++k) {
      requireOwnName(options_.objects[k]);
      result_.things.push_back(shaped(options_.objects[k], placed_[k]));
    }
    for (const PlacedObject& a : placed_) {
      for (const PlacedObject& b : placed_) {
        if (&a != &b) requireApart(a, b);
      }
    }
    claim();
    return std::move(result_);
  }

 private:
  void requireOwnName(const ScanObject& object) const {
    for (const ScanPlane& plane : room_.planes) {
      if (plane.name == object.name)
        throw InputError(object.scan.file + ": object " + object.name + " has the name of a plane; give it another");
    }
  }

  ScanThing shaped(const ScanObject& object, PlacedObject& placed) {
    const double unit_m = unitOfObject(object, frame_.unit_m);
    const Eigen::Isometry3d T_map_object = object.in_scan ? frame_.T_map_file * object.T_object : object.T_object;
    placed.object = &object;
    placed.samples = thinScan(object.scan, unit_m, nullptr);
    // A small thing has no flat places as wide as those that noise is measured on; the same scanner made the room's.
    placed.samples.noise_m = std::min(placed.samples.noise_m, samples_.noise_m);
    turnIntoMap(T_map_object, unit_m * object.scan.offset, placed.samples);
    pcl::PointCloud<pcl::PointXYZ>::Ptr cloud(new pcl::PointCloud<pcl::PointXYZ>);
    for (const Eigen::Vector3f& p : placed.samples.points) {
      placed.all.push_back(static_cast<int>(placed.all.size()));
      cloud->push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
    }
    placed.tree.setInputCloud(cloud);
    requireInside(placed, room_);
    ScanThing thing = shapeOf(T_map_object, unit_m, placed);
    const Eigen::Vector3d size = thing.bounds.sizes();
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "%s: an object scan in %s, %.2f x %.2f x %.2f m", object.name.c_str(),
                  unitName(unit_m).c_str(), size.x(), size.y(), size.z());
    result_.notes.emplace_back(text.data());
    return thing;
  }

  /// The simplest shape that fits within the noise, as of things.
  ScanThing shapeOf(const Eigen::Isometry3d& T_map_object, double unit_m, PlacedObject& placed) const {
    ScanThing thing;
    thing.name = placed.object->name;
    thing.klass = klassOf(thing.name);
    thing.class_confidence = 1;
    thing.why = "a scan of its own";
    thing.material = placed.object->material;
    thing.samples = placed.samples.size();
    thing.watertight = true;
    const double tolerance_m = std::max(planeTolerance(placed.samples), bounds::kLeastFit_m);
    placed.box = fitBox(placed.samples, placed.all, yawsOf(placed.samples, room_.yaw_rad), tolerance_m);
    const BoxEvidence evidence = evidenceOf(placed.samples, placed.all, placed.box, tolerance_m);
    UprightCylinder cylinder = fitCylinder(placed.samples, placed.all, tolerance_m);
    const bool is_box = placed.box.share > 0.7 && evidence.covered > 0.5;
    const bool meshes = options_.things == ThingForms::kMeshes;
    if (!meshes && cylinder.share > 0.8 && cylinder.share > placed.box.share + 0.05) {
      thing.shape = ThingShape::kCylinder;
      thing.rms_m = cylinder.rms_m, thing.largest_m = cylinder.largest_m;
      if (cylinder.low_m < kInsideWall_m) cylinder.low_m = bounds::kGap_m;
      addCylinder(cylinder, thing);
      placed.is_box = true;  // what its box holds is it, too
      return thing;
    }
    if (meshes || (!is_box && options_.things != ThingForms::kBoxes)) {
      ScanFrame own;
      own.unit_m = unit_m;
      own.T_map_file = T_map_object;
      ScanOptions limits = options_;
      // Its part of the triangles is that of its surface, as of things.
      const auto all = static_cast<double>(samples_.size());
      limits.triangles = static_cast<std::size_t>(static_cast<double>(options_.triangles) *
                                                  std::min(1.0, static_cast<double>(placed.samples.size()) / all));
      if (addMesh(placed.object->scan, placed.samples, own, limits, placed.all, thing)) {
        endShort(room_, thing);
        return thing;
      }
    }
    thing.shape = placed.box.box.sizes().minCoeff() < 0.04 ? ThingShape::kPlate : ThingShape::kBox;
    thing.rms_m = placed.box.rms_m, thing.largest_m = placed.box.largest_m;
    placed.is_box = true;
    endShort(room_, placed.box);
    addBox(placed.box, thing);
    return thing;
  }

  /// The room's samples that lie at an object or in it.
  void claim() {
    result_.claimed.resize(placed_.size());
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (room_.owner[i] != -1) continue;
      const Eigen::Vector3f& p = samples_.points[i];
      for (std::size_t k = 0; k < placed_.size(); ++k) {
        if (!placed_[k].isNear(p, kCovers_m) && !placed_[k].holds(p.cast<double>(), kCovers_m)) continue;
        room_.owner[i] = kOfObject;
        result_.claimed[k].push_back(static_cast<int>(i));
        break;
      }
    }
  }

  const ScanFrame& frame_;
  const ScanOptions& options_;
  const ScanSamples& samples_;
  RoomPlanes& room_;
  std::vector<PlacedObject> placed_;
  PlacedObjects result_;
};

/// What an object leaves of a thing that it replaces: nearly all of it lies at the object.
bool isRestOf(const ScanThing& object, const std::vector<int>& thing, const ScanSamples& samples) {
  if (object.shape == ThingShape::kMesh) return false;
  Eigen::AlignedBox3d around(object.bounds.min().array() - 3 * kCovers_m, object.bounds.max().array() + 3 * kCovers_m);
  std::size_t within = 0;
  for (int i : thing) within += around.contains(samples.points[static_cast<std::size_t>(i)].cast<double>());
  return static_cast<double>(within) > kRest * static_cast<double>(thing.size());
}

}  // namespace

PlacedObjects placeObjects(const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
                           RoomPlanes& room) {
  return ObjectPlacer(frame, options, samples, room).run();
}

void joinObjects(const ScanSamples& samples, PlacedObjects objects, Things& things) {
  if (objects.things.empty()) return;
  std::set<std::string> names;
  for (const ScanThing& object : objects.things) names.insert(object.name);
  Things joined;
  joined.crumbs = things.crumbs;
  joined.scraps = things.scraps;
  joined.notes = things.notes;
  for (std::size_t k = 0; k < objects.things.size(); ++k) {
    joined.things.push_back(std::move(objects.things[k]));
    joined.samples.push_back(std::move(objects.claimed[k]));
  }
  const std::size_t count = joined.things.size();
  std::map<std::string, int> numbers;
  for (std::size_t t = 0; t < things.things.size(); ++t) {
    ScanThing& thing = things.things[t];
    std::size_t replaced_by = count;
    for (std::size_t k = 0; k < count && replaced_by == count; ++k) {
      if (isRestOf(joined.things[k], things.samples[t], samples)) replaced_by = k;
    }
    if (replaced_by < count) {
      std::vector<int>& own = joined.samples[replaced_by];
      own.insert(own.end(), things.samples[t].begin(), things.samples[t].end());
      continue;
    }
    do {
      thing.name = thing.klass + "_" + std::to_string(++numbers[thing.klass]);
    } while (names.count(thing.name));
    joined.things.push_back(std::move(thing));
    joined.samples.push_back(std::move(things.samples[t]));
  }
  things = std::move(joined);
}

}  // namespace mmradartwin
