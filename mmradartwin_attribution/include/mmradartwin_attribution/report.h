#pragma once

#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_attribution/evaluation.h"

namespace mmradartwin {

/// A file that a result depends on.
struct InputFile {
  std::string file;
  std::string sha256;  ///< hexadecimal
};

/// Files behind a recording and a model: all of a session directory or the bag, scene, its meshes and materials, radar
/// and twin. Files that are missing are left out (their absence is an error elsewhere).
std::vector<std::string> inputFiles(const std::string& recording_path, const Recording& recording,
                                    const std::vector<std::string>& more);
/// Reads and hashes files, several at a time, in the given order. Throws InputError for one that cannot be read.
std::vector<InputFile> hashFiles(const std::vector<std::string>& files);

/// Description of a run that stands beside its results, so that the run can be repeated.
struct RunDescription {
  std::vector<std::string> command;
  std::string recording;                                ///< as given
  std::string simulated;                                ///< "twin", or the path of the simulated session
  std::string version;                                  ///< git describe at configure time, or the package's version
  std::string attribution_yaml, radar_yaml, twin_yaml;  ///< resolved; twin empty where there is none
  std::vector<InputFile> inputs;
};

std::string packageVersion();

/// Writes into `directory`: table.txt, poses.csv, residuals.csv, regions.csv, summary.json, attribution.yaml,
/// radar.yaml, twin.yaml and index.html. Pictures are expected under pictures/{pose}.png and coverage.png.
class ReportWriter {
 public:
  /// Creates the directory and pictures/ in it. Throws InputError where that is not possible.
  explicit ReportWriter(const std::string& directory);
  const std::string& directory() const { return directory_; }
  std::string pictureFile(const std::string& pose) const;
  void write(const Evaluation& evaluation, const AttributionConfig& config, const RunDescription& run) const;

 private:
  void writePoses(const Evaluation& evaluation, const AttributionConfig& config) const;
  void writeResiduals(const Evaluation& evaluation) const;
  void writeRegions(const Evaluation& evaluation) const;
  void writeSummary(const Evaluation& evaluation, const AttributionConfig& config, const RunDescription& run) const;
  void writeHtml(const Evaluation& evaluation, const AttributionConfig& config, const RunDescription& run) const;

  std::string directory_;
};

/// All that is printed: the table, the outer field, duplicates, convention validation.
std::string reportText(const Evaluation& evaluation, const AttributionConfig& config);

}  // namespace mmradartwin
