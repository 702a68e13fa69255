#include "diagnosis/report/diagnosis_page.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "diagnosis/report/diagnosis_answer.h"
#include "diagnosis/report/finding_figure.h"
#include "diagnosis/report/finding_words.h"
#include "diagnosis/report/pose_section.h"
#include "mmradartwin_dsp/text.h"
#include "page/page_picture.h"
#include "page/paper_figures.h"
#include "page/run_values.h"
#include "page/shipped_templates.h"

namespace mmradartwin::diagnosis::report {
namespace {

using page::PageNumbers;
using page::PageValue;
using page::PageValues;

constexpr std::size_t kMostRecords = 10;  ///< of a finding's table; all of them stand in its CSV file
constexpr std::size_t kMostTried = 60;    ///< of the table; all of them stand in tried.csv
constexpr double kLeastShown_nats = 1;    ///< promise of the weakest hypothesis of the table

const char* const kNames =
    "answer pose_count location_count held_out has_twin[] no_twin[] recording_word steps[step] has_findings[] "
    "findings[number cause class action wrong to_do parameters[parameter] description has_description[] candidates "
    "has_candidates[] experiment has_experiment[] gain_nats false_alarms runner_up margin has_runner_up[] "
    "has_gain[] metrics[metric before after difference paper] has_maps[] before after plan places[x y has_point[] "
    "ranges "
    "has_ranges[] actors has_actors[] poses has_poses[]] records[event actors pose before_db before_m before_deg "
    "after_db "
    "after_m after_deg] has_records[] records_file] "
    "tried[what round gain verdict] has_tried[] tried_count accuracy[key stated estimated] "
    "scene_actors[actor level range] has_scene_actors[] judged_by[sentence] "
    "compared[file sentence] has_compared[] ";

std::string wordOf(const char* shown, const char* word) {
  return page::wordHtml(shown, *page::docsGlossary().meaning(word));
}

/// One row of a finding's table.
struct GainRow {
  const char *shown, *word;
  const char* pointer;  ///< below "gain"
  const char* paper;    ///< name of the paper's figure, "" for none
  enum { kPercent, kDb, kCount } form;
};

std::vector<PageValues> gainRows(const PageNumbers& numbers, const std::string& gain) {
  static const std::array<GainRow, 13> kRows = {{
      {"Explained power", "explained power", "/explained_power", "", GainRow::kPercent},
      {"Recall", "recall", "/recall", "/recall", GainRow::kPercent},
      {"Recall, near", "recall", "/recall/bands/near", "/recall_by_band/near/recall", GainRow::kPercent},
      {"Recall, mid", "recall", "/recall/bands/mid", "/recall_by_band/mid/recall", GainRow::kPercent},
      {"Recall, far", "recall", "/recall/bands/far", "/recall_by_band/far/recall", GainRow::kPercent},
      {"Q1 energy", "Q1", "/q1", "/q1_energy", GainRow::kPercent},
      {"Q2 energy", "Q2", "/q2", "/q2_energy", GainRow::kPercent},
      {"Q3 median, dB", "Q3", "/q3_median_db", "/q3_median_db", GainRow::kDb},
      {"C1", "C1", "/classes/C1", "", GainRow::kCount},
      {"C2", "C2", "/classes/C2", "", GainRow::kCount},
      {"C3", "C3", "/classes/C3", "", GainRow::kCount},
      {"C4", "C4", "/classes/C4", "", GainRow::kCount},
      {"C5", "C5", "/classes/C5", "", GainRow::kCount},
  }};
  const auto cell = [&](const GainRow& row, const std::string& pointer) {
    return row.form == GainRow::kPercent ? numbers.percent(pointer)
           : row.form == GainRow::kDb    ? numbers.fixed(pointer, 2)
                                         : numbers.count(pointer);
  };
  std::vector<PageValues> rows;
  for (const GainRow& row : kRows) {
    const std::string at = gain + row.pointer;
    if (std::isnan(numbers.value(at + "/before")) && std::isnan(numbers.value(at + "/after"))) continue;
    std::string difference, paper = "\u2013";
    if (!std::isnan(numbers.value(at + "/difference_ci95/0"))) {
      difference = cell(row, at + "/difference_ci95/0") + " to " + cell(row, at + "/difference_ci95/1");
    }
    for (const page::PaperFigure& figure : page::kPaperFigures) {
      if (std::string(row.paper) != figure.name) continue;
      paper = row.form == GainRow::kPercent ? page::percentText(figure.value) : fixedNumber(figure.value, 2);
    }
    rows.push_back({{"metric", PageValue::html(wordOf(row.shown, row.word))},
                    {"before", PageValue::html(cell(row, at + "/before"))},
                    {"after", PageValue::html(cell(row, at + "/after"))},
                    {"difference", PageValue::html(difference)},
                    {"paper", paper}});
  }
  return rows;
}

std::vector<PageValues> placeItems(const Finding& finding, const PageNumbers& numbers, const std::string& at) {
  std::vector<PageValues> items;
  for (std::size_t k = 0; k < finding.where.size(); ++k) {
    const FindingPlace& place = finding.where[k];
    const std::string here = at + "/where/" + std::to_string(k);
    const bool ranges = place.range_m && place.azimuth_deg;
    items.push_back({{"x", PageValue::html(numbers.significant(here + "/x_m"))},
                     {"y", PageValue::html(numbers.significant(here + "/y_m"))},
                     {"has_point", place.x_m.has_value() && place.y_m.has_value()},
                     {"ranges", PageValue::html(numbers.interval(here + "/range_m") + " m and from " +
                                                numbers.interval(here + "/azimuth_deg") + "\u00b0")},
                     {"has_ranges", ranges},
                     {"actors", mmradartwin::join(place.actors, ", ")},
                     {"has_actors", !place.actors.empty()},
                     {"poses", mmradartwin::join(place.poses, ", ")},
                     {"has_poses", !place.poses.empty()}});
  }
  return items;
}

/// Cell of a record's table, as its CSV file has the number.
PageValue recordCell(const std::optional<RecordState>& record, double RecordState::*member, const std::string& file,
                     std::size_t row, const std::string& column) {
  if (!record) return PageValue("\u2013");
  const std::string text = shownNumber((*record).*member, 4);
  return PageValue::html(page::numberHtml(text, file + "#" + std::to_string(row) + "/" + column, text));
}

/// The strongest paths that a finding changes; several of one pose that look alike are told once.
std::vector<PageValues> recordRows(const std::vector<ChangedRecord>& records, const std::string& file) {
  std::vector<std::size_t> order(records.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return records[a].strongest_db() > records[b].strongest_db(); });
  std::vector<PageValues> rows;
  std::string last;
  for (std::size_t i : order) {
    const ChangedRecord& r = records[i];
    const std::string said =
        r.pose + r.event + joined(r.actors) + shownRecord(r.before, ",") + "," + shownRecord(r.after, ",");
    if (said == last) continue;
    last = said;
    if (rows.size() == kMostRecords) break;
    rows.push_back({{"event", r.event},
                    {"actors", mmradartwin::join(r.actors, ", ")},
                    {"pose", r.pose},
                    {"before_db", recordCell(r.before, &RecordState::amplitude_db, file, i, "amplitude_before_db")},
                    {"before_m", recordCell(r.before, &RecordState::range_m, file, i, "range_before_m")},
                    {"before_deg", recordCell(r.before, &RecordState::azimuth_deg, file, i, "azimuth_before_deg")},
                    {"after_db", recordCell(r.after, &RecordState::amplitude_db, file, i, "amplitude_after_db")},
                    {"after_m", recordCell(r.after, &RecordState::range_m, file, i, "range_after_m")},
                    {"after_deg", recordCell(r.after, &RecordState::azimuth_deg, file, i, "azimuth_after_deg")}});
  }
  return rows;
}

std::vector<PageValues> parameterItems(const Finding& finding, std::size_t index, const PageNumbers& numbers) {
  std::vector<PageValues> items;
  for (const FindingParameter& p : finding.parameters) {
    items.push_back({{"parameter", PageValue::html(htmlEscape(p.name) + " = " + parameterHtml(p, index, numbers))}});
  }
  for (const std::string& more : shownBesides(finding)) items.push_back({{"parameter", more}});
  return items;
}

PageValues findingItem(const Diagnosis& diagnosis, std::size_t index, const CauseWords& words,
                       const PageNumbers& numbers, const FindingFiles& files) {
  const Finding& finding = diagnosis.findings.findings[index];
  const CauseDescription& cause = causeDescription(finding.cause);
  const std::string at = "/findings/" + std::to_string(index), evidence = at + "/evidence";
  const std::string class_name = className(cause.residual_class);
  const FindingParts parts = drawFindingParts(finding, diagnosis.plan);
  const bool maps = !parts.before.empty();
  std::vector<PageValues> metrics = finding.gain ? gainRows(numbers, at + "/gain") : std::vector<PageValues>();
  std::vector<PageValues> records = recordRows(finding.records, files.records);
  PageValues item = {
      {"number", std::to_string(index + 1)},
      {"cause", finding.cause},
      {"class", PageValue::html(wordOf(class_name.c_str(), class_name.c_str()))},
      {"action", cause.action()},
      {"wrong", PageValue::html(words.wrong(finding, index, numbers))},
      {"to_do", PageValue::html(words.toDo(finding, index, numbers))},
      {"parameters", parameterItems(finding, index, numbers)},
      {"description", finding.description.value_or("")},
      {"has_description", finding.description.has_value()},
      {"candidates", PageValue::html(candidatesHtml(finding, index, numbers))},
      {"has_candidates", finding.candidates.size() > 1},
      {"experiment", finding.experiment.value_or("")},
      {"has_experiment", finding.experiment.has_value()},
      {"gain_nats", PageValue::html(numbers.significant(evidence + "/log_likelihood_gain"))},
      {"false_alarms", PageValue::html(numbers.chance(evidence + "/false_alarm_rate"))},
      {"runner_up", finding.evidence.runner_up.value_or("")},
      {"margin", PageValue::html(numbers.significant(evidence + "/margin"))},
      {"has_runner_up", finding.evidence.runner_up.has_value()},
      {"has_gain", !metrics.empty()},
      {"metrics", std::move(metrics)},
      {"has_maps", maps},
      {"before", PageValue::html(maps ? page::pictureHtml(parts.before, "maps without " + finding.cause) : "")},
      {"after", PageValue::html(maps ? page::pictureHtml(parts.after, "maps with " + finding.cause) : "")},
      {"plan", PageValue::html(page::pictureHtml(
                   parts.plan, "the room from above, with what " + finding.cause + " is about in red"))},
      {"places", placeItems(finding, numbers, at)},
      {"has_records", !records.empty()},
      {"records", std::move(records)},
      {"records_file", files.records}};
  return item;
}

/// Number of a hypothesis as tried.csv has it in this row.
PageValue triedNumber(double value, std::size_t row, const char* column) {
  if (std::isnan(value)) return PageValue("\u2013");
  return PageValue::html(page::numberHtml(shownNumber(value, 6), "tried.csv#" + std::to_string(row) + "/" + column,
                                          page::significantText(value, 3)));
}

std::vector<PageValues> triedRows(const std::vector<TriedHypothesis>& tried) {
  std::vector<PageValues> rows;
  for (std::size_t i = 0; i < tried.size() && rows.size() < kMostTried; ++i) {
    const TriedHypothesis& h = tried[i];
    if (h.screened_nats < kLeastShown_nats) continue;
    const bool fitted = !std::isnan(h.gain);
    rows.push_back({{"what", h.label},
                    {"round", std::to_string(h.round + 1)},
                    {"gain", triedNumber(h.gain, i, "gain_nats")},
                    {"verdict", !h.verdict.empty() ? h.verdict
                                : fitted           ? "another one gained more"
                                                   : "not fitted"}});
  }
  return rows;
}

std::vector<PageValues> accuracyRows(const PageNumbers& numbers) {
  std::vector<PageValues> rows;
  for (const AccuracyKey& key : accuracyKeys()) {
    const std::string at = std::string("/accuracy/") + key.name;
    rows.push_back({{"key", key.name},
                    {"stated", PageValue::html(numbers.significant(at + "/stated"))},
                    {"estimated", PageValue::html(numbers.significant(at + "/estimated"))}});
  }
  return rows;
}

std::vector<PageValues> sceneActorRows(const PageNumbers& summary) {
  std::vector<PageValues> rows;
  for (std::size_t i = 0; i < summary.values()["actors"].size(); ++i) {
    const std::string at = "/actors/" + std::to_string(i);
    const auto value = [&](const std::string& key, const std::string& unit, int digits) {
      return PageValue::html(summary.fixed(at + key + unit, digits) + " \u00b1 " +
                             summary.fixed(at + key + "_sd" + unit, digits));
    };
    rows.push_back({{"actor", summary.values()["actors"][i]["actor"].get<std::string>()},
                    {"level", value("/level", "_db", 2)},
                    {"range", value("/range", "_m", 4)}});
  }
  return rows;
}

std::vector<PageValues> comparedItems(const PageNumbers& summary) {
  std::vector<PageValues> items;
  for (std::size_t i = 0; i < summary.values()["compared"].size(); ++i) {
    const std::string at = "/compared/" + std::to_string(i);
    items.push_back(
        {{"file", summary.values()["compared"][i]["file"].get<std::string>()},
         {"sentence", PageValue::html("explains " + summary.percent(at + "/explained_power") +
                                      " of the measured power; the recording is likelier under it by " +
                                      summary.significant(at + "/log_likelihood_gain") + " " + wordOf("nats", "nat") +
                                      " (" + summary.interval(at + "/log_likelihood_gain_ci95") +
                                      " by places; below zero: less likely)")}});
  }
  return items;
}

/// What to do, the most useful first.
std::vector<PageValues> stepItems(const Diagnosis& diagnosis, const CauseWords& words, const PageNumbers& numbers) {
  std::vector<PageValues> steps;
  const auto add = [&](const std::string& html) { steps.push_back({{"step", PageValue::html(html)}}); };
  const std::vector<Finding>& found = diagnosis.findings.findings;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::string about = found.size() > 1 ? "<b>" + htmlEscape(found[i].cause) + ":</b> " : "";
    if (found[i].experiment)
      add(about + "Measure what tells the names apart: " + htmlEscape(*found[i].experiment) + ".");
    add(about + words.toDo(found[i], i, numbers));
  }
  return steps;
}

}  // namespace

