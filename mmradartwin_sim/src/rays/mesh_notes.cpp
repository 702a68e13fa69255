#include "mmradartwin_sim/mesh_notes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <sstream>

#include "mmradartwin_sim/ray_caster.h"
#include "scene/curved_surface.h"
#include "scene/vertex_weld.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kMostNamed = 5;
constexpr std::size_t kBody = 3;         ///< facets: fewer are sheets, a folded one among them
constexpr std::size_t kFragments = 20;   ///< facets that gentle folds join, on no sphere nor cylinder
constexpr double kFolded = 0.01;         ///< of an actor's area: what of a scan lies on itself by its noise
constexpr double kInset = 0.02;          ///< of a triangle: its rim may touch its neighbours
constexpr double kLeastLength_m = 2e-3;  ///< of a ray within a triangle: shorter ones see rounding

/// Edges that one triangle alone has.
std::size_t openEdges(const Actor& actor, const std::vector<int>& weld) {
  std::map<std::pair<int, int>, int> count;
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    if (actor.triangle_facet[t] < 0) continue;
    for (int k = 0; k < 3; ++k) {
      const int a = weld[actor.triangles[t][k]], b = weld[actor.triangles[t][(k + 1) % 3]];
      ++count[std::minmax(a, b)];
    }
  }
  return static_cast<std::size_t>(
      std::count_if(count.begin(), count.end(), [](const auto& c) { return c.second == 1; }));
}

/// A place where one of the actor's facets comes through another.
std::optional<Eigen::Vector3d> cut(const Scene& scene, const Actor& actor) {
  Scene alone;
  alone.actors = {actor};
  alone.actors[0].occludes = alone.actors[0].present = true;
  const RayCaster rays(alone);
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    const int facet = actor.triangle_facet[t];
    if (facet < 0) continue;
    std::array<Eigen::Vector3d, 3> corner;
    for (int k = 0; k < 3; ++k) corner[k] = actor.vertices[actor.triangles[t][k]];
    const Eigen::Vector3d middle = (corner[0] + corner[1] + corner[2]) / 3;
    for (Eigen::Vector3d& c : corner) c += kInset * (middle - c);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d way = corner[(k + 1) % 3] - corner[k];
      if (way.norm() < kLeastLength_m) continue;
      const auto hit = rays.firstHit(corner[k], way, way.norm());
      if (!hit || hit->facet == facet || hit->facet < 0) continue;
      // Through it, not along it or up to it.
      const Facet& other = scene.facets[static_cast<std::size_t>(hit->facet)];
      const double from = other.planeDistance(corner[k]), to = other.planeDistance(corner[(k + 1) % 3]);
      const double clear = kLeastLength_m + other.flatness_m;
      if (from * to < 0 && std::abs(from) > clear && std::abs(to) > clear) return hit->point;
    }
  }
  return std::nullopt;
}

/// Facets of the actor that gentle folds join though they stand for nothing round: a scan's noise breaks a wall so.
std::size_t fragments(const Scene& scene, const Actor& actor, const std::vector<int>& weld) {
  std::size_t most = 0;
  for (const std::vector<int>& part : smoothParts(scene, actor, weld)) {
    if (scene.facets[static_cast<std::size_t>(part.front())].curved < 0) most = std::max(most, part.size());
  }
  return most;
}

/// "poster in wall (0.5 m2)": actors whose faces are left out where those of the other lie.
std::vector<std::string> coinciding(const Scene& scene) {
  std::map<std::pair<int, int>, double> area;  // actor kept, actor cut
  for (const FaceOverlap& o : scene.overlaps) {
    const auto owner = [&](int facet) { return scene.facets[static_cast<std::size_t>(facet)].actor; };
    area[{owner(o.kept), owner(o.cut)}] += o.area_m2;
  }
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const double repeated = scene.actors[a].repeated_m2;
    if (repeated > 0) area[{static_cast<int>(a), static_cast<int>(a)}] += repeated;
  }
  std::vector<std::string> found;
  for (const auto& [pair, area_m2] : area) {
    double whole_m2 = 0;
    for (int id : scene.actorOf(pair.second).facets) whole_m2 += scene.facets[static_cast<std::size_t>(id)].area_m2;
    if (pair.first == pair.second && area_m2 < kFolded * whole_m2) continue;
    std::ostringstream text;
    text.precision(3);
    text << scene.actorOf(pair.second).name;
    if (pair.first == pair.second) {
      text << " with itself";
    } else {
      text << " in " << scene.actorOf(pair.first).name;
    }
    text << " (" << area_m2 << " m2)";
    found.push_back(text.str());
  }
  return found;
}

std::string listed(const std::vector<std::string>& names) {
  std::ostringstream out;
  for (std::size_t i = 0; i < std::min(kMostNamed, names.size()); ++i) out << (i ? ", " : "") << names[i];
  if (names.size() > kMostNamed) out << " and " << names.size() - kMostNamed << " more";
  return out.str();
}

}  // namespace

std::vector<std::string> meshNotes(const Scene& scene) {
  std::vector<std::string> open, crossed, broken, numbered;
  for (const Actor& actor : scene.actors) {
    if (!actor.name_in_mesh.empty()) numbered.push_back(actor.name_in_mesh + " is " + actor.name);
    const std::vector<int> weld = weldVertices(actor.vertices);
    const std::size_t edges = actor.facets.size() >= kBody ? openEdges(actor, weld) : 0;
    if (edges > 0) open.push_back(actor.name + " (" + std::to_string(edges) + " open edges)");
    const std::size_t pieces = fragments(scene, actor, weld);
    if (pieces >= kFragments) broken.push_back(actor.name + " (" + std::to_string(pieces) + " facets)");
    if (const auto at = cut(scene, actor)) {
      std::ostringstream text;
      text.precision(3);
      text << actor.name << " (at " << at->x() << ", " << at->y() << ", " << at->z() << " m)";
      crossed.push_back(text.str());
    }
  }
  std::vector<std::string> notes;
  if (!numbered.empty()) {
    notes.push_back(scene.file +
                    ": objects of a mesh file that are named alike are numbered in its order: " + listed(numbered));
  }
  if (!open.empty()) {
    notes.push_back(scene.file +
                    ": open meshes are traced as surfaces without an inside, so that a radar within them is "
                    "not noticed; close them where they stand for bodies: " +
                    listed(open));
  }
  if (!crossed.empty()) {
    notes.push_back(scene.file +
                    ": surfaces that cut through each other are traced as they are, and their parts inside "
                    "a body scatter nothing that shows; cut the meshes there: " +
                    listed(crossed));
  }
  if (!broken.empty()) {
    std::ostringstream text;
    text << scene.file << ": facets at small angles return each on its own; where they are a scan's noise on something "
         << "flat, widen scene.yaml's facets: {angle_deg: " << scene.tolerance.angle_deg
         << ", offset_m: " << scene.tolerance.offset_m << "}: " << listed(broken);
    notes.push_back(text.str());
  }
  if (const std::vector<std::string> pairs = coinciding(scene); !pairs.empty()) {
    notes.push_back(scene.file +
                    ": faces that coincide return once; each of these lies in the plane of the other, which keeps the "
                    "area; remove what was exported twice: " +
                    listed(pairs));
  }
  return notes;
}

}  // namespace mmradartwin
