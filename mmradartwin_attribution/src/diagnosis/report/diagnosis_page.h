#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "diagnosis/report/cause_words.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosed_poses.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/run_description.h"
#include "page/page_template.h"

namespace mmradartwin::diagnosis::report {

/// Files of a finding, relative to the page.
struct FindingFiles {
  std::string figure;
  std::string records;  ///< "" where it changes no path records
};

/// summary.json of a diagnosis: what findings.json does not hold. poses: nullptr where they were not compared.
nlohmann::json diagnosisSummary(const Diagnosis& diagnosis, const RunDescription& run, const DiagnosedPoses* poses);

/// The template diagnosis.html. Throws InputError as PageTemplate does.
page::PageTemplate diagnosisTemplate(const page::TemplateText& text);

/// What the report of a diagnosis is made of.
struct DiagnosisPageInput {
  const Diagnosis& diagnosis;
  const nlohmann::json& findings;          ///< findings.json
  const nlohmann::json& summary;           ///< diagnosisSummary()
  const std::vector<FindingFiles>& files;  ///< by finding
  const RunDescription& run;
  const DiagnosedPoses* poses;  ///< nullptr where they were not compared
};

/// Report of a diagnosis (HTML) for a person.
std::string diagnosisPage(const page::PageTemplate& page, const CauseWords& words, const DiagnosisPageInput& input);

}  // namespace mmradartwin::diagnosis::report
