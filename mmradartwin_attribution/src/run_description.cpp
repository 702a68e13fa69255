#include "mmradartwin_attribution/run_description.h"

#include <tbb/parallel_for.h>

#include <filesystem>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program_version.h"
#include "mmradartwin_dsp/sha256.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

// Meshes and materials that a scene names. A scene that cannot be read is reported where it is loaded, not here.
void addSceneFiles(const std::string& scene_file, std::vector<std::string>& files) {
  files.push_back(scene_file);
  try {
    YamlMap scene = YamlMap::load(scene_file);
    if (scene.has("materials")) files.push_back(resolvePath(scene.text("materials"), scene_file));
    if (scene.has("meshes")) {
      for (YamlMap& mesh : scene.maps("meshes")) files.push_back(resolvePath(mesh.text("file"), scene_file));
    }
  } catch (const InputError&) {
  }
}

}  // namespace

std::string packageVersion() { return programVersion(); }

std::vector<std::string> inputFiles(const std::string& recording_path, const Recording& recording,
                                    const std::vector<std::string>& more) {
  std::vector<std::string> files;
  fs::path path(recording_path);
  if (path.filename() == "session.yaml") path = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  if (fs::is_directory(path, error)) {
    for (const char* name : {"session.yaml", "radar.yaml", "poses.csv"}) files.push_back((path / name).string());
    std::set<std::string> captures;
    for (const auto& entry : fs::directory_iterator(path / "captures", error)) {
      if (entry.is_regular_file(error)) captures.insert(entry.path().string());
    }
    files.insert(files.end(), captures.begin(), captures.end());
  } else {
    files.push_back(path.string());
  }
  if (fs::is_regular_file(recording.radar_file, error)) files.push_back(recording.radar_file);
  if (recording.scene_file) addSceneFiles(*recording.scene_file, files);
  if (recording.twin_file) files.push_back(*recording.twin_file);
  for (const std::string& file : more) {
    if (file.size() > 10 && fs::path(file).filename() == "scene.yaml") {
      addSceneFiles(file, files);
    } else {
      files.push_back(file);
    }
  }
  std::vector<std::string> result;
  std::set<std::string> seen;
  for (const std::string& file : files) {
    if (file.empty() || !fs::is_regular_file(file, error) || TemporaryFolder::holds(file)) continue;
    if (seen.insert(fs::weakly_canonical(file, error).string()).second) result.push_back(file);
  }
  return result;
}

std::vector<InputFile> hashFiles(const std::vector<std::string>& files) {
  std::vector<InputFile> result(files.size());
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t i) {
    result[i] = {files[i], sha256OfFile(files[i])};
  });
  return result;
}

}  // namespace mmradartwin