nlohmann::json diagnosisSummary(const Diagnosis& diagnosis, const RunDescription& run, const DiagnosedPoses* poses) {
  nlohmann::json j;
  j["format"] = "mmradartwin_diagnosis_summary/1";
  j["version"] = run.version;
  j["command"] = run.command;
  j["recording"] = run.recording;
  j["explained_power"] = diagnosis.has_twin && std::isfinite(diagnosis.explained_power)
                             ? nlohmann::json(diagnosis.explained_power)
                             : nlohmann::json(nullptr);
  j["knife_edges_nats"] =
      diagnosis.knife_edges_nats ? nlohmann::json(*diagnosis.knife_edges_nats) : nlohmann::json(nullptr);
  j["tried"] = diagnosis.tried.size();
  j["actors"] = nlohmann::json::array();
  for (const ActorErrors& a : diagnosis.actors) {
    j["actors"].push_back({{"actor", a.actor},
                           {"level_db", a.level_db},
                           {"level_sd_db", a.level_sd_db},
                           {"range_m", a.range_m},
                           {"range_sd_m", a.range_sd_m}});
  }
  j["compared"] = nlohmann::json::array();
  for (const ComparedTwin& twin : diagnosis.compared) {
    j["compared"].push_back({{"file", twin.file},
                             {"log_likelihood_gain", twin.log_likelihood_gain},
                             {"log_likelihood_gain_ci95", twin.log_likelihood_gain_ci95},
                             {"explained_power", twin.explained_power}});
  }
  if (poses) addPoseSummary(*poses, j);
  j["problems"] = nlohmann::json::array();
  for (const PoseProblem& p : diagnosis.problems) j["problems"].push_back({{"pose", p.pose}, {"message", p.message}});
  j["inputs"] = nlohmann::json::array();
  for (const InputFile& f : run.inputs) j["inputs"].push_back({{"file", f.file}, {"sha256", f.sha256}});
  return j;
}

