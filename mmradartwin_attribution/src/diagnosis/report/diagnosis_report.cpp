#include "mmradartwin_attribution/diagnosis_report.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "diagnosis/report/diagnosis_answer.h"
#include "diagnosis/report/diagnosis_page.h"
#include "diagnosis/report/finding_figure.h"
#include "diagnosis/report/finding_words.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"
#include "page/shipped_templates.h"

namespace mmradartwin {

using namespace diagnosis;

namespace {

namespace fs = std::filesystem;

/// A field of a CSV line (RFC 4180).
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

std::string recordsCsv(const std::vector<ChangedRecord>& records) {
  std::string csv =
      "pose,event,actors,amplitude_before_db,range_before_m,azimuth_before_deg,amplitude_after_db,range_after_m,"
      "azimuth_after_deg\n";
  for (const ChangedRecord& record : records) {
    csv += quoted(record.pose) + "," + record.event + "," + quoted(joined(record.actors)) + "," +
           shownRecord(record.before, ",") + "," + shownRecord(record.after, ",") + "\n";
  }
  return csv;
}

std::string triedCsv(const std::vector<TriedHypothesis>& tried) {
  std::ostringstream csv;
  csv << "round,hypothesis,promised_nats,gain_nats,gain_without_best_place_nats,inflation,held_out_nats,false_alarm_"
         "rate,fitted,verdict\n";
  for (const TriedHypothesis& hypothesis : tried) {
    csv << hypothesis.round << "," << quoted(hypothesis.label) << "," << shownNumber(hypothesis.screened_nats, 6)
        << ",";
    if (std::isnan(hypothesis.gain)) {
      csv << ",,,,,,";
    } else {
      csv << shownNumber(hypothesis.gain, 6) << "," << shownNumber(hypothesis.gain_without_best_place, 6) << ","
          << shownNumber(hypothesis.overdispersion, 4) << "," << shownNumber(hypothesis.held_out_gain, 6) << ","
          << shownNumber(hypothesis.false_alarm_rate, 3) << "," << quoted(hypothesis.fitted) << ",";
    }
    csv << (hypothesis.verdict.empty() ? "" : quoted(hypothesis.verdict)) << "\n";
  }
  return csv.str();
}

void save(const std::string& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.flush();
  if (!out) throw InputError(file + ": cannot be written; check free space and rights");
}

void makeFolder(const std::string& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw InputError(directory + ": cannot be created (" + error.message() + "); choose another --output");
}

/// Removes the figures and lists of an earlier diagnosis, which its findings.json names: beside a new one they would
/// show what was not found.
void removeEarlier(const fs::path& directory) {
  Findings earlier;
  try {
    earlier = readFindings((directory / "findings.json").string());
  } catch (const InputError&) {
    return;  // there is none, or it is someone else's
  }
  for (const Finding& finding : earlier.findings) {
    const fs::path figure = finding.figure.value_or("");
    if (figure.parent_path() != "figures") continue;
    std::error_code ignored;
    fs::remove(directory / figure, ignored);
    fs::remove(directory / "records" / figure.stem().concat(".csv"), ignored);
  }
}

/// Names of the findings' files: the cause, with a number from the second of a cause on.
std::vector<FindingFiles> filesOf(const std::vector<Finding>& findings) {
  std::vector<FindingFiles> files;
  std::map<std::string, int> times;
  for (const Finding& finding : findings) {
    const int time = ++times[finding.cause];
    const std::string name = finding.cause + (time > 1 ? "_" + std::to_string(time) : "");
    files.push_back({"figures/" + name + ".png", finding.records.empty() ? "" : "records/" + name + ".csv"});
  }
  return files;
}

}  // namespace

/// The report's template and the words for causes, read and checked.
struct DiagnosisReport::Page {
  page::PageTemplate diagnosis;
  CauseWords words;
};

DiagnosisReport::DiagnosisReport(const std::string& directory, const std::string& templates)
    : directory_(directory),
      page_(new Page{diagnosisTemplate(page::templatesOf(templates)), CauseWords(page::templatesOf(templates))}) {
  makeFolder(directory);
}

DiagnosisReport::~DiagnosisReport() = default;

void DiagnosisReport::write(const Diagnosis& diagnosis, const RunDescription& run, const DiagnosedPoses* poses) const {
  removeEarlier(directory_);
  Findings findings = diagnosis.findings;
  const std::vector<FindingFiles> files = filesOf(findings.findings);
  if (!findings.findings.empty()) makeFolder(directory_ + "/figures");
  for (std::size_t i = 0; i < files.size(); ++i) {
    Finding& finding = findings.findings[i];
    finding.figure = files[i].figure;
    writePicture(drawFinding(finding, diagnosis.plan), directory_ + "/" + files[i].figure);
    if (files[i].records.empty()) continue;
    makeFolder(directory_ + "/records");
    save(directory_ + "/" + files[i].records, recordsCsv(finding.records));
  }
  if (diagnosis.has_twin) {
    findings.extended_twin = "twin.extended.yaml";
    save(directory_ + "/twin.extended.yaml", diagnosis.extended.toYaml());
  }
  writeFindings(findings, directory_ + "/findings.json");
  save(directory_ + "/tried.csv", triedCsv(diagnosis.tried));
  const nlohmann::json as_written = nlohmann::json::parse(toJson(findings));
  nlohmann::json summary = diagnosisSummary(diagnosis, run, poses);
  summary["answer"] = page::shownText(diagnosisAnswer(diagnosis, page_->words, as_written, summary));
  save(directory_ + "/summary.json", summary.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  save(directory_ + "/report.html",
       diagnosisPage(page_->diagnosis, page_->words, {diagnosis, as_written, summary, files, run, poses}));
}

}  // namespace mmradartwin
