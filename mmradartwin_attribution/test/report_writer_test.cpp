#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "mmradartwin_attribution/report.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

std::string textOf(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// The fields of a line; one in quotes may hold commas.
std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

/// Rows of a CSV file by its header's names.
std::vector<std::map<std::string, std::string>> rowsOf(const fs::path& file) {
  std::istringstream lines(textOf(file));
  std::string line;
  std::getline(lines, line);
  const std::vector<std::string> names = split(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(lines, line)) {
    const std::vector<std::string> fields = split(line);
    EXPECT_EQ(fields.size(), names.size()) << file << ": " << line;
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < std::min(fields.size(), names.size()); ++i) row[names[i]] = fields[i];
  }
  return rows;
}

/// Two poses, of which the second could not be used, with numbers made up by hand.
Evaluation evaluation() {
  static const std::string kSpecular = "specular";
  Evaluation all;
  PoseResult pose;
  pose.used = true;
  pose.frames = 25;
  pose.pose.name = "012";
  pose.pose.location = "desk <3>";
  pose.pose.stamp_ns = 1700000000250000000;
  pose.pose.T_map_radar = Eigen::Translation3d(1.5, -2.25, 1) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ());
  FieldMetrics& m = pose.attribution.central;
  m.active = {1, 2, 3};
  m.recalled = {1, 0, 2};
  m.top_hits = {1, 2, 4};
  m.top_count = {1, 3, 5};
  m.q1_energy = 0.125;
  m.q2_energy = 0.0625;
  m.q3_db = {-3, 1, 2};
  m.q4_sum_db = 30;
  m.q4_cells = 20;
  m.class_count = {1, 0, 2, 0, 0};
  ResponseRegion region;
  region.kind = RegionKind::kCorner;
  region.range_m = 4.5;
  region.azimuth_rad = 0.1;
  region.actor = "wall_north;wall_east";
  region.material = "Concrete;Concrete";
  region.support_db = -61.25;
  region.point = {4, 5, 1};
  region.measured_strong = true;
  pose.attribution.regions = {region};
  Residual residual;
  residual.residual_class = ResidualClass::kMissingSupport;
  residual.range_m = 4.5;
  residual.azimuth_rad = -M_PI / 6;
  residual.measured_db = -8.5;
  residual.simulated_db = -31.25;
  residual.region = 0;
  residual.actor = region.actor;
  residual.material = region.material;
  residual.records = {7, 3};
  pose.attribution.residuals = {residual};
  PathRecord record;
  record.event = &kSpecular;
  record.length_m.assign(8, 9.0);
  record.departure = {0, 1, 0};
  record.arrival = {1, 0, 0};
  record.bounces = 2;
  record.amplitude = 0.001;
  pose.residual_records[7] = record;
  pose.explained = {1, 1, 0.8};  // 0.64 of the power under the best gain
  all.explained = pose.explained;
  all.expected_known = true;
  all.poses = {pose, PoseResult()};
  all.poses[1].pose.name = "013";
  all.problems = {{"013", "pose '013': capture is <missing>"}};
  all.duplicates = {"014"};
  all.central.poses = 1;
  all.central.recall = 0.5;
  all.central.recall_band = {1, 0, 2.0 / 3};
  all.central.active = {1, 2, 3};
  all.central.recalled = {1, 0, 2};
  all.central.q3_median_db = 1;
  all.central.q1_energy = 0.125;
  all.central.class_count = {1, 0, 2, 0, 0};
  all.central.class_share = {1.0 / 3, 0, 2.0 / 3, 0, 0};
  all.outer.q3_median_db = std::nan("");
  return all;
}

class WrittenReport : public ::testing::Test {
 protected:
  WrittenReport() {
    run_.command = {"evaluate", "session & more"};
    run_.recording = "session <a>";
    run_.simulated = "twin";
    run_.version = "1.2.3";
    run_.attribution_yaml = "strong_db: -15\n";
    run_.radar_yaml = "device: awr2243\n";
    run_.inputs = {{"poses.csv", "abcd"}};
    ReportWriter(folder_.path()).write(evaluation(), AttributionConfig(), run_);
  }
  fs::path at(const std::string& name) const { return fs::path(folder_.path()) / name; }
  TemporaryFolder folder_;
  RunDescription run_;
};

