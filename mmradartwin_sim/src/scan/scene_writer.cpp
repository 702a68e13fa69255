#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/material_presets.h"
#include "mmradartwin_sim/scan_to_scene.h"
#include "scan/scan_accuracy.h"

namespace mmradartwin {
namespace {

constexpr const char* kProposed = "# proposed ";  // what follows is the tag that no person has chosen
constexpr const char* kOfPerson = "; a person's";

template <typename... Numbers>
std::string formatted(const char* format, Numbers... numbers) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), format, numbers...);
  return text.data();
}

void writeObj(const ScanScene& scene, const std::string& file) {
  std::ofstream out(file);
  out << "# Written by make_scene from a scan: metres, z up, floor at 0.\n";
  int base = 1;
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const ScanActor& actor = scene.actors[a];
    if (actor.triangles.empty()) continue;
    out << "o " << actor.name << "\nusemtl " << scene.materials[a].tag << "\n";
    for (const Eigen::Vector3d& v : actor.vertices) out << formatted("v %.6f %.6f %.6f\n", v.x(), v.y(), v.z());
    for (const auto& t : actor.triangles) out << formatted("f %d %d %d\n", base + t[0], base + t[1], base + t[2]);
    base += static_cast<int>(actor.vertices.size());
  }
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written; check the free space");
}

/// Not as input of the run, which its output replaces.
std::string textOfOlder(const std::string& file) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// What a person has made of an older scene: actors whose material is another than the one proposed then, or without
/// the comment that says what was proposed.
std::map<std::string, std::string> editedMaterials(const std::string& scene_yaml) {
  std::map<std::string, std::string> edited, proposed;
  const std::string whole = textOfOlder(scene_yaml);
  std::istringstream text(whole);
  std::string row;
  while (std::getline(text, row)) {
    const std::size_t comment = row.find(kProposed), colon = row.find(':');
    if (comment == std::string::npos || colon == std::string::npos || row.find(kOfPerson) != std::string::npos)
      continue;
    std::string name = row.substr(0, colon), tag;
    name.erase(0, name.find_first_not_of(" \""));
    while (!name.empty() && (name.back() == '"' || name.back() == ' ')) name.pop_back();
    std::istringstream(row.substr(comment + std::string(kProposed).size())) >> tag;
    if (!tag.empty() && tag.back() == ',') tag.pop_back();
    proposed[name] = tag;
  }
  YamlMap older = YamlMap::parse(whole, scene_yaml);
  if (!older.has("actors")) return edited;
  YamlMap actors = older.map("actors");
  for (const std::string& name : actors.keys()) {
    YamlMap actor = actors.map(name);
    if (!actor.has("material")) continue;
    const std::string tag = actor.text("material");
    const auto was = proposed.find(name);
    if (was == proposed.end() || was->second != tag) edited[name] = tag;
  }
  return edited;
}

/// Lines of an older materials.yaml, by material; a person may have measured them.
std::map<std::string, std::string> olderMaterials(const std::string& materials_yaml) {
  std::map<std::string, std::string> lines;
  std::error_code error;
  if (!std::filesystem::is_regular_file(materials_yaml, error)) return lines;
  YamlMap materials = YamlMap::parse(textOfOlder(materials_yaml), materials_yaml).map("materials");
  for (const std::string& tag : materials.keys()) lines[tag] = materials.dump(tag);
  return lines;
}

std::string wordOf(ThingShape shape) {
  switch (shape) {
    case ThingShape::kBox:
      return "box";
    case ThingShape::kCylinder:
      return "cylinder";
    case ThingShape::kSphere:
      return "sphere";
    case ThingShape::kPlate:
      return "plate";
    case ThingShape::kMesh:
      return "mesh";
  }
  return "";
}

