#pragma once

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <string>

#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/pose_picture.h"
#include "mmradartwin_attribution/run_description.h"
#include "page/page_template.h"

namespace mmradartwin::page {

/// The template evaluation.html. Throws InputError as PageTemplate does.
PageTemplate evaluationTemplate(const TemplateText& text);

/// First sentences of the report: how much the twin explains, how many expected places do not match, the worst pose.
/// HTML. summary: as evaluationSummary() makes it.
std::string evaluationAnswer(const nlohmann::json& summary);

/// The report of an evaluation.
std::string evaluationPage(const PageTemplate& page, const Evaluation& evaluation, const nlohmann::json& summary,
                           const RunDescription& run, const ReportPictures& pictures);

}  // namespace mmradartwin::page