page::PageTemplate diagnosisTemplate(const page::TemplateText& text) {
  return {"diagnosis.html", text, page::pageNames(std::string(kNames) + kPoseNames + page::kRunNames),
          page::docsGlossary()};
}

std::string diagnosisPage(const page::PageTemplate& page, const CauseWords& words, const DiagnosisPageInput& input) {
  const Diagnosis& diagnosis = input.diagnosis;
  const PageNumbers numbers(input.findings, "findings.json"), of_summary(input.summary, "summary.json");
  PageValues values;
  page::addRunValues(input.run, diagnosis.problems, values);
  values["recording_word"] = page::shellWord(input.run.recording);
  values["answer"] = PageValue::html(diagnosisAnswer(diagnosis, words, input.findings, input.summary));
  values["pose_count"] = PageValue::html(numbers.count("/poses/count"));
  values["location_count"] = PageValue::html(numbers.count("/poses/locations"));
  values["held_out"] = diagnosis.findings.held_out;
  values["has_twin"] = diagnosis.has_twin;
  values["no_twin"] = !diagnosis.has_twin;
  values["steps"] = stepItems(diagnosis, words, numbers);
  std::vector<PageValues> items;
  for (std::size_t i = 0; i < input.files.size(); ++i) {
    items.push_back(findingItem(diagnosis, i, words, numbers, input.files[i]));
  }
  values["has_findings"] = !items.empty();
  values["findings"] = std::move(items);
  std::vector<PageValues> tried = triedRows(diagnosis.tried);
  values["has_tried"] = !tried.empty();
  values["tried"] = std::move(tried);
  values["tried_count"] = PageValue::html(of_summary.count("/tried"));
  values["accuracy"] = diagnosis.has_twin ? accuracyRows(numbers) : std::vector<PageValues>();
  std::vector<PageValues> scene_actors = sceneActorRows(of_summary);
  values["has_scene_actors"] = !scene_actors.empty();
  values["scene_actors"] = std::move(scene_actors);
  std::vector<PageValues> judged_by, compared = comparedItems(of_summary);
  for (const std::string& sentence : shownJudgedBy(diagnosis)) judged_by.push_back({{"sentence", sentence}});
  values["judged_by"] = std::move(judged_by);
  values["has_compared"] = !compared.empty();
  values["compared"] = std::move(compared);
  addPoseValues(input.poses, of_summary, values);
  return page.render(values);
}

}  // namespace mmradartwin::diagnosis::report
