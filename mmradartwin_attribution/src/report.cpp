#include "mmradartwin_attribution/report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"
#include "page/evaluation_page.h"
#include "page/evaluation_summary.h"
#include "page/page_numbers.h"
#include "page/shipped_templates.h"

namespace mmradartwin {

namespace fs = std::filesystem;

/// The report's template, read and checked.
struct ReportWriter::Page {
  page::PageTemplate evaluation;
};

ReportWriter::ReportWriter(const std::string& directory, const std::string& templates)
    : directory_(directory), page_(new Page{page::evaluationTemplate(page::templatesOf(templates))}) {
  std::error_code error;
  fs::create_directories(fs::path(directory) / "pictures", error);
  if (error) {
    throw InputError(directory + ": cannot be created (" + error.message() + "); choose another --output");
  }
}

ReportWriter::~ReportWriter() = default;

std::string ReportWriter::pictureFile(const std::string& pose) const {
  std::string name = pose;  // a pose is any string: keep it inside the folder
  std::replace(name.begin(), name.end(), '/', '_');
  return directory_ + "/pictures/" + name + ".png";
}

void ReportWriter::write(const Evaluation& evaluation, const AttributionConfig& config, const RunDescription& run,
                         const ReportPictures& pictures) const {
  writePoses(evaluation, config);
  writeResiduals(evaluation);
  writeRegions(evaluation);
  const auto save = [&](const std::string& name, const std::string& content) {
    const std::string file = directory_ + "/" + name;
    std::ofstream out(file, std::ios::trunc);
    out << content;
    out.close();
    if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
  };
  nlohmann::json summary = page::evaluationSummary(evaluation, config, run);
  summary["answer"] = page::shownText(page::evaluationAnswer(summary));
  save("summary.json", summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  save("table.txt", reportText(evaluation, config));
  save("attribution.yaml", run.attribution_yaml);
  save("radar.yaml", run.radar_yaml);
  if (!run.twin_yaml.empty()) save("twin.yaml", run.twin_yaml);
  save("report.html", page::evaluationPage(page_->evaluation, evaluation, summary, run, pictures));
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
