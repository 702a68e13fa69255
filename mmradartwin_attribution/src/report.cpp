#include "mmradartwin_attribution/report.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

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

ReportWriter::ReportWriter(const std::string& directory) : directory_(directory) {
  std::error_code error;
  fs::create_directories(fs::path(directory) / "pictures", error);
  if (error) {
    throw InputError(directory + ": cannot be created (" + error.message() + "); choose another --output");
  }
}

std::string ReportWriter::pictureFile(const std::string& pose) const {
  std::string name = pose;  // a pose is any string: keep it inside the folder
  std::replace(name.begin(), name.end(), '/', '_');
  return directory_ + "/pictures/" + name + ".png";
}

std::string reportText(const Evaluation& evaluation, const AttributionConfig& config) {
  std::ostringstream s;
  const auto deg = [](double rad) { return std::to_string(static_cast<int>(std::lround(rad * 180 / M_PI))); };
  const std::string max = deg(config.max_azimuth_rad), outer = deg(config.outer_azimuth_rad);
  s << formatTable(evaluation.central, config,
                   "Evaluation summary in the central usable field of view, +-" + max + " deg, " +
                       std::to_string(evaluation.central.poses) + " poses");
  s << "Residuals: " << evaluation.central.class_count[0] << " C1, " << evaluation.central.class_count[1] << " C2, "
    << evaluation.central.class_count[2] << " C3, " << evaluation.central.class_count[3] << " C4, "
    << evaluation.central.class_count[4] << " C5\n";
  s << "Apart, " << max << "-" << outer << " deg (not routed): " << metricsLine(evaluation.outer) << "\n";
  s << "Convention: the conjugated measurement would agree better in " << evaluation.conjugated_better << " of "
    << evaluation.central.poses << " poses\n";
  s << "Duplicates excluded: " << evaluation.duplicates.size();
  for (std::size_t i = 0; i < evaluation.duplicates.size(); ++i) s << (i ? ", " : " (") << evaluation.duplicates[i];
  s << (evaluation.duplicates.empty() ? "\n" : ")\n");
  if (!evaluation.problems.empty()) {
    s << "Not used: " << evaluation.problems.size() << " poses (";
    for (std::size_t i = 0; i < evaluation.problems.size(); ++i) s << (i ? ", " : "") << evaluation.problems[i].pose;
    s << ")\n";
  }
  return s.str();
}

}  // namespace mmradartwin