std::string wordOf(PlaneKind kind) {
  switch (kind) {
    case PlaneKind::kFloor:
      return "floor";
    case PlaneKind::kCeiling:
      return "ceiling";
    case PlaneKind::kWall:
      return "wall";
    case PlaneKind::kDoor:
      return "door";
    case PlaneKind::kWindow:
      return "window";
    case PlaneKind::kPanel:
      return "panel";
  }
  return "";
}

/// What a scan tells of the accuracy, as session.yaml takes it.
std::string accuracyText(const StatedAccuracy& a) {
  return formatted("accuracy: {scene_m: %.4f, level_db: %.1f, path_range_m: %.4f, path_angle_deg: %.2f}", a.scene_m,
                   a.level_db, a.path_range_m, a.path_angle_deg);
}

/// With the materials that a person has chosen known.
StatedAccuracy accuracyWith(const ScanScene& scene, const std::map<std::string, std::string>& edited) {
  std::vector<MaterialProposal> materials = scene.materials;
  for (MaterialProposal& p : materials) {
    if (edited.count(p.actor)) p.level_std_db = 0;
  }
  StatedAccuracy accuracy = scene.accuracy;
  accuracy.level_db = levelAccuracy_db(materials);
  return accuracy;
}

void writeScene(const ScanScene& scene, const StatedAccuracy& accuracy, const std::string& file,
                const std::map<std::string, std::string>& edited, std::set<std::string>& used) {
  std::ofstream out(file);
  out << "# Made by make_scene from a scan: " << scene.frame.words << ".\n"
      << "# Lengths in metres, z up, floor at 0. How the scan became this stands in scan.yaml.\n"
      << "# A session in this room states how well it is known, in session.yaml:\n"
      << "#   " << accuracyText(accuracy) << "\n";
  for (const std::string& note : scene.notes) out << "# " << note << ".\n";
  out << "meshes:\n  - {file: room.obj}\nmaterials: materials.yaml\n"
      << "# Change a material here; the next run of make_scene keeps it. Take the comment away where you know it to be "
         "right.\nactors:\n";
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const MaterialProposal& p = scene.materials[a];
    if (scene.actors[a].triangles.empty()) continue;
    const auto person = edited.find(p.actor);
    const std::string& tag = person == edited.end() ? p.tag : person->second;
    used.insert(tag);
    out << "  " << p.actor << ": {material: " << tag << "}  " << kProposed << p.tag
        << (p.unknown ? ", unknown" : formatted(", confidence %.2f", p.confidence)) << " (" << p.source << ")";
    if (person != edited.end()) out << kOfPerson;
    out << "\n";
  }
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written; check the free space");
}

void writeMaterials(const std::string& file, const std::set<std::string>& used,
                    std::map<std::string, std::string> lines) {
  std::ofstream out(file);
  out << "# Constants at 77 GHz from ITU-R P.2040; Carpet and Plastic lie outside the recommendation's range or list.\n"
      << "materials:\n";
  for (const std::string& tag : used) {
    if (lines.count(tag)) continue;
    for (const MaterialPreset& p : materialPresets()) {
      if (tag == p.tag) lines[tag] = p.yaml;
    }
    if (!lines.count(tag))
      throw InputError("scene.yaml names material " + tag + ", which materials.yaml does not have; add it there");
  }
  for (const auto& [tag, text] : lines) out << "  " << tag << ": " << text << "\n";
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written; check the free space");
}

void writeFrame(const ScanFrame& f, std::ofstream& out) {
  out << "words: \"" << f.words << "\"\n"
      << formatted("unit_m: %.6g\n", f.unit_m)
      << formatted("up: [%.7f, %.7f, %.7f]          # in axes of the file\n", f.up.x(), f.up.y(), f.up.z())
      << formatted("tilt_deg: %.4f\ntilt_std_deg: %.4f\n", f.tilt_deg, f.tilt_std_deg)
      << formatted("floor_m: %.5f                    # above the file's origin, along up\n", f.floor_m)
      << "T_map_file:                          # p_map = T * (unit_m * p_file)\n";
  for (int i = 0; i < 3; ++i) {
    out << formatted("  - [%.15g, %.15g, %.15g, %.15g]\n", f.T_map_file(i, 0), f.T_map_file(i, 1), f.T_map_file(i, 2),
                     f.T_map_file(i, 3));
  }
  if (f.has_ceiling) out << formatted("ceiling_m: %.5f\n", f.ceiling_m);
  out << formatted("noise_m: %.5f\nspacing_m: %.4f\n", f.noise_m, f.spacing_m);
}

