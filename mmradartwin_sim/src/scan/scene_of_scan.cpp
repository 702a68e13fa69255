#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/scan_to_scene.h"
#include "scan/objects/placed_objects.h"
#include "scan/planes/plane_directions.h"
#include "scan/planes/plane_regions.h"
#include "scan/planes/polygon_triangles.h"
#include "scan/planes/room_planes.h"
#include "scan/planes/scan_frame.h"
#include "scan/proposed_materials.h"
#include "scan/samples/scan_bounds.h"
#include "scan/samples/scan_samples.h"
#include "scan/scan_accuracy.h"
#include "scan/things/things.h"

namespace mmradartwin {
namespace {

ScanActor actorOfPlane(const ScanPlane& plane) {
  ScanActor actor;
  actor.name = plane.name;
  for (const Eigen::Vector2d& p : plane.outline) actor.vertices.push_back(plane.at(p));
  for (const auto& hole : plane.holes) {
    for (const Eigen::Vector2d& p : hole) actor.vertices.push_back(plane.at(p));
  }
  actor.triangles = trianglesOf(plane.outline, plane.holes);
  return actor;
}

/// Takes the residuals of large planes for the noise where they are larger. True where that changes much.
bool takeNoiseOf(const std::vector<PlaneRegion>& regions, ScanSamples& samples) {
  if (!samples.error_m.empty()) return false;  // each sample has its own
  double squares = 0, area = 0;
  for (const PlaneRegion& r : regions) {
    if (r.area_m2 < 1) continue;
    squares += r.area_m2 * r.rms_m * r.rms_m, area += r.area_m2;
  }
  const double noise = area > 0 ? std::sqrt(squares / area) : 0;
  if (noise < 1.1 * samples.noise_m) return false;
  samples.noise_m = noise;
  return true;
}

/// Areas of the scan by what became of them.
void countAreas(ScanScene& scene, const ScanSamples& samples, const std::vector<std::vector<int>>& of_things) {
  const double each = samples.area_m2(), reach_m = std::max(0.03, 5 * samples.noise_m);
  for (std::size_t t = 0; t < of_things.size(); ++t) {
    for (int i : of_things[t])
      scene.sample_owner[static_cast<std::size_t>(i)] = static_cast<int>(scene.planes.size() + t);
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const int owner = scene.sample_owner[i];
    scene.scanned_m2 += each;
    if (owner < 0) {
      scene.left_out_m2 += each;
    } else {
      (owner < static_cast<int>(scene.planes.size()) ? scene.on_planes_m2 : scene.on_things_m2) += each;
    }
    // Upright surface at a wall, on its plane or not.
    if (owner >= static_cast<int>(scene.planes.size()) || std::abs(samples.normals[i].z()) > bounds::kUprightNormal)
      continue;
    const Eigen::Vector3d p = samples.points[i].cast<double>();
    const bool on_wall = owner >= 0 && scene.planes[static_cast<std::size_t>(owner)].kind == PlaneKind::kWall;
    const bool at_wall = on_wall || std::any_of(scene.planes.begin(), scene.planes.end(), [&](const ScanPlane& w) {
                           return w.kind == PlaneKind::kWall && std::abs(w.normal.dot(p) - w.offset_m) < reach_m;
                         });
    if (at_wall) scene.wall_m2 += each;
    if (on_wall) scene.wall_on_planes_m2 += each;
  }
}

std::string line(const char* format, double a, double b = 0) {
  std::array<char, 240> text{};
  std::snprintf(text.data(), text.size(), format, a, b);
  return text.data();
}

void addNotes(ScanScene& scene, const RawScan& scan, const RoomPlanes& room, const Things& things, double cell_m2) {
  if (scan.left_out)
    scene.notes.push_back(
        line("%.0f point(s) are no finite numbers and were left out", static_cast<double>(scan.left_out)));
  if (!scene.frame.has_ceiling)
    scene.notes.push_back(line("no ceiling is in the scan; walls end at %.2f m", room.height_m));
  if (room.doubled_m2 > 0.1) {
    scene.notes.push_back(
        line("%.1f m2 are second copies of a surface some centimetres off, which the scanner's drift makes; large "
             "ones are averaged, small ones left out",
             room.doubled_m2));
  }
  if (room.closed_m2 > 0.1)
    scene.notes.push_back(line("%.1f m2 of walls are not in the scan and were closed", room.closed_m2));
  const double crumbs_m2 = static_cast<double>(things.crumbs) * cell_m2;
  if (crumbs_m2 >= 0.01)
    scene.notes.push_back(line("%.2f m2 lie in pieces too small for a thing and were left out", crumbs_m2));
  if (things.scraps)
    scene.notes.push_back(line("%.2f m2 lie in small things of no sure class and were left out",
                               static_cast<double>(things.scraps) * cell_m2));
  const double share = scene.scanned_m2 > 0 ? scene.left_out_m2 / scene.scanned_m2 : 0;
  if (share > 0.1)
    scene.notes.push_back(line(
        "%.0f %% of the scan's surface is left out: outside of the room, or near planes and on none", 100 * share));
  std::size_t unknown = 0;
  for (const ScanThing& t : things.things) unknown += t.klass == "unknown";
  if (unknown) scene.notes.push_back(line("%.0f thing(s) are of no class that is known", static_cast<double>(unknown)));
}

}  // namespace

ScanScene sceneOfScan(const RawScan& scan, const ScanOptions& options) {
  const double unit_m = options.unit_m.value_or(unitOfScan(scan));
  ScanSamples samples = thinScan(scan, unit_m, options.progress);
  std::vector<PlaneRegion> regions = growPlanes(samples, bounds::kLeastPlane_m2, options.progress);
  // Errors that are alike over more than the places of the first measure show on large planes alone.
  if (takeNoiseOf(regions, samples)) regions = growPlanes(samples, bounds::kLeastPlane_m2, options.progress);
  if (regions.empty()) throw InputError(scan.file + ": shows no flat surface, so that it is no room");
  ScanScene scene;
  scene.frame = bringIntoMap(scan, options, unit_m, samples, regions);
  const double yaw_rad = regularise(samples, options.regularise, regions);
  RoomPlanes room = roomPlanes(scan.file, scene.frame, samples, regions, yaw_rad, options.shifts);
  PlacedObjects objects = placeObjects(scene.frame, options, samples, room);
  const std::vector<std::string> of_objects = objects.notes;
  Things things = thingsOf(scan, scene.frame, options, samples, regions, room);
  joinObjects(samples, std::move(objects), things);
  scene.planes = std::move(room.planes);
  scene.things = std::move(things.things);
  scene.sample_owner = std::move(room.owner);
  countAreas(scene, samples, things.samples);
  for (int& owner : scene.sample_owner) owner = std::max(owner, -1);
  things.things = scene.things;
  for (const ScanPlane& plane : scene.planes) scene.actors.push_back(actorOfPlane(plane));
  for (const ScanThing& thing : scene.things) scene.actors.push_back({thing.name, thing.vertices, thing.triangles});
  scene.materials = proposeMaterials(scene, things.samples, samples);
  scene.accuracy = accuracyOf(scene);
  scene.notes = room.notes;
  scene.notes.insert(scene.notes.end(), of_objects.begin(), of_objects.end());
  addNotes(scene, scan, room, things, samples.area_m2());
  scene.samples = std::move(samples.points);
  scene.sample_normals = std::move(samples.normals);
  return scene;
}

}  // namespace mmradartwin
