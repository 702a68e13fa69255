#include "page/evaluation_page.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "mmradartwin_dsp/text.h"
#include "mmradartwin_dsp/units.h"
#include "page/page_numbers.h"
#include "page/page_picture.h"
#include "page/paper_figures.h"
#include "page/run_values.h"
#include "page/shipped_templates.h"

namespace mmradartwin::page {
namespace {

constexpr std::size_t kWorst = 3;           ///< poses that are shown as the worst
constexpr std::size_t kMostResiduals = 10;  ///< of a pose's table; all of them stand in residuals.csv
constexpr std::size_t kMostActors = 20;     ///< of the table; all of them stand in summary.json

const char* const kNames =
    "answer pose_count against_draw[] simulated_session[] conjugated[] metrics[metric value paper] "
    "bands[band active recalled recall paper] classes[class label count share paper action] "
    "actors[actor active recalled c1 c2 c3 c4 c5] has_more_actors[] "
    "shown_poses[rank pose location explained sentence has_pictures[] measured simulated difference residuals[number "
    "class label where range azimuth measured_db simulated_db action] has_more_residuals[] more_residuals] "
    "poses[pose explained active recalled q1 q2 q3 c1 c2 c3 c4 c5] coverage has_coverage[] duplicates[pose] "
    "has_duplicates[] near_limit far_limit min_range max_azimuth recording_word ";

std::string pointerTo(const std::string& list, std::size_t index, const std::string& key) {
  return "/" + list + "/" + std::to_string(index) + "/" + key;
}

/// "bookshelf;wall_west" as a person reads it.
std::string spokenActor(const std::string& actor) {
  std::string text;
  for (char c : actor) text += c == ';' ? std::string(" + ") : std::string(1, c);
  return text;
}

std::string atPlace(const Residual& residual) {
  return residual.actor.empty() ? "where the scene has nothing to answer" : "at " + spokenActor(residual.actor);
}

std::map<std::string, std::size_t> indexOfPoses(const nlohmann::json& summary) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < summary["poses"].size(); ++i) index[summary["poses"][i]["pose"]] = i;
  return index;
}

std::string ofPlaces(const PageNumbers& numbers, const std::string& active, const std::string& missed) {
  if (numbers.value(active) == 0) return "no expected place answers in the recording";
  const bool one = numbers.value(missed) == 1;
  return numbers.count(missed) + " of " + numbers.count(active) + " expected places " + (one ? "does" : "do") +
         " not match";
}

std::vector<PageValues> metricRows(const PageNumbers& numbers) {
  struct Metric {
    const char *word, *shown, *name, *unit;
    int digits;  ///< -1: a share in per cent
  };
  static const Metric kMetrics[] = {
      {"recall", "Recall", "/recall", "", -1},        {"top-K", "Top-1", "/top/0", "", -1},
      {"top-K", "Top-3", "/top/1", "", -1},           {"top-K", "Top-5", "/top/2", "", -1},
      {"Q1", "Q1 energy", "/q1_energy", "", -1},      {"Q2", "Q2 energy", "/q2_energy", "", -1},
      {"Q3", "Q3 median", "/q3_median_db", " dB", 2}, {"Q3", "Q3 IQR", "/q3_iqr_db", " dB", 2},
      {"Q4", "Q4 MAE", "/q4_mae_db", " dB", 2},
  };
  const auto cell = [&](const Metric& metric, const std::string& from) {
    const std::string pointer = from + metric.name;
    return PageValue::html(
        (metric.digits < 0 ? numbers.percent(pointer) : numbers.fixed(pointer, metric.digits) + metric.unit));
  };
  std::vector<PageValues> rows = {
      {{"metric", PageValue::html(wordHtml("Explained power", *docsGlossary().meaning("explained power")))},
       {"value", PageValue::html(numbers.percent("/explained_power"))},
       {"paper", PageValue::html("\u2013")}}};
  for (const Metric& metric : kMetrics) {
    rows.push_back({{"metric", PageValue::html(wordHtml(metric.shown, *docsGlossary().meaning(metric.word)))},
                    {"value", cell(metric, "/central")},
                    {"paper", cell(metric, "/paper")}});
  }
  return rows;
}

