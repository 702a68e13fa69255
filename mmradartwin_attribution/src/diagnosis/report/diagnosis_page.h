#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "diagnosis/report/cause_words.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/run_description.h"
#include "page/page_template.h"

namespace mmradartwin::diagnosis::report {

/// Files of a finding, relative to the page.
struct FindingFiles {
  std::string figure;
  std::string records;  ///< "" where it changes no path records
};

/// summary.json of a diagnosis: what findings.json does not hold.
nlohmann::json diagnosisSummary(const Diagnosis& diagnosis, const RunDescription& run);

/// The template diagnosis.html. Throws InputError as PageTemplate does.
page::PageTemplate diagnosisTemplate(const page::TemplateText& text);

/// Report of a diagnosis (HTML) for a person. findings: findings.json, summary: diagnosisSummary(); files: by finding.
std::string diagnosisPage(const page::PageTemplate& page, const CauseWords& words, const Diagnosis& diagnosis,
                          const nlohmann::json& findings, const nlohmann::json& summary,
                          const std::vector<FindingFiles>& files, const RunDescription& run);

}  // namespace mmradartwin::diagnosis::report
