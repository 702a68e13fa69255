// make_scene: a person's own room -> a scene to edit. A scan becomes planes and things; a mesh with named parts stays
// as it is and gets materials by their names.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/material_presets.h"
#include "mmradartwin_sim/mesh_frame.h"
#include "mmradartwin_sim/scan_objects.h"
#include "mmradartwin_sim/scan_quality.h"
#include "mmradartwin_sim/scan_refinement.h"
#include "mmradartwin_sim/scan_to_scene.h"
#include "mmradartwin_sim/scene.h"

namespace fs = std::filesystem;
using namespace mmradartwin;

namespace {

struct Options {
  std::vector<std::string> meshes;
  ScanOptions scan;
  bool planes = false, model = false, no_regularise = false, exact_up = false;
  std::string up;
  double floor_m = std::nan("");
  OutputArguments output;
  std::string material = "Concrete";
  double scale = 1;
  bool y_up = false;
  std::string unit;
  std::string refine;
  std::string objects;
  std::string things = "shapes";
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

const MaterialPreset& find(const std::string& tag) {
  for (const MaterialPreset& p : materialPresets()) {
    if (tag == p.tag) return p;
  }
  throw InputError("--material " + tag +
                   ": unknown; known: Metal, Glass, Wood, TableTop, Carpet, Plastic, Plasterboard, Concrete");
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

int makeModelScene(const Options& options) {
  const MaterialPreset& fallback = find(options.material);
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
    meshes << "  - {file: " << yamlText(path) << stated.keys
           << ", xyz_m: [0, 0, 0], rpy_deg: [0, 0, 0], scale: " << options.scale << "}\n";
    for (const Actor& actor : loadMesh(mesh, stated.frame)) {
      if (!actors.insert(actor.name).second)
        throw InputError(mesh + ": a second actor is named " + actor.name + "; rename the object or the file");
      for (const auto& v : actor.vertices) bounds.extend(options.scale * v);
      triangles += actor.triangles.size();
      const MaterialPreset* by_tag = presetOfName(actor.material_tag);
      const MaterialPreset* by_name = by_tag ? by_tag : presetOfName(actor.name);
      const MaterialPreset& preset = by_name ? *by_name : fallback;
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
    for (const auto& [actor, tag] : overrides) scene << "  " << yamlText(actor) << ": {material: " << tag << "}\n";
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

Eigen::Vector3d axisNamed(const std::string& name) {
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  axis[name.back() - 'x'] = name.size() > 1 ? -1 : 1;
  return axis;
}

double metresPer(const std::string& unit) { return unit == "mm" ? 1e-3 : unit == "cm" ? 1e-2 : 1.0; }

/// An older scene.yaml of the output's folder, which a person may have edited.
std::string olderScene(const Options& options) {
  const fs::path older = fs::path(options.output.path) / "scene.yaml";
  std::error_code error;
  return fs::is_regular_file(older, error) ? older.string() : "";
}

void sayScene(const ScanScene& scene, const StatedAccuracy& accuracy) {
  std::size_t triangles = 0;
  for (const ScanActor& actor : scene.actors) triangles += actor.triangles.size();
  std::cout << scene.frame.words << "\n" << std::fixed << std::setprecision(1);
  for (const ScanPlane& p : scene.planes) {
    std::cout << p.name << ": " << p.area_m2 << " m2, residual " << 1e3 * p.rms_m << " mm rms, 99 % within "
              << 1e3 * p.largest_m << " mm";
    if (!p.holes.empty()) std::cout << ", " << p.holes.size() << " opening(s)";
    std::cout << "\n";
  }
  for (const ScanThing& t : scene.things) {
    const Eigen::Vector3d size = t.bounds.sizes();
    std::cout << t.name << ": " << std::setprecision(2) << size.x() << " x " << size.y() << " x " << size.z() << " m"
              << (t.why.empty() ? "" : " (" + t.why + ")") << std::setprecision(1) << "\n";
  }
  std::cout << scene.planes.size() << " plane(s), " << scene.things.size() << " thing(s), " << triangles
            << " triangles; state in session.yaml: accuracy: {scene_m: " << std::setprecision(4) << accuracy.scene_m
            << ", level_db: " << std::setprecision(1) << accuracy.level_db << ", path_range_m: " << std::setprecision(4)
            << accuracy.path_range_m << ", path_angle_deg: " << std::setprecision(2) << accuracy.path_angle_deg
            << "}\n";
}

int makeScanScene(const Options& options) {
  if (options.meshes.size() > 1)
    throw InputError("one scan makes a scene; " + std::to_string(options.meshes.size()) + " files are given");
  const std::string older = olderScene(options);
  ProgressLine progress;
  ScanOptions scan_options = options.scan;
  scan_options.progress = [&progress](double share, const std::string& stage) { progress.show(share, stage); };
  if (!options.unit.empty()) scan_options.unit_m = metresPer(options.unit);
  if (options.scale != 1) scan_options.unit_m = scan_options.unit_m.value_or(1) * options.scale;
  if (options.y_up) scan_options.up = Eigen::Vector3d::UnitY();
  if (!options.up.empty()) scan_options.up = axisNamed(options.up);
  if (!std::isnan(options.floor_m)) scan_options.floor_m = options.floor_m;
  scan_options.level = !options.exact_up;
  scan_options.regularise = !options.no_regularise;
  if (options.things == "boxes") scan_options.things = ThingForms::kBoxes;
  if (options.things == "meshes") scan_options.things = ThingForms::kMeshes;
  std::vector<std::string> inputs = options.meshes;
  if (!options.objects.empty()) {
    progress.show(0, "objects");
    inputs.push_back(options.objects);
    scan_options.objects = readScanObjects(options.objects);
    for (const ScanObject& object : scan_options.objects) inputs.push_back(object.scan.file);
  }
  Output output = Output::folder(options.output, inputs, "scene.yaml");
  progress.show(0, "reading");
  const RawScan scan = readScan(options.meshes.front());
  ScanScene scene = sceneOfScan(scan, scan_options);
  if (!options.refine.empty()) {
    const std::vector<MeasuredRange> ranges = readRefinement(options.refine);
    scan_options.shifts = shiftsOf(scene, ranges, options.refine);
    const std::vector<std::string> moved = refinementNotes(scene, ranges);
    scene = sceneOfScan(scan, scan_options);
    const std::vector<std::string> things = moveThings(ranges, scene);
    scene.notes.insert(scene.notes.begin(), things.begin(), things.end());
    scene.notes.insert(scene.notes.begin(), moved.begin(), moved.end());
  }
  const StatedAccuracy accuracy = writeScanScene(scene, output.path(), older);
  progress.show(0, "checks");
  const ScanQuality quality = checkScanScene(scene);
  writeScanQuality(scene, quality, output.path());
  progress.clear();
  output.complete();
  sayScene(scene, accuracy);
  noteAll(scene.notes);
  noteAll(qualityNotes(quality));
  return 0;
}

int makeScene(const Options& options) {
  const bool scan = options.planes || (!options.model && isScan(options.meshes.front()));
  note(options.meshes.front() + (scan
                                     ? ": taken as a scan: planes and things are made of it (--model takes it as it is)"
                                     : ": taken as a model with named parts (--planes makes planes and things of it)"));
  if (!scan && !options.refine.empty()) {
    throw InputError("--refine " + options.refine +
                     ": moves walls and things of scans alone; give --planes to take the model as a scan");
  }
  if (!scan && !options.objects.empty()) {
    throw InputError("--objects " + options.objects +
                     ": replaces things of scans alone; give --planes to take the model as a scan");
  }
  return scan ? makeScanScene(options) : makeModelScene(options);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Makes a scene of your own room: planes and things of a scan, or a model's parts as they are.");
  app.add_option("SCAN", options.meshes, "a scan (PLY, OBJ, STL, glTF, PCD, XYZ), or models with named parts")
      ->required();
  addOutputArguments(app, options.output, "folder for room.obj, scene.yaml and materials.yaml");
  app.add_option("--unit", options.unit, "of files that declare none: m, mm or cm; of a scan, found from its size")
      ->check(CLI::IsMember({"m", "mm", "cm"}));
  app.add_option("--scale", options.scale, "factor on the coordinates, beyond their unit")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--material", options.material, "of a model's actors that neither tag nor name explains")
      ->capture_default_str();
  app.add_flag("--y-up", options.y_up, "files that declare no axes are y-up (glTF, Collada and FBX declare them)");
  app.add_flag("--planes", options.planes, "take it as a scan, whatever its parts");
  app.add_flag("--model", options.model, "take it as a model, however many triangles")->excludes("--planes");
  app.add_option("--up", options.up, "axis of the scan's file that is up, about; found from its planes")
      ->check(CLI::IsMember({"x", "y", "z", "-x", "-y", "-z"}));
  app.add_flag("--exact-up", options.exact_up, "that axis is up exactly: nothing is turned by floor and walls")
      ->needs("--up");
  app.add_option("--floor", options.floor_m,
                 "height of the floor above the file's origin, metres; found from its planes");
  app.add_flag("--no-regularise", options.no_regularise,
               "leave planes that are parallel or at right angles within noise");
  app.add_option("--triangles", options.scan.triangles, "of all things that are meshes together, at most")
      ->check(CLI::Range(100, 1000000))
      ->capture_default_str();
  app.add_option("--silhouette", options.scan.silhouette_m, "metres within which fewer triangles leave silhouettes")
      ->check(CLI::Range(0.001, 0.1))
      ->capture_default_str();
  app.add_option(
      "--objects", options.objects,
      "objects.yaml: things that were scanned by themselves, with their poses; they replace what they overlap");
  app.add_option(
      "--refine", options.refine,
      "refinement.yaml of refine_scene, or its folder: walls and things move to where a radar in the room has them");
  app.add_option("--things", options.things,
                 "shapes: the simplest that fit, meshes where none does; boxes: boxes and cylinders alone, for fast "
                 "simulations; meshes: the scan's own triangles, thinned by --triangles and --silhouette")
      ->check(CLI::IsMember({"shapes", "boxes", "meshes"}))
      ->capture_default_str();
  app.footer("Example: make_scene phone_scan.ply --output my_room");
  return runProgram(app, argc, argv, [&options] { return makeScene(options); });
}
