#include "mmradartwin_attribution/diagnosis_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

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

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// What a page shows: its text without tags, blocks and cells separated by blanks.
std::string shownOf(const std::string& html) {
  std::string text;
  for (std::size_t at = 0; at < html.size(); ++at) {
    if (html[at] != '<') {
      text += html[at];
      continue;
    }
    const std::size_t end = html.find('>', at);
    std::string name = html.substr(at + 1, html.find_first_of(" >", at) - at - 1);
    if (name.front() == '/') name.erase(0, 1);
    if (name != "data" && name != "span" && name != "code") text += ' ';
    at = end;
  }
  std::string single;
  for (char c : text) {
    if (c != ' ' || single.empty() || single.back() != ' ') single += c;
  }
  return single;
}

/// A page without the meanings of its words.
std::string withoutMeanings(std::string html) {
  const std::string start = "<span class=\"meaning\"", end = "</span>";
  for (std::size_t at = html.find(start); at != std::string::npos; at = html.find(start, at)) {
    html.erase(at, html.find(end, at) + end.size() - at);
  }
  return html;
}

RunDescription run() {
  RunDescription run;
  run.command = {"/some/where/diagnose", "my <session>"};
  run.recording = "my <session>";
  run.version = "1.2.3";
  run.inputs = {{"poses.csv", "abcd"}};
  return run;
}

Diagnosis withAbsence() {
  Diagnosis d;
  d.has_twin = false;
  d.findings.held_out = "nothing: one location";
  Finding f;
  f.cause = "actor_absent";
  f.parameters = {{"actor", "", std::string("cabinet"), {}}};
  f.candidates = {{f.cause, 1.0}};
  f.where.emplace_back();
  f.records = {{"001", "specular", {"cabinet"}, RecordState{-80, 2, 10}, std::nullopt}};
  d.findings.findings = {f};
  d.plan.walls = {{"cabinet", {3, 1}, {3, 2}}};
  d.plan.stations = {{"001", {1, 1}, {1, 0}}, {"002", {1, 3}, {1, 0}}};
  return d;
}

/// A session with all that a page may have to show, names that HTML has to escape among it.
Diagnosis withAll() {
  Diagnosis d = withAbsence();
  d.findings.poses = 24;
  d.findings.locations = 12;
  d.findings.held_out = "5 folds of places <each>";
  d.problems = {{"009", "pose '009': capture is missing & lost"}};
  Finding bias;
  bias.cause = "range_bias";
  bias.parameters = {{"range_m", "m", 0.05125, {{{0.0498, 0.0527}}}}};
  bias.candidates = {{"range_bias", 0.8125}, {"pose_time_lag", 0.1875}};
  bias.experiment = "measure a wall at 2 m & at 4 m";
  bias.evidence = {321.25, 0.0015, "pose_time_lag", 17.5};
  bias.gain.emplace();
  bias.gain->explained_power = {0.25, 0.625, {{0.3125, 0.4375}}};
  bias.gain->recall = {0.5, 0.75, {}};
  bias.gain->classes[3] = {40, 2, {}};
  FindingPlace place;
  place.range_m = {1.5, 6.25};
  place.azimuth_deg = {-30.5, 12.5};
  place.actors = {"shelf <left>"};
  place.poses = {"001", "002"};
  place.x_m = 1.25;
  place.y_m = -2.5;
  bias.where = {place};
  bias.description = "all echoes lie 5 cm < farther";
  d.findings.findings.insert(d.findings.findings.begin(), bias);
  TriedHypothesis found, refused, screened;
  found.label = "range_bias";
  found.screened_nats = 300.5;
  found.gain = 321.25;
  found.gain_without_best_place = 280.75;
  found.overdispersion = 1.5;
  found.held_out_gain = 260.5;
  found.false_alarm_rate = 0.0015;
  found.fitted = "range_m 0.0513";
  found.verdict = "found";
  refused = found;
  refused.round = 1;
  refused.label = "actor_moved \"desk\"";
  refused.screened_nats = 75.125;
  refused.verdict = "explains less, than chance";
  screened.label = "wall_ghost";
  screened.screened_nats = 0.5;
  screened.gain = std::numeric_limits<double>::quiet_NaN();
  d.tried = {found, refused, screened};
  return d;
}