TEST_F(WrittenReport, PosesHaveTheirNumbersUnderTheirNames) {
  const auto rows = rowsOf(at("poses.csv"));
  ASSERT_EQ(rows.size(), 1u) << "the second was not used";
  const std::map<std::string, std::string> expected = {{"pose", "012"},
                                                       {"location", "desk <3>"},
                                                       {"stamp", "1700000000.25"},
                                                       {"x_m", "1.5000"},
                                                       {"y_m", "-2.2500"},
                                                       {"heading_deg", "90.00"},
                                                       {"frames", "25"},
                                                       {"regions", "1"},
                                                       {"active", "6"},
                                                       {"recalled", "3"},
                                                       {"active_near", "1"},
                                                       {"active_mid", "2"},
                                                       {"recalled_mid", "0"},
                                                       {"active_far", "3"},
                                                       {"recalled_far", "2"},
                                                       {"q1_energy", "0.12500"},
                                                       {"q2_energy", "0.06250"},
                                                       {"q3_median_db", "1.000"},
                                                       {"q3_cells", "3"},
                                                       {"q4_mae_db", "1.500"},
                                                       {"c1", "1"},
                                                       {"c3", "2"},
                                                       {"c5", "0"},
                                                       {"conjugated_better", "0"},
                                                       {"explained_power", "0.64000"}};
  for (const auto& [name, value] : expected) EXPECT_EQ(rows[0].at(name), value) << name;
}

TEST_F(WrittenReport, ResidualsNameTheirRecords) {
  const auto rows = rowsOf(at("residuals.csv"));
  ASSERT_EQ(rows.size(), 1u);
  for (const auto& [name, value] : std::map<std::string, std::string>{{"pose", "012"},
                                                                      {"class", "C1"},
                                                                      {"label", "missing support"},
                                                                      {"material_change", "no"},
                                                                      {"stronger", "measured"},
                                                                      {"range_m", "4.500"},
                                                                      {"azimuth_deg", "-30.00"},
                                                                      {"measured_db", "-8.50"},
                                                                      {"simulated_db", "-31.25"},
                                                                      {"actor", "wall_north;wall_east"},
                                                                      {"region_kind", "corner"},
                                                                      {"records", "7;3"}}) {
    EXPECT_EQ(rows[0].at(name), value) << name;
  }
  const auto records = rowsOf(at("residual_records.csv"));
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].at("record"), "7");
  EXPECT_EQ(records[0].at("event"), "specular");
  EXPECT_EQ(records[0].at("range_m"), "4.500");
  EXPECT_EQ(records[0].at("azimuth_dep_deg"), "90.00");
  EXPECT_EQ(records[0].at("amplitude_db"), "-60.00");
}

TEST_F(WrittenReport, RegionsSayWhetherTheyAreSupported) {
  const auto rows = rowsOf(at("regions.csv"));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].at("kind"), "corner");
  EXPECT_EQ(rows[0].at("measured_strong"), "1");
  EXPECT_EQ(rows[0].at("simulated_strong"), "0");
  EXPECT_EQ(rows[0].at("y_m"), "5.000");
}

TEST_F(WrittenReport, TheSummaryHoldsTableRunAndProblems) {
  const nlohmann::json summary = nlohmann::json::parse(textOf(at("summary.json")));
  EXPECT_EQ(summary["format"], "mmradartwin_evaluation/1");
  EXPECT_EQ(summary["version"], "1.2.3");
  EXPECT_EQ(summary["central"]["recall"], 0.5);
  EXPECT_EQ(summary["central"]["recall_by_band"]["far"]["active"], 3);
  EXPECT_EQ(summary["central"]["classes"]["C3"]["count"], 2);
  EXPECT_TRUE(summary["outer"]["q3_median_db"].is_null());
  EXPECT_FALSE(summary["outer"].contains("classes"));
  EXPECT_EQ(summary["duplicates"], nlohmann::json({"014"}));
  EXPECT_EQ(summary["problems"][0]["pose"], "013");
  EXPECT_EQ(summary["inputs"][0]["sha256"], "abcd");
  EXPECT_FALSE(summary["configuration"].contains("twin"));
  EXPECT_FALSE(fs::exists(at("twin.yaml")));
  EXPECT_EQ(textOf(at("radar.yaml")), run_.radar_yaml);
}

TEST_F(WrittenReport, ThePageEscapesWhatOthersNamed) {
  const std::string page = textOf(at("report.html"));
  EXPECT_NE(page.find("session &lt;a&gt;"), std::string::npos);
  EXPECT_NE(page.find("capture is &lt;missing&gt;"), std::string::npos);
  EXPECT_NE(page.find("session &amp; more"), std::string::npos);
  EXPECT_EQ(page.find("session <a>"), std::string::npos);
  EXPECT_EQ(page.find("<img"), std::string::npos) << "there is no field to draw pictures of";
}

TEST_F(WrittenReport, TheFirstSentenceIsTheAnswer) {
  const nlohmann::json summary = nlohmann::json::parse(textOf(at("summary.json")));
  EXPECT_EQ(summary["answer"], "The twin explains 64 % of the measured power; 3 of 6 expected places do not match.");
  const std::string page = textOf(at("report.html"));
  const std::size_t answer = page.find("<p class=\"answer\">");
  ASSERT_NE(answer, std::string::npos);
  EXPECT_EQ(page.substr(answer, page.find("</p>", answer) - answer).find("The twin explains <data value=\"0.64"), 18u);
}

