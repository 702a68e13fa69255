#pragma once

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/stated_accuracy.h"

namespace mmradartwin {

/// A scan as its files hold it, in one list of points: a triangle mesh, or a point cloud where `triangles` is empty.
struct RawScan {
  std::string file;
  std::vector<Eigen::Vector3f> points;  ///< units and axes of the file, less `offset`
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  std::vector<std::array<int, 3>> triangles;
  std::vector<std::array<unsigned char, 3>> colors;  ///< r, g, b of each point, or empty
  std::size_t left_out = 0;                          ///< points that were no finite numbers
  bool camera_axes = false;                          ///< one frame of a depth camera: z forward, y down
  bool metres = false;                               ///< the format itself declares metres
  bool y_up = false;                                 ///< the format itself declares that y is up
};

constexpr std::size_t kFewestPointsOfRoom = 1000;

/// Reads PLY, OBJ, STL, glTF, Collada, FBX (meshes), PLY without faces, PCD, XYZ (clouds). Throws InputError naming the
/// file: unreadable, fewer points and triangles than `fewest`, more than 12 million points or 6 million triangles.
RawScan readScan(const std::string& file, std::size_t fewest = kFewestPointsOfRoom);

/// A thing that was scanned by itself, and where it stands in the room (scan_objects.h).
struct ScanObject {
  std::string name;  ///< of its actor
  RawScan scan;      ///< in a frame of its own
  /// From the object's axes, metres, to map; or to the axes of the room's scan where `in_scan`
  Eigen::Isometry3d T_object = Eigen::Isometry3d::Identity();
  bool in_scan = false;
  std::optional<double> unit_m;  ///< metres per unit of its file; found from its size where it is not stated
  std::string material;          ///< a preset's tag, or "" where nobody has said
};

/// An upright plane of a scan, and how far it goes along its normal against where the scan has it.
struct PlaneShift {
  std::size_t plane = 0;  ///< ScanPlane::plane of its parts, in the scene of the same scan and options without shifts
  double by_m = 0;
};

/// What things become: the simplest shapes that fit; boxes and cylinders alone, however they fit, so that a simulation
/// is fast; or meshes of the scan's own triangles, cleaned and thinned, however simple they are.
enum class ThingForms { kShapes, kBoxes, kMeshes };

/// What a person states of a scan; what is not stated is found from the data.
struct ScanOptions {
  std::optional<double> unit_m;       ///< metres per unit of the file
  std::optional<Eigen::Vector3d> up;  ///< in axes of the file, about; the floor refines it
  std::optional<double> floor_m;      ///< height of the floor above the file's origin along up
  bool level = true;                  ///< false: `up` is exact, nothing is turned by floor and walls
  bool regularise = true;             ///< planes turn to parallels and right angles within their uncertainty
  std::size_t triangles = 20000;      ///< all things that are meshes together, at most
  double silhouette_m = 0.01;         ///< decimation leaves silhouettes within this
  ThingForms things = ThingForms::kShapes;
  std::vector<ScanObject> objects;  ///< replace what they overlap in the room's scan
  std::vector<PlaneShift> shifts;   ///< walls that another sensor knows better (scan_refinement.h)
  std::function<void(double, const std::string&)> progress;  ///< share of a stage that is done, and its name
};

/// How the map's coordinates come from the file's, and what the scan is good for.
struct ScanFrame {
  double unit_m = 1;
  std::string unit_name;                          ///< "m", "cm", "mm"
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit, in axes of the file
  std::string up_name;                            ///< of the file's axis that is nearest to up: "z", "-y"
  double tilt_deg = 0;                            ///< between that axis and up
  double tilt_std_deg = 0;                        ///< of up, from the planes that gave it
  double floor_leans_deg = 0;                     ///< that a floor leant in the scan, and was made level
  double floor_m = 0;  ///< of the floor above the file's origin, along that axis where large coordinates were taken off
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  ///< large coordinates that were taken off; z up, metres
  Eigen::Isometry3d T_map_file = Eigen::Isometry3d::Identity();  ///< p_map = T_map_file * (unit_m * p_file)
  bool has_ceiling = false;
  double ceiling_m = 0;  ///< height of the ceiling in map, where there is one
  double noise_m = 0;    ///< standard deviation of the scan's points about flat surfaces
  double spacing_m = 0;  ///< of the thinned samples
  std::string words;     ///< the above in one sentence
};

enum class PlaneKind { kFloor, kCeiling, kWall, kDoor, kWindow, kPanel };

/// A plane of the room itself: a flat face that does not belong to a body, with what bounds it.
struct ScanPlane {
  std::string name;  ///< "floor", "wall_2", "door_1"
  PlaneKind kind = PlaneKind::kWall;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, in map, into the room
  double offset_m = 0;                                ///< normal . p = offset on the plane
  std::size_t plane = 0;                              ///< of walls: the same number on all parts of one plane
  Eigen::Vector3d u, v;                               ///< axes in the plane, u x v = normal; p = offset n + a u + b v
  std::vector<Eigen::Vector2d> outline;               ///< counter-clockwise about the normal, in (u, v), metres
  std::vector<std::vector<Eigen::Vector2d>> holes;    ///< windows, doorways: clockwise
  double area_m2 = 0;                                 ///< of the polygon less its holes
  double covered_m2 = 0;                              ///< what the scan has of it
  double rms_m = 0, largest_m = 0;                    ///< residuals of the scan's points; largest: 99 in 100 are less
  double bow_m = 0;          ///< rms of the residual's mean over patches of 0.5 m: what noise does not explain
  double angle_std_deg = 0;  ///< of the normal before regularisation
  double turned_deg = 0;     ///< by regularisation
  std::size_t samples = 0;   ///< thinned samples that lie on it
  std::vector<Eigen::Vector3f> residuals;  ///< of those samples: u, v, distance along the normal, metres

