// make_scene: mesh files of a person's own room -> scene.yaml and materials.yaml to edit.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_sim/mesh_frame.h"
#include "mmradartwin_sim/scene.h"

namespace fs = std::filesystem;
using namespace mmradartwin;

namespace {

struct Options {
  std::vector<std::string> meshes;
  OutputArguments output;
  std::string material = "Concrete";
  double scale = 1;
  bool y_up = false;
  std::string unit;
};

struct Preset {
  const char* tag;
  const char* yaml;
  std::vector<const char*> words;  // in names of actors and tags, lower case
};

// The shipped physical table's values (ITU-R P.2040 at 77 GHz), and the words by which people name such things.
const std::vector<Preset>& presets() {
  static const std::vector<Preset> list = {
      {"Metal",
       "{model: conductor, color: [0.55, 0.60, 0.68]}",
       {"metal", "steel", "alumin", "iron", "radiator", "cabinet", "locker", "fridge"}},
      {"Glass",
       "{model: dielectric, relative_permittivity: 6.31, conductivity_s_per_m: 1.211, color: [0.55, 0.80, 0.88]}",
       {"glass", "window", "mirror", "screen", "monitor", "tv", "display"}},
      {"Wood",
       "{model: dielectric, relative_permittivity: 1.99, conductivity_s_per_m: 0.494, color: [0.62, 0.43, 0.24]}",
       {"wood", "door", "shelf", "bookcase", "wardrobe", "drawer", "chair"}},
      {"TableTop",
       "{model: dielectric, relative_permittivity: 2.58, conductivity_s_per_m: 0.643, color: [0.80, 0.68, 0.50]}",
       {"table", "desk", "counter", "worktop"}},
      {"Carpet",
       "{model: dielectric, relative_permittivity: 2.08, conductivity_s_per_m: 0.0317, scattering_coefficient: 0.4, "
       "extrapolated: true, color: [0.38, 0.42, 0.55]}",
       {"carpet", "rug", "sofa", "couch", "curtain", "fabric", "cushion", "bed"}},
      {"Plastic",
       "{model: dielectric, relative_permittivity: 2.57, conductivity_s_per_m: 0.49, color: [0.85, 0.85, 0.80]}",
       {"plastic", "acryl", "bin", "printer"}},
      {"Plasterboard",
       "{model: dielectric, relative_permittivity: 2.73, conductivity_s_per_m: 0.503, scattering_coefficient: 0.2, "
       "color: [0.88, 0.87, 0.84]}",
       {"plaster", "gypsum", "drywall", "partition"}},
      {"Concrete",
       "{model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38, scattering_coefficient: 0.5, "
       "color: [0.70, 0.69, 0.66]}",
       {"concrete", "wall", "floor", "ceiling", "column", "pillar", "cement"}}};
  return list;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// The preset whose tag or words occur in a name, or null.
const Preset* guess(const std::string& name) {
  const std::string text = lower(name);
  for (const Preset& p : presets()) {
    if (text == lower(p.tag)) return &p;
  }
  for (const Preset& p : presets()) {
    if (std::any_of(p.words.begin(), p.words.end(),
                    [&text](const char* w) { return text.find(w) != std::string::npos; }))
      return &p;
  }
  return nullptr;
}

const Preset& find(const std::string& tag) {
  for (const Preset& p : presets()) {
    if (tag == p.tag) return p;
  }
  throw InputError("--material " + tag +
                   ": unknown; known: Metal, Glass, Wood, TableTop, Carpet, Plastic, Plasterboard, Concrete");
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

/// What the options state of a mesh that does not declare it itself: its frame, and as keys of its entry.
struct StatedFrame {
  MeshFrame frame;
  std::string keys;
};

StatedFrame statedFrame(const Options& options, const std::string& mesh) {
  StatedFrame stated;
  const std::string extension = lower(fs::path(mesh).extension().string());
  for (const char* declaring : {".gltf", ".glb", ".dae", ".zae", ".fbx"}) {
    if (extension == declaring) return stated;
  }
  if (options.y_up) {
    stated.frame.y_up = true;
    stated.keys += ", up: y";
  }
  if (!options.unit.empty()) {
    stated.frame.unit_m = options.unit == "mm" ? 1e-3 : options.unit == "cm" ? 1e-2 : 1.0;
    stated.keys += ", unit: " + options.unit;
  }
  return stated;
}

int makeScene(const Options& options) {
  const Preset& fallback = find(options.material);
  Output output = Output::folder(options.output, options.meshes, "scene.yaml");
  const fs::path folder(output.path()), scene_file = folder / "scene.yaml", materials_file = folder / "materials.yaml";
  std::map<std::string, std::string> overrides;  // actor -> tag
  std::set<std::string> used, actors;
  std::ostringstream meshes;
  Eigen::AlignedBox3d bounds;
  std::size_t triangles = 0;
  for (const std::string& mesh : options.meshes) {
    std::string path = fs::proximate(fs::weakly_canonical(mesh), output.place()).string();
    const StatedFrame stated = statedFrame(options, mesh);
    meshes << "  - {file: " << quoted(path) << stated.keys
           << ", xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0], scale: " << options.scale << "}\n";
    for (const Actor& actor : loadMesh(mesh, stated.frame)) {
      if (!actors.insert(actor.name).second)
        throw InputError(mesh + ": a second actor is named " + actor.name + "; rename the object or the file");
      for (const auto& v : actor.vertices) bounds.extend(options.scale * v);
      triangles += actor.triangles.size();
      const Preset* by_tag = guess(actor.material_tag);
      const Preset* by_name = by_tag ? by_tag : guess(actor.name);
      const Preset& preset = by_name ? *by_name : fallback;
      used.insert(preset.tag);
      if (actor.material_tag != preset.tag) overrides[actor.name] = preset.tag;
      const std::string choice = "actor " + actor.name + ", material tag '" + actor.material_tag + "' -> " + preset.tag;
      if (by_name) {
        note(choice + (by_tag ? "" : " (by the actor's name)"));
      } else {
        std::cerr << "warning: " << choice << " (nothing tells: edit scene.yaml)\n";
      }
    }
  }
  std::ofstream scene(scene_file);
  scene << "# Lengths in metres, z up, floor near z = 0. p_map = Rz*Ry*Rx*(scale*p) + xyz_m.\n"
        << "# As it stands the scene spans " << std::fixed << std::setprecision(2) << bounds.min().x() << ".."
        << bounds.max().x() << " m, " << bounds.min().y() << ".." << bounds.max().y() << " m, " << bounds.min().z()
        << ".." << bounds.max().z() << " m.\n"
        << "meshes:\n"
        << meshes.str() << "materials: materials.yaml\n";
  if (triangles > 5000) {
    scene << "# Triangles of a scan are one facet within these limits; wider ones give larger facets.\n"
          << "facets: {angle_deg: 35, offset_m: 0.05}\n";
  }
  if (!overrides.empty()) {
    scene << "# What each actor is made of; every tag must stand in materials.yaml.\nactors:\n";
    for (const auto& [actor, tag] : overrides) scene << "  " << quoted(actor) << ": {material: " << tag << "}\n";
  }
  std::ofstream materials(materials_file);
  materials << "# Constants at 77 GHz from ITU-R P.2040; Carpet and Plastic lie outside the recommendation's range or "
               "list.\nmaterials:\n";
  for (const std::string& tag : used) materials << "  " << tag << ": " << find(tag).yaml << "\n";
  scene.close();
  materials.close();
  if (!scene || !materials) throw std::runtime_error(output.name() + ": cannot be written; check the free space");
  output.complete();
  const fs::path named(output.name());
  std::cout << actors.size() << " actor(s), " << triangles << " triangles: edit " << (named / "scene.yaml").string()
            << " and " << (named / "materials.yaml").string() << "\n";
  if (bounds.sizes().maxCoeff() > 200 || bounds.sizes().maxCoeff() < 0.5) {
    std::cerr << "warning: the scene is " << bounds.sizes().maxCoeff() << " m across; is --unit or --scale right?\n";
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Begins a scene from your own meshes: writes scene.yaml and materials.yaml to edit.");
  app.add_option("MESH", options.meshes, "OBJ, PLY, STL, glTF, Collada or FBX files")->required();
  addOutputArguments(app, options.output, "folder for scene.yaml and materials.yaml");
  app.add_option("--unit", options.unit, "of meshes that declare none: m, mm or cm")
      ->check(CLI::IsMember({"m", "mm", "cm"}));
  app.add_option("--scale", options.scale, "factor on the meshes, beyond their unit")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--material", options.material, "of actors that neither tag nor name explains")->capture_default_str();
  app.add_flag("--y-up", options.y_up, "meshes that declare no axes are y-up (glTF, Collada and FBX declare them)");
  app.footer("Example: make_scene room.obj --output my_room --unit mm");
  return runProgram(app, argc, argv, [&options] { return makeScene(options); });
}