std::vector<PageValues> bandRows(const PageNumbers& numbers) {
  std::vector<PageValues> rows;
  for (const char* band : {"near", "mid", "far"}) {
    const std::string at = std::string("/recall_by_band/") + band;
    rows.push_back({{"band", band},
                    {"active", PageValue::html(numbers.count("/central" + at + "/active"))},
                    {"recalled", PageValue::html(numbers.count("/central" + at + "/recalled"))},
                    {"recall", PageValue::html(numbers.percent("/central" + at + "/recall"))},
                    {"paper", PageValue::html(numbers.percent("/paper" + at + "/recall"))}});
  }
  return rows;
}

PageValue classWord(const std::string& name) { return PageValue::html(wordHtml(name, *docsGlossary().meaning(name))); }

std::vector<PageValues> classRows(const PageNumbers& numbers) {
  std::vector<PageValues> rows;
  for (int i = 1; i <= 5; ++i) {
    const auto c = static_cast<ResidualClass>(i);
    const std::string at = "/classes/" + className(c);
    rows.push_back({{"class", classWord(className(c))},
                    {"label", classLabel(c)},
                    {"count", PageValue::html(numbers.count("/central" + at + "/count"))},
                    {"share", PageValue::html(numbers.percent("/central" + at + "/share"))},
                    {"paper", PageValue::html(numbers.percent("/paper" + at + "/share"))},
                    {"action", classAction(c)}});
  }
  return rows;
}

void addClasses(const PageNumbers& numbers, const std::string& at, PageValues& row) {
  for (const char* c : {"1", "2", "3", "4", "5"}) {
    row[std::string("c") + c] = PageValue::html(numbers.count(at + "/classes/C" + c));
  }
}