TEST(DiagnosisReport, LeavesNothingOfTheOneBeforeBesideItsOwn) {
  const TemporaryFolder folder;
  const fs::path at = folder.path();
  const DiagnosisReport report(at.string());
  report.write(withAbsence(), run());
  const fs::path figure = at / "figures/actor_absent.png", records = at / "records/actor_absent.csv";
  ASSERT_TRUE(fs::exists(figure) && fs::exists(records));
  std::ofstream(at / "figures/mine.png") << "a picture of the user's";

  report.write(withAbsence(), run());
  EXPECT_TRUE(fs::exists(figure) && fs::exists(records));
  Diagnosis nothing = withAbsence();
  nothing.findings.findings.clear();
  report.write(nothing, run());
  EXPECT_FALSE(fs::exists(figure));
  EXPECT_FALSE(fs::exists(records));
  EXPECT_TRUE(fs::exists(at / "figures/mine.png"));
}

class DiagnosisFiles : public ::testing::Test {
 protected:
  DiagnosisFiles() { DiagnosisReport(folder_.path()).write(withAll(), run()); }
  std::string read(const std::string& name) const { return textOf(fs::path(folder_.path()) / name); }
  TemporaryFolder folder_;
};

TEST_F(DiagnosisFiles, HypothesesStandInTriedCsvWithTheirNumbers) {
  std::istringstream lines(read("tried.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line,
            "round,hypothesis,promised_nats,gain_nats,gain_without_best_place_nats,inflation,held_out_nats,"
            "false_alarm_rate,fitted,verdict");
  std::getline(lines, line);
  EXPECT_EQ(line, "0,\"range_bias\",300.5,321.25,280.75,1.5,260.5,0.0015,\"range_m 0.0513\",\"found\"");
  std::getline(lines, line);
  EXPECT_EQ(line,
            "1,\"actor_moved \"\"desk\"\"\",75.125,321.25,280.75,1.5,260.5,0.0015,\"range_m 0.0513\","
            "\"explains less, than chance\"");
  std::getline(lines, line);
  EXPECT_EQ(line, "0,\"wall_ghost\",0.5,,,,,,,");
  EXPECT_FALSE(std::getline(lines, line));
}

TEST_F(DiagnosisFiles, ChangedPathsStandInTheirCsvWithTheirNumbers) {
  std::istringstream lines(read("records/actor_absent.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line,
            "pose,event,actors,amplitude_before_db,range_before_m,azimuth_before_deg,amplitude_after_db,range_after_m,"
            "azimuth_after_deg");
  std::getline(lines, line);
  EXPECT_EQ(line, "\"001\",specular,\"cabinet\",-80,2,10,,,");
}

TEST_F(DiagnosisFiles, ThePageSaysWhatTheFindingsSay) {
  const std::string page = shownOf(withoutMeanings(read("report.html")));
  for (const char* said : {"Two things are wrong. One of these it is, and the recording does not tell which: "
                           "range_bias (81 %), pose_time_lag "
                           "(19 %).",
                           "cabinet stands in the scene and not in the room.",
                           "24 poses at 12 places.",
                           "5 folds of places &lt;each&gt;",
                           "pose '009': capture is missing &amp; lost",
                           "1. range_bias (C4)",
                           "range_m = 0.0512 m (0.0498 to 0.0527)",
                           "all echoes lie 5 cm &lt; farther",
                           "likelier by 321 nats",
                           "a chance of 0.15 %",
                           "The next best name, pose_time_lag, gains 17.5 nats",
                           "To tell: measure a wall at 2 m &amp; at 4 m",
                           "At x = 1.25 m, y = \u22122.5 m in the map",
                           "from 1.5 to 6.25 m and from \u221230.5 to 12.5\u00b0",
                           "Actor: shelf &lt;left&gt;",
                           "Poses that show it most: 001, 002",
                           "25 % 62 % 31 % to 44 %",
                           "50 % 75 %",
                           "40 2",
                           "2. actor_absent (C3)",
                           "specular, cabinet 001 \u221280 2 10",
                           "range_bias 1 321 found",
                           "diagnose 'my &lt;session&gt;'",
                           "abcd poses.csv"}) {
    EXPECT_TRUE(contains(page, said)) << said << "\n" << page;
  }
  EXPECT_FALSE(contains(page, "wall_ghost")) << "less than one nat was promised";
  EXPECT_FALSE(contains(page, "log-likelihood per pose")) << "has no number";
  EXPECT_FALSE(contains(page, "twin.extended.yaml")) << "there is no twin";
}

TEST_F(DiagnosisFiles, ThePageHoldsItsPictures) {
  const std::string page = read("report.html");
  int pictures = 0;
  for (std::size_t at = page.find("src=\""); at != std::string::npos; at = page.find("src=\"", at + 1)) {
    EXPECT_EQ(page.compare(at + 5, 22, "data:image/png;base64,"), 0);
    ++pictures;
  }
  EXPECT_EQ(pictures, 2);  // the room of each finding
  EXPECT_FALSE(contains(page, "href="));
}

TEST_F(DiagnosisFiles, FindingsAreReadBack) {
  const Findings findings = readFindings(folder_.path() + "/findings.json");
  ASSERT_EQ(findings.findings.size(), 2u);
  EXPECT_EQ(findings.findings[0].figure, "figures/range_bias.png");
  EXPECT_EQ(findings.findings[0].gain->explained_power.after, 0.625);
  EXPECT_FALSE(findings.extended_twin);
}

TEST(DiagnosisReport, FindingsOfOneCauseHaveFilesOfTheirOwn) {
  const TemporaryFolder folder;
  Diagnosis d = withAbsence();
  d.findings.findings.push_back(d.findings.findings.front());
  d.has_twin = true;
  d.extended.radar = RadarConfig();
  DiagnosisReport(folder.path()).write(d, run());
  for (const char* name :
       {"figures/actor_absent.png", "figures/actor_absent_2.png", "records/actor_absent_2.csv", "twin.extended.yaml"}) {
    EXPECT_TRUE(fs::exists(fs::path(folder.path()) / name)) << name;
  }
}

TEST(DiagnosisText, IsALineForEachFindingAndItsGain) {
  Diagnosis d = withAll();
  d.has_twin = true;
  d.explained_power = 0.4375;
  d.compared = {{"other.yaml", -12.5, {-20, -5}, 0.375}};
  const std::string text = diagnosisText(d);
  for (const char* said :
       {"Verdict: named, 24 poses at 12 locations; the twin as given explains 0.438 of the measured power\n",
        "other.yaml explains the same channels 12.5 nats less likely (-20 to -5 more by places) and 0.375 of the "
        "measured power\n",
        "1. range_bias (C4), range_m = 0.05125 m (0.0498 to 0.0527)\n",
        "   explained power on held-out places 0.25 -> 0.625 (difference 0.312 to 0.438, 95 %), recall 0.5 -> 0.75\n",
        "   not told apart: range_bias (0.81) pose_time_lag (0.19); to tell: measure a wall at 2 m & at 4 m\n",
        "2. actor_absent (C3), actor = cabinet\n"}) {
    EXPECT_TRUE(contains(text, said)) << said << "\n" << text;
  }
}

TEST(DiagnosisText, WhatAMechanismNeedsBesidesIsToldUnlessItIsUsual) {
  Diagnosis d = withAbsence();
  Finding& f = d.findings.findings.front();
  f.cause = "actor_unmodelled";
  f.parameters = {{"x_m", "m", 1.0, {}}, {"y_m", "m", 2.0, {}}, {"size_m", "m", 0.5, {}}};
  f.mechanism = NamedParameters{"actor_unmodelled", {}};
  f.mechanism->values.set("x_m", 1.0);
  f.mechanism->values.set("shape", std::string("cylinder"));
  f.mechanism->values.set("bottom_m", 0.625);
  const std::string text = diagnosisText(d);
  EXPECT_TRUE(contains(text, "bottom_m = 0.625")) << text;
  EXPECT_EQ(text.find("x_m"), text.rfind("x_m")) << "told once: " << text;
}

}  // namespace
}  // namespace mmradartwin