  Eigen::Vector3d at(const Eigen::Vector2d& p) const { return offset_m * normal + p.x() * u + p.y() * v; }
};

enum class ThingShape { kBox, kCylinder, kSphere, kPlate, kMesh };

/// What stands off the planes.
struct ScanThing {
  std::string name;             ///< "cabinet_1", "unknown_3"
  std::string klass;            ///< "cabinet", "table", ...; "unknown" where no class fits
  double class_confidence = 0;  ///< 0 to 1
  std::string why;              ///< of the class, in words
  std::string material;         ///< that a person has stated for it, or ""
  ThingShape shape = ThingShape::kMesh;
  bool watertight = false;
  Eigen::AlignedBox3d bounds;             ///< in map
  double rms_m = 0, largest_m = 0;        ///< distance of its points from the shape that it became
  double range_std_m = 0;                 ///< how far its faces are known along their normals, 1 sigma
  std::vector<Eigen::Vector3d> vertices;  ///< in map, metres
  std::vector<std::array<int, 3>> triangles;
  std::size_t samples = 0;
};

/// A proposed material of one actor.
struct MaterialProposal {
  std::string actor;
  std::string tag;          ///< of materials.yaml; "unknown" actors get the fallback's
  bool unknown = false;     ///< nothing tells
  double confidence = 0;    ///< 0 to 1
  std::string source;       ///< "shape: outermost upright plane of the room", "edited by a person"
  double level_std_db = 0;  ///< of its echoes, by what else it may be of; 0 where a person has said
};

/// A flat triangle set with a name: what the scene file's mesh holds.
struct ScanActor {
  std::string name;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

struct ScanScene {
  ScanFrame frame;
  std::vector<ScanPlane> planes;
  std::vector<ScanThing> things;
  std::vector<MaterialProposal> materials;  ///< one of each plane and thing, in their order
  std::vector<ScanActor> actors;            ///< likewise
  StatedAccuracy accuracy;  ///< for session.yaml, in what a scan tells: scene_m, level_db, path_range_m, path_angle_deg
  // The thinned scan in map, for pictures and checks.
  std::vector<Eigen::Vector3f> samples;
  std::vector<Eigen::Vector3f> sample_normals;  ///< unit; of a cloud, the sign means nothing
  /// index into `planes`; planes.size() + index into `things`; -1 where the sample was left out
  std::vector<int> sample_owner;
  double scanned_m2 = 0, on_planes_m2 = 0, on_things_m2 = 0, left_out_m2 = 0;
  double wall_m2 = 0,
         wall_on_planes_m2 = 0;    ///< upright surface of the scan as high as walls, and what planes hold of it
  std::vector<std::string> notes;  ///< what a person should know, a sentence each
};

/// Planes first, then things, then materials. Deterministic: the same scan and options give the same result. Throws
/// InputError where the scan is no room: one plane alone, no floor, no walls, outdoors.
ScanScene sceneOfScan(const RawScan& scan, const ScanOptions& options);

/// Writes room.obj, materials.yaml and scene.yaml into a folder. `edited_scene_yaml` is an older scene.yaml ("" for
/// none) whose materials, where a person changed them, stay. Returns the accuracy that it states, in which a person's
/// materials are known. Throws InputError where that file cannot be read.
StatedAccuracy writeScanScene(const ScanScene& scene, const std::string& folder,
                              const std::string& edited_scene_yaml = "");

/// A reader's check of one line: does this file hold a room-scale scan (one part, or a cloud) and not a modelled room
/// with named parts?
bool isScan(const std::string& file);

}  // namespace mmradartwin