TEST_F(WrittenReport, ActorsStandInTheSummary) {
  const nlohmann::json summary = nlohmann::json::parse(textOf(at("summary.json")));
  ASSERT_EQ(summary["by_actor"].size(), 1u);
  EXPECT_EQ(summary["by_actor"][0]["actor"], "wall_north;wall_east");
  EXPECT_EQ(summary["by_actor"][0]["active"], 1);
  EXPECT_EQ(summary["by_actor"][0]["recalled"], 0);
  EXPECT_EQ(summary["by_actor"][0]["classes"]["C1"], 1);
  EXPECT_EQ(summary["poses"][0]["recalled"], 3);
  EXPECT_EQ(summary["paper"]["recall"], 0.708);
}

std::string answerOf(const Evaluation& evaluation) {
  const TemporaryFolder folder;
  ReportWriter(folder.path()).write(evaluation, AttributionConfig(), RunDescription());
  return nlohmann::json::parse(textOf(folder.path() + "/summary.json"))["answer"];
}

TEST(ReportAnswer, NamesTheWorstOfSeveralPoses) {
  Evaluation two = evaluation();
  two.poses[1] = two.poses[0];
  two.poses[1].pose.name = "<013>";
  two.poses[1].explained.cross = 0.5;
  EXPECT_EQ(
      answerOf(two),
      "The twin explains 64 % of the measured power; 3 of 6 expected places do not match. The worst is pose <013>: of "
      "its power the twin explains 16 %.");
  two.poses[1].explained.cross = 0;
  const std::string errs = answerOf(two), end = "pose <013>: in it the twin errs by more than what was measured.";
  EXPECT_EQ(errs.substr(errs.size() - end.size()), end);
}

TEST(ReportAnswer, SaysWhereThereIsNothingToTell) {
  Evaluation nothing = evaluation();
  nothing.explained = {};
  nothing.poses[0].explained = {};
  nothing.central.active = nothing.central.recalled = {};
  EXPECT_EQ(
      answerOf(nothing),
      "How much of the measured power the twin explains is not known, since nothing was measured; no expected place "
      "answers in the recording.");
  Evaluation one = evaluation();
  one.central.recalled = {1, 2, 2};
  EXPECT_EQ(answerOf(one), "The twin explains 64 % of the measured power; 1 of 6 expected places does not match.");
}

TEST(ReportTemplates, AreThoseOfTheFolder) {
  const TemporaryFolder templates, out;
  std::ofstream(templates.path() + "/evaluation.html") << "<p>{{answer}}</p>{{>mine.html}}";
  std::ofstream(templates.path() + "/mine.html") << "{{pose_count}} of mine\n{{nothing}}";
  try {
    ReportWriter(out.path(), templates.path());
    FAIL() << "an unknown name";
  } catch (const InputError& error) {
    EXPECT_EQ(std::string(error.what())
                  .rfind(templates.path() + "/mine.html:2: there is no name 'nothing'; known here: actors, ", 0),
              0u)
        << error.what();
  }
  std::ofstream(templates.path() + "/mine.html") << "{{version}} of mine";
  ReportWriter(out.path(), templates.path()).write(evaluation(), AttributionConfig(), RunDescription());
  const std::string page = textOf(out.path() + "/report.html");
  EXPECT_EQ(page.substr(page.size() - 8), " of mine");
}

TEST_F(WrittenReport, TheTextIsTheTableAndWhatWasLeftOut) {
  const std::string text = textOf(at("table.txt"));
  EXPECT_EQ(text, reportText(evaluation(), AttributionConfig()));
  for (const char* said : {"Residuals: 1 C1, 0 C2, 2 C3, 0 C4, 0 C5\n", "Duplicates excluded: 1 (014)\n",
                           "Not used: 1 poses (013)\n", "Q3 median - dB"}) {
    EXPECT_NE(text.find(said), std::string::npos) << said << text;
  }
}

TEST(ReportWriter, KeepsPicturesInItsFolder) {
  const TemporaryFolder folder;
  EXPECT_EQ(ReportWriter(folder.path()).pictureFile("../a/b"), folder.path() + "/pictures/.._a_b.png");
  EXPECT_TRUE(fs::is_directory(folder.path() + "/pictures"));
  std::ofstream(folder.path() + "/file") << "";
  EXPECT_THROW(ReportWriter(folder.path() + "/file"), InputError);
}

// FIPS 180-2, appendix B.1 and the digest of nothing.
TEST(FileHashes, AreSha256) {
  const TemporaryFolder folder;
  const std::string abc = folder.path() + "/abc", empty = folder.path() + "/empty";
  std::ofstream(abc) << "abc";
  std::ofstream(empty) << "";
  const std::vector<InputFile> hashes = hashFiles({abc, empty});
  EXPECT_EQ(hashes[0].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(hashes[1].sha256, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(hashes[0].file, abc);
  EXPECT_THROW(hashFiles({folder.path() + "/absent"}), InputError);
}

}  // namespace
}  // namespace mmradartwin
