#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "diagnosis/report/cause_words.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::report {

/// First sentences of a diagnosis' report, HTML: what is wrong, and what the twin explains with it and without.
/// findings: findings.json, summary: summary.json.
std::string diagnosisAnswer(const Diagnosis& diagnosis, const CauseWords& words, const nlohmann::json& findings,
                            const nlohmann::json& summary);

/// "One of these, and the recording does not tell which: ..." of a finding with several names; else "". HTML.
std::string candidatesHtml(const Finding& finding, std::size_t index, const page::PageNumbers& numbers);

}  // namespace mmradartwin::diagnosis::report
