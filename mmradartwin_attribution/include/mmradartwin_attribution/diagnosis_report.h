#pragma once

#include <memory>
#include <string>

#include "mmradartwin_attribution/diagnosed_poses.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/run_description.h"

namespace mmradartwin {

/// Writes into a folder: findings.json, summary.json, twin.extended.yaml, tried.csv and report.html, which holds all
/// that it shows.
class DiagnosisReport {
 public:
  /// Creates the folder. templates: as for ReportWriter. Throws InputError where the folder cannot be created, and for
  /// a template that uses a name which is not there.
  explicit DiagnosisReport(const std::string& directory, const std::string& templates = "");
  ~DiagnosisReport();
  DiagnosisReport(const DiagnosisReport&) = delete;
  DiagnosisReport& operator=(const DiagnosisReport&) = delete;
  /// poses: whose maps the page shows; nullptr: none.
  void write(const Diagnosis& diagnosis, const RunDescription& run, const DiagnosedPoses* poses = nullptr) const;

 private:
  struct Page;
  std::string directory_;
  std::unique_ptr<const Page> page_;
};

/// The findings as a person reads them, a line each and their gains.
std::string diagnosisText(const Diagnosis& diagnosis);

}  // namespace mmradartwin