/// What a program that reads the result wants to know.
void writeSummary(const ScanScene& scene, const StatedAccuracy& accuracy, const std::string& file) {
  std::ofstream out(file);
  out << "# How a scan became room.obj. Lengths in metres, areas in square metres.\n";
  writeFrame(scene.frame, out);
  out << "# For session.yaml. It does not cover what was not scanned, or left out.\n"
      << accuracyText(accuracy) << "\n"
      << formatted(
             "areas: {scanned_m2: %.3f, on_planes_m2: %.3f, on_things_m2: %.3f, left_out_m2: %.3f, wall_m2: %.3f, "
             "wall_on_planes_m2: %.3f}\n",
             scene.scanned_m2, scene.on_planes_m2, scene.on_things_m2, scene.left_out_m2, scene.wall_m2,
             scene.wall_on_planes_m2)
      << "planes:\n";
  for (const ScanPlane& p : scene.planes) {
    out << "  - {name: " << p.name << ", kind: " << wordOf(p.kind)
        << formatted(", normal: [%.7f, %.7f, %.7f], offset_m: %.5f, area_m2: %.3f, covered_m2: %.3f, ", p.normal.x(),
                     p.normal.y(), p.normal.z(), p.offset_m, p.area_m2, p.covered_m2)
        << formatted(
               "rms_m: %.5f, largest_m: %.5f, bow_m: %.5f, angle_std_deg: %.4f, turned_deg: %.4f, openings: %d}\n",
               p.rms_m, p.largest_m, p.bow_m, p.angle_std_deg, p.turned_deg, static_cast<int>(p.holes.size()));
  }
  out << "things:\n";
  for (const ScanThing& t : scene.things) {
    const Eigen::Vector3d low = t.bounds.min(), high = t.bounds.max();
    out << "  - {name: " << t.name << ", class: " << t.klass << formatted(", confidence: %.2f", t.class_confidence)
        << ", why: \"" << t.why << "\", shape: " << wordOf(t.shape)
        << ", watertight: " << (t.watertight ? "true" : "false")
        << formatted(", low_m: [%.3f, %.3f, %.3f], high_m: [%.3f, %.3f, %.3f]", low.x(), low.y(), low.z(), high.x(),
                     high.y(), high.z())
        << formatted(", rms_m: %.4f, largest_m: %.4f, range_std_m: %.4f, triangles: %d}\n", t.rms_m, t.largest_m,
                     t.range_std_m, static_cast<int>(t.triangles.size()));
  }
  if (!out.flush()) throw std::runtime_error(file + ": cannot be written; check the free space");
}

}  // namespace

StatedAccuracy writeScanScene(const ScanScene& scene, const std::string& folder, const std::string& edited_scene_yaml) {
  const std::filesystem::path place(folder);
  std::map<std::string, std::string> edited, lines;
  if (!edited_scene_yaml.empty()) {
    edited = editedMaterials(edited_scene_yaml);
    lines = olderMaterials((std::filesystem::path(edited_scene_yaml).parent_path() / "materials.yaml").string());
  }
  std::set<std::string> used;
  writeObj(scene, (place / "room.obj").string());
  const StatedAccuracy accuracy = accuracyWith(scene, edited);
  writeScene(scene, accuracy, (place / "scene.yaml").string(), edited, used);
  writeMaterials((place / "materials.yaml").string(), used, lines);
  writeSummary(scene, accuracy, (place / "scan.yaml").string());
  return accuracy;
}

}  // namespace mmradartwin
