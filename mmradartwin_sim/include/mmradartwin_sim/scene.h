#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <vector>

#include "mmradartwin_sim/material.h"

namespace mmradartwin {

/// A planar polygon of one actor: coplanar, connected triangles merged. Coordinates in map, metres.
struct Facet {
  int actor = -1;                   ///< index into Scene::actors
  int id = -1;                      ///< index into Scene::facets
  Eigen::Vector3d origin;           ///< a corner of the bounding rectangle
  Eigen::Vector3d e1, e2, normal;   ///< orthonormal; normal = e1 x e2 (its side means nothing)
  double size1_m = 0, size2_m = 0;  ///< bounding rectangle: origin + [0,size1] e1 + [0,size2] e2
  double area_m2 = 0;
  bool rectangle = false;                           ///< fills its bounding rectangle
  std::vector<std::vector<Eigen::Vector2d>> loops;  ///< boundary loops in (e1, e2), outer ones and holes
  bool reflects = true;   ///< false where the normal lies within 45 deg of the vertical: it only occludes
  bool present = true;    ///< false where a mechanism took the actor away, or where others cover all of it; ids stay
  double flatness_m = 0;  ///< largest distance of a merged vertex from the plane
  int curved = -1;        ///< index into Scene::curved of the surface that it is a chord of, -1 where it is a plane
  int body = -1;          ///< index into Scene::bodies, -1 where its surface is open
  int outside = 0;        ///< of a body's facet: 1 where the normal points out of the body, -1 where it points into it
  /// Facets that lie over this one at a few millimetres: a ray that ends short of this one misses them.
  std::vector<int> layers;

  double planeDistance(const Eigen::Vector3d& p) const { return normal.dot(p - origin); }
  bool contains(const Eigen::Vector3d& p_on_plane, double tolerance_m = 0) const;
  /// Point of the facet nearest to p (p anywhere), at least inset_m inside its boundary where it is large enough.
  Eigen::Vector3d nearest(const Eigen::Vector3d& p, double inset_m = 0) const;
};

/// A named thing with one surface material.
struct Actor {
  std::string name;
  std::string name_in_mesh;  ///< where nodes of the mesh file are named alike, so that this one was numbered; else ""
  std::string material_tag;
  Material material;
  std::vector<Eigen::Vector3d> vertices;  ///< map, metres
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> triangle_facet;  ///< facet id per triangle, -1 where it has no area
  std::vector<int> facets;          ///< ids
  /// Frame of the mesh file that it came from, as scene.yaml places it: what a moving actor's frame in tf stands for.
  Eigen::Isometry3d T_map_mesh = Eigen::Isometry3d::Identity();
  bool present = true;   ///< false where a mechanism took it away: no paths, no occlusion
  bool occludes = true;  ///< false where rays pass through it; its own faces stay hidden behind each other
  Eigen::AlignedBox3d bounds;
  double repeated_m2 = 0;  ///< area of triangles that lie on others of the actor and are left out
};

/// A sphere or straight circular cylinder that a tessellated part of an actor stands for. Its facets scatter and
/// occlude one by one; their specular return is that of the surface, first order alone.
struct CurvedSurface {
  int actor = -1;
  std::vector<int> facets;                           ///< ids
  bool sphere = false;                               ///< else a cylinder
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of a cylinder: of its lower end on the axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< unit, of a cylinder
  double length_m = 0;                               ///< of a cylinder, along the axis
  double radius_m = 0;
  double sagitta_m = 0;  ///< how far the facets lie within the surface
};

/// A closed part of an actor's surface: each edge joins two of its triangles.
struct ClosedBody {
  int actor = -1;
  std::vector<std::array<int, 3>> triangles;  ///< vertices of the actor, counter-clockwise as seen from outside
};

/// What is a facet's shape but for its place.
struct FacetShape {
  std::vector<std::vector<Eigen::Vector2d>> loops;
  double area_m2 = 0;
  bool rectangle = false;
};

/// Two facets in one plane that claim the same area; it belongs to `kept` alone.
struct FaceOverlap {
  int kept = -1, cut = -1;  ///< facet ids
  double area_m2 = 0;
};

/// When neighbouring triangles are one facet: drawings, and meshes whose vertices are a few millimetres off at
/// triangles of some decimetres. Scans need wider limits.
struct FacetTolerance {
  double angle_deg = 1.5;   ///< between a triangle's normal and the facet's
  double offset_m = 0.005;  ///< of a vertex from the facet's plane
};

struct Scene {
  std::string file;          ///< scene.yaml
  FacetTolerance tolerance;  ///< scene.yaml's optional `facets: {angle_deg, offset_m}`
  std::vector<Actor> actors;
  std::vector<Facet> facets;
  std::vector<CurvedSurface> curved;
  std::vector<ClosedBody> bodies;
  std::vector<FaceOverlap> overlaps;  ///< of facets that are seen from the same side
  std::map<int, FacetShape> uncut;    ///< facet id -> shape before others were cut out of it
  std::vector<Actor> occluders_only;  ///< what mechanisms put into the room: they occlude, nothing else

  int actorIndex(const std::string& name) const;  ///< -1 where absent
  /// The actor of a path record's index; of -1 one that stands for what mechanisms put into the room.
  const Actor& actorOf(int index) const;
  /// Names of the actors in a line of an error, cut where they are many.
  std::string knownActors() const;
};

/// Reads scene.yaml strictly, its meshes (assimp) and materials, and builds facets. Throws InputError naming file and
/// key (unknown material, two actors of one name, no triangles, NaN or huge coordinates, material outside its frequency
/// range).
Scene loadScene(const std::string& scene_yaml, double frequency_hz);
/// Facets and curved surfaces of all actors, ids in the order of actors and triangles. Throws InputError for an actor
/// without area.
void rebuildFacets(Scene& scene);
/// One more actor behind the others, with its facets, whatever was done to the others since. Throws as rebuildFacets().
void addActor(Scene& scene, Actor actor);
/// Moves an actor with its facets; indices and facet-local coordinates stay, but for what coincides with others.
void moveActor(Scene& scene, int actor, const Eigen::Isometry3d& T_map_map);
/// Makes all that is in the scene larger by a factor about map's origin; indices stay, and what was one facet stays
/// one.
void scaleScene(Scene& scene, double factor);
/// Takes an actor out of paths and occlusion; indices stay.
void removeActor(Scene& scene, int actor);
/// Reads one mesh file into actors, upright and in metres by what it declares (mesh_frame.h), without materials or
/// facets: OBJ object or group name = actor, glTF node name = actor (the second of a name becomes NAME_2), otherwise
/// the file's stem. Throws InputError.
std::vector<Actor> loadMesh(const std::string& file);

}  // namespace mmradartwin
