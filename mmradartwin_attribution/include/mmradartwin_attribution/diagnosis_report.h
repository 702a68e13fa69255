#pragma once

#include <string>
#include <vector>

#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin {

/// Writes into a folder: findings.json, twin.extended.yaml, tried.csv and index.html.
class DiagnosisReport {
 public:
  /// Creates the folder. Throws InputError where that is not possible.
  explicit DiagnosisReport(const std::string& directory);
  void write(const Diagnosis& diagnosis, const std::vector<std::string>& command) const;

 private:
  std::string directory_;
};

/// The findings as a person reads them, a line each and their gains.
std::string diagnosisText(const Diagnosis& diagnosis);

}  // namespace mmradartwin