std::vector<PageValues> actorRows(const PageNumbers& numbers) {
  std::vector<PageValues> rows;
  const nlohmann::json& actors = numbers.values()["by_actor"];
  for (std::size_t i = 0; i < std::min(kMostActors, actors.size()); ++i) {
    const std::string name = actors[i]["actor"];
    PageValues row = {{"actor", name.empty() ? "(at no expected place)" : spokenActor(name)},
                      {"active", PageValue::html(numbers.count(pointerTo("by_actor", i, "active")))},
                      {"recalled", PageValue::html(numbers.count(pointerTo("by_actor", i, "recalled")))}};
    addClasses(numbers, "/by_actor/" + std::to_string(i), row);
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<PageValues> poseRows(const PageNumbers& numbers) {
  std::vector<PageValues> rows;
  const std::map<std::string, std::size_t> index = indexOfPoses(numbers.values());
  for (const nlohmann::json& name : numbers.values()["worst_first"]) {
    const std::size_t i = index.at(name);
    const auto at = [&](const char* key) { return pointerTo("poses", i, key); };
    PageValues row = {{"pose", name.get<std::string>()},
                      {"explained", PageValue::html(numbers.percent(at("explained_power")))},
                      {"active", PageValue::html(numbers.count(at("active")))},
                      {"recalled", PageValue::html(numbers.count(at("recalled")))},
                      {"q1", PageValue::html(numbers.fixed(at("q1_energy"), 3))},
                      {"q2", PageValue::html(numbers.fixed(at("q2_energy"), 3))},
                      {"q3", PageValue::html(numbers.fixed(at("q3_median_db"), 2))}};
    addClasses(numbers, "/poses/" + std::to_string(i), row);
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Number of a residual as residuals.csv has it in this row.
PageValue csvNumber(double value, int digits, std::size_t row, const char* column, int shown_digits) {
  return PageValue::html(numberHtml(fixedNumber(value, digits), "residuals.csv#" + std::to_string(row) + "/" + column,
                                    fixedNumber(value, shown_digits)));
}

/// The residuals of a pose, of which the first stands in that row of residuals.csv.
std::vector<PageValues> residualRows(const std::vector<Residual>& residuals, std::size_t first_row) {
  std::vector<PageValues> rows;
  for (std::size_t i = 0; i < std::min(kMostResiduals, residuals.size()); ++i) {
    const Residual& r = residuals[i];
    const std::size_t row = first_row + i;
    rows.push_back({{"number", std::to_string(i + 1)},
                    {"class", classWord(className(r.residual_class))},
                    {"label", classLabel(r.residual_class)},
                    {"where", atPlace(r) + (r.material.empty() ? "" : " (" + spokenActor(r.material) + ")")},
                    {"range", csvNumber(r.range_m, 3, row, "range_m", 2)},
                    {"azimuth", csvNumber(r.azimuth_rad / kDegree, 2, row, "azimuth_deg", 0)},
                    {"measured_db", csvNumber(r.measured_db, 2, row, "measured_db", 1)},
                    {"simulated_db", csvNumber(r.simulated_db, 2, row, "simulated_db", 1)},
                    {"action", classAction(r.residual_class)}});
  }
  return rows;
}

/// "2 of 5 expected places do not match. The strongest difference lies at pillar: ..."
std::string poseSentence(const PageNumbers& numbers, std::size_t pose, const std::vector<Residual>& residuals) {
  const std::string at = "/poses/" + std::to_string(pose);
  std::string text;
  if (numbers.value(at + "/active") > 0) {
    text = numbers.count(at + "/recalled") + " of " + numbers.count(at + "/active") + " expected places match.";
  } else {
    text = "No expected place answers in the recording.";
  }
  if (residuals.empty()) return text + " No response differs.";
  const auto strongest = std::max_element(residuals.begin(), residuals.end(), [](const Residual& a, const Residual& b) {
    return std::max(a.measured_db, a.simulated_db) < std::max(b.measured_db, b.simulated_db);
  });
  return text + " The strongest of the responses that differ is number " +
         std::to_string(strongest - residuals.begin() + 1) + ", " + htmlEscape(atPlace(*strongest)) + ": " +
         htmlEscape(classLabel(strongest->residual_class)) + ".";
}

std::vector<PageValues> shownPoses(const Evaluation& evaluation, const PageNumbers& numbers,
                                   const ReportPictures& pictures) {
  std::map<std::string, std::pair<const PoseResult*, std::size_t>> of_name;  // with the first row in residuals.csv
  std::size_t row = 0;
  for (const PoseResult& pose : evaluation.poses) {
    if (pose.used) of_name[pose.pose.name] = {&pose, row};
    row += pose.attribution.residuals.size();
  }
  const nlohmann::json& order = numbers.values()["worst_first"];
  std::vector<std::pair<std::size_t, std::string>> chosen;  // place in the order, and what it is called
  for (std::size_t i = 0; i < std::min(kWorst, order.size()); ++i) {
    chosen.emplace_back(i, i == 0 ? "worst" : i == 1 ? "second worst" : "third worst");
  }
  if (order.size() > kWorst) chosen.emplace_back(order.size() - 1, "best");
  const std::map<std::string, std::size_t> index = indexOfPoses(numbers.values());
  std::vector<PageValues> items;
  for (const auto& [place, rank] : chosen) {
    const std::string name = order[place];
    const auto& [pose, first_row] = of_name.at(name);
    const std::vector<Residual>& residuals = pose->attribution.residuals;
    const bool more = residuals.size() > kMostResiduals;
    PageValues item = {
        {"rank", rank},
        {"pose", name},
        {"location", pose->pose.location},
        {"explained", PageValue::html(numbers.percent(pointerTo("poses", index.at(name), "explained_power")))},
        {"sentence", PageValue::html(poseSentence(numbers, index.at(name), residuals))},
        {"has_pictures", pictures.field != nullptr},
        {"residuals", residualRows(residuals, first_row)},
        {"has_more_residuals", more},
        {"more_residuals", std::to_string(more ? residuals.size() - kMostResiduals : 0)},
        {"measured", ""},
        {"simulated", ""},
        {"difference", ""}};
    if (pictures.field != nullptr) {
      const auto fans = drawPoseFans(*pictures.field, *pose);
      item["measured"] = PageValue::html(pictureHtml(fans[0], "measured map of pose " + name));
      item["simulated"] = PageValue::html(pictureHtml(fans[1], "simulated map of pose " + name));
      item["difference"] = PageValue::html(pictureHtml(fans[2], "simulated minus measured of pose " + name));
    }
    items.push_back(std::move(item));
  }
  return items;
}

}  // namespace

PageTemplate evaluationTemplate(const TemplateText& text) {
  return PageTemplate("evaluation.html", text, pageNames(std::string(kNames) + kRunNames), docsGlossary());
}

std::string evaluationAnswer(const nlohmann::json& summary) {
  const PageNumbers numbers(summary, "summary.json");
  const std::string places = ofPlaces(numbers, "/expected_places/active", "/expected_places/missed");
  std::string answer;
  if (summary["explained_power"].is_null()) {
    answer =
        "How much of the measured power the twin explains is not known, since nothing was measured; " + places + ".";
  } else {
    answer = "The twin explains " + numbers.percent("/explained_power") + " of the measured power; " + places + ".";
  }
  if (summary["poses"].size() > 1) {
    const std::string worst = summary["worst_first"][0];
    const std::size_t i = indexOfPoses(summary).at(worst);
    answer += " The worst is pose " + htmlEscape(worst);
    const double share = numbers.value(pointerTo("poses", i, "explained_power"));
    if (share > 0) {
      answer += ": of its power the twin explains " + numbers.percent(pointerTo("poses", i, "explained_power"));
    } else if (share <= 0) {
      answer += ": in it the twin errs by more than what was measured";
    }
    answer += ".";
  }
  return answer;
}

std::string evaluationPage(const PageTemplate& page, const Evaluation& evaluation, const nlohmann::json& summary,
                           const RunDescription& run, const ReportPictures& pictures) {
  const PageNumbers numbers(summary, "summary.json");
  PageValues values;
  addRunValues(run, evaluation.problems, values);
  values["recording_word"] = shellWord(run.recording);
  values["answer"] = PageValue::html(evaluationAnswer(summary));
  values["pose_count"] = PageValue::html(numbers.count("/central/poses"));
  values["against_draw"] = !evaluation.expected_known && run.simulated == "twin";
  values["simulated_session"] = run.simulated != "twin";
  values["conjugated"] = 2 * evaluation.conjugated_better > evaluation.central.poses;
  values["metrics"] = metricRows(numbers);
  values["bands"] = bandRows(numbers);
  values["classes"] = classRows(numbers);
  values["actors"] = actorRows(numbers);
  values["has_more_actors"] = summary["by_actor"].size() > kMostActors;
  values["shown_poses"] = shownPoses(evaluation, numbers, pictures);
  values["poses"] = poseRows(numbers);
  values["has_coverage"] = !pictures.coverage.empty();
  values["coverage"] =
      pictures.coverage.empty()
          ? PageValue("")
          : PageValue::html(pictureHtml(pictures.coverage, "the scene from above with the radar's places"));
  std::vector<PageValues> duplicates;
  for (const std::string& pose : evaluation.duplicates) duplicates.push_back({{"pose", pose}});
  values["has_duplicates"] = !duplicates.empty();
  values["duplicates"] = std::move(duplicates);
  values["near_limit"] = PageValue::html(numbers.significant("/central/near_limit_m"));
  values["far_limit"] = PageValue::html(numbers.significant("/central/far_limit_m"));
  values["min_range"] = PageValue::html(numbers.significant("/central/min_range_m"));
  values["max_azimuth"] = PageValue::html(numbers.significant("/central/max_azimuth_deg"));
  return page.render(values);
}

}  // namespace mmradartwin::page
