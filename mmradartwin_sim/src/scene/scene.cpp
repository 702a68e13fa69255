#include "mmradartwin_sim/scene.h"

#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/mesh_frame.h"

namespace mmradartwin {
namespace {

Eigen::Vector3d triple(YamlMap& yaml, const std::string& key, double limit) {
  const std::vector<double> v = yaml.numbers(key, -limit, limit);
  if (v.size() != 3) yaml.fail(key, "needs three numbers");
  return {v[0], v[1], v[2]};
}

/// Keys up, unit and origin of an entry of meshes.
MeshFrame statedFrame(YamlMap& entry) {
  static const std::map<std::string, double> kUnits_m = {
      {"m", 1}, {"mm", 1e-3}, {"cm", 1e-2}, {"in", 0.0254}, {"ft", 0.3048}};
  MeshFrame frame;
  if (entry.has("up")) frame.y_up = entry.choice("up", {"z", "y"}) == "y";
  if (entry.has("unit")) frame.unit_m = kUnits_m.at(entry.choice("unit", {"m", "mm", "cm", "in", "ft"}));
  if (entry.has("origin")) frame.origin = triple(entry, "origin", 1e8);
  return frame;
}

std::string joined(const std::map<std::string, Material>& materials) {
  std::string list;
  for (const auto& [name, material] : materials) list += (list.empty() ? "" : ", ") + name;
  return list;
}

void checkBand(const std::string& file, const Material& m, double frequency_hz) {
  if (m.extrapolated || (frequency_hz >= m.valid_hz_min && frequency_hz <= m.valid_hz_max)) return;
  std::ostringstream text;
  text << file << ": key materials." << m.name << ".valid_hz: " << frequency_hz << " Hz lies outside " << m.valid_hz_min
       << " to " << m.valid_hz_max << " Hz; give constants for this band or set extrapolated: true";
  throw InputError(text.str());
}

}  // namespace

int Scene::actorIndex(const std::string& name) const {
  for (std::size_t i = 0; i < actors.size(); ++i) {
    if (actors[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

const Actor& Scene::actorOf(int index) const {
  static const Actor unmodelled = [] {
    Actor actor;
    actor.name = "actor_unmodelled";
    return actor;
  }();
  return index < 0 ? unmodelled : actors.at(static_cast<std::size_t>(index));
}

std::string Scene::knownActors() const {
  std::string known;
  for (const Actor& a : actors) known += (known.empty() ? "" : ", ") + a.name;
  return known.size() > 400 ? known.substr(0, 400) + ", ..." : known;
}

Scene loadScene(const std::string& scene_yaml, double frequency_hz) {
  YamlMap yaml = YamlMap::load(scene_yaml);
  Scene scene;
  scene.file = scene_yaml;
  if (yaml.has("facets")) {
    YamlMap facets = yaml.map("facets");
    if (facets.has("angle_deg")) scene.tolerance.angle_deg = facets.number("angle_deg", 0, 45);
    if (facets.has("offset_m")) scene.tolerance.offset_m = facets.number("offset_m", 0, 1);
    facets.rejectUnknownKeys();
  }
  const std::string materials_file = resolvePath(yaml.text("materials"), scene_yaml);
  const std::map<std::string, Material> materials = loadMaterials(materials_file);

  std::vector<YamlMap> meshes = yaml.maps("meshes");
  if (meshes.empty()) yaml.fail("meshes", "is an empty list; name at least one mesh file");
  std::map<std::string, std::string> seen;  // actor -> mesh file
  for (YamlMap& entry : meshes) {
    const std::string file = resolvePath(entry.text("file"), scene_yaml);
    const Eigen::Vector3d xyz_m = entry.has("xyz_m") ? triple(entry, "xyz_m", 1e6) : Eigen::Vector3d::Zero();
    const Eigen::Vector3d rpy_deg = entry.has("rpy_deg") ? triple(entry, "rpy_deg", 360) : Eigen::Vector3d::Zero();
    const double scale = entry.has("scale") ? entry.number("scale", 1e-6, 1e6) : 1.0;
    const MeshFrame frame = statedFrame(entry);
    entry.rejectUnknownKeys();
    const Eigen::Vector3d rpy = rpy_deg * M_PI / 180;
    const Eigen::Matrix3d R =
        (Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX()))
            .toRotationMatrix();
    for (Actor& actor : loadMesh(file, frame)) {
      if (actor.name.find_first_of(",;\n\"") != std::string::npos) {
        throw InputError(file + ": object name '" + actor.name + "' holds a comma, semicolon or quote; rename it");
      }
      const auto [other, fresh] = seen.emplace(actor.name, file);
      if (!fresh) {
        throw InputError(scene_yaml + ": key meshes: two actors are named " + actor.name + " (" + other->second +
                         " and " + file + "); rename one of the objects");
      }
      for (auto& v : actor.vertices) v = R * (scale * v) + xyz_m;
      actor.T_map_mesh.linear() = R;
      actor.T_map_mesh.translation() = xyz_m;
      scene.actors.push_back(std::move(actor));
    }
  }
  if (yaml.has("actors")) {
    YamlMap overrides = yaml.map("actors");
    for (const std::string& name : overrides.keys()) {
      const int index = scene.actorIndex(name);
      if (index < 0) overrides.fail(name, "is no actor of the meshes; known: " + scene.knownActors());
      YamlMap override_map = overrides.map(name);
      scene.actors[index].material_tag = override_map.text("material");
      override_map.rejectUnknownKeys();
    }
  }
  yaml.rejectUnknownKeys();
  for (Actor& actor : scene.actors) {
    const auto found = materials.find(actor.material_tag);
    if (found == materials.end()) {
      throw InputError(scene_yaml + ": actor " + actor.name + " has material '" + actor.material_tag + "', which " +
                       materials_file + " does not have (known: " + joined(materials) +
                       "); add it there, or set actors: {" + actor.name + ": {material: ...}}");
    }
    actor.material = found->second;
    checkBand(materials_file, actor.material, frequency_hz);
  }
  rebuildFacets(scene);
  return scene;
}

}  // namespace mmradartwin
