#pragma once

#include <memory>
#include <string>

#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/pose_picture.h"
#include "mmradartwin_attribution/run_description.h"

namespace mmradartwin {

/// Writes into `directory`: table.txt, poses.csv, residuals.csv, regions.csv, summary.json, attribution.yaml,
/// radar.yaml, twin.yaml and report.html, which holds all that it shows.
class ReportWriter {
 public:
  /// Creates the directory and pictures/ in it. templates: folder with templates that take the place of those of the
  /// same name in the package's folder report/, "" for none. Throws InputError where a folder cannot be created, and
  /// for a template that uses a name which is not there.
  explicit ReportWriter(const std::string& directory, const std::string& templates = "");
  ~ReportWriter();
  ReportWriter(const ReportWriter&) = delete;
  ReportWriter& operator=(const ReportWriter&) = delete;
  const std::string& directory() const { return directory_; }
  std::string pictureFile(const std::string& pose) const;
  void write(const Evaluation& evaluation, const AttributionConfig& config, const RunDescription& run,
             const ReportPictures& pictures = {}) const;

 private:
  void writePoses(const Evaluation& evaluation, const AttributionConfig& config) const;
  void writeResiduals(const Evaluation& evaluation) const;
  void writeRegions(const Evaluation& evaluation) const;

  struct Page;
  std::string directory_;
  std::unique_ptr<const Page> page_;
};

/// All that is printed: the table, the outer field, duplicates, convention validation.
std::string reportText(const Evaluation& evaluation, const AttributionConfig& config);

}  // namespace mmradartwin
