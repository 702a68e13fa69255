// The files that a twin which was changed by hand is made anew of.

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/what_if.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

void writeText(const std::string& file, const std::string& text) {
  fs::create_directories(fs::path(file).parent_path());
  std::ofstream out(file, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw InputError(file + ": cannot be written; check the folder and the free space");
}

}  // namespace

bool WhatIf::changesScene() const {
  if (state_.material_of != first_.material_of) return true;
  for (const auto& [name, material] : state_.materials) {
    const auto before = first_.materials.find(name);
    if (before == first_.materials.end() || !sameSurface(before->second, material)) return true;
  }
  return false;
}

std::vector<std::string> WhatIf::save(const std::string& folder, bool copy_meshes) const {
  std::vector<std::string> files;
  TwinDescription description = now_->description();
  if (changesScene()) {
    writeScene(folder, copy_meshes, files);
    description.scene_file = "scene.yaml";
  } else if (copy_meshes) {
    description.scene_file.clear();  // the session's
  }
  if (copy_meshes) description.radar_file.clear();
  std::string text = "# A twin tried by hand:";
  for (const std::string& words : edits()) text += "\n# - " + words;
  writeText(folder + "/twin.yaml", text + "\n" + description.toYaml());
  files.insert(files.begin(), "twin.yaml");
  return files;
}

void WhatIf::writeScene(const std::string& folder, bool copy_meshes, std::vector<std::string>& files) const {
  const std::string& given = given_->description().scene_file;
  std::map<std::string, std::string> copies;  // absolute path -> name in the folder
  if (copy_meshes) {
    for (const StoredFile& file : gatherSessionFiles(given)) {
      const std::string inside = (fs::path(given).parent_path() / file.name).lexically_normal().string();
      const bool mesh = file.name != fs::path(given).filename() && inside != materials_file_;
      if (!mesh) continue;
      writeText(folder + "/" + file.name, file.bytes);
      files.push_back(file.name);
      copies[inside] = file.name;
      if (const std::optional<std::string> absolute = absolutePathOf(file)) copies[*absolute] = file.name;
    }
  }
  YamlMap yaml = YamlMap::load(given);
  std::ostringstream scene;
  scene << "meshes:\n";
  for (YamlMap& mesh : yaml.maps("meshes")) {
    const std::string absolute = fs::path(resolvePath(mesh.text("file"), given)).lexically_normal().string();
    const auto copy = copies.find(absolute);
    scene << "  - {file: " << yamlText(copy == copies.end() ? absolute : copy->second);
    for (const std::string& key : mesh.keys()) {
      if (key != "file") scene << ", " << key << ": " << mesh.dump(key);
    }
    scene << "}\n";
  }
  scene << "materials: materials.yaml\n";
  if (yaml.has("facets")) {
    YamlMap facets = yaml.map("facets");
    scene << "facets:\n";
    for (const std::string& key : facets.keys()) scene << "  " << key << ": " << facets.dump(key) << "\n";
  }
  scene << "actors:\n";
  for (std::size_t i = 0; i < state_.material_of.size(); ++i) {
    scene << "  " << yamlText(given_->scene().actors[i].name) << ": {material: " << yamlText(state_.material_of[i])
          << "}\n";
  }
  std::ostringstream materials;
  materials << "materials:\n";
  for (const auto& [name, material] : state_.materials) {
    materials << "  " << yamlText(name) << ": " << toYaml(material) << "\n";
  }
  writeText(folder + "/scene.yaml", scene.str());
  writeText(folder + "/materials.yaml", materials.str());
  files.push_back("scene.yaml");
  files.push_back("materials.yaml");
}

}  // namespace mmradartwin
