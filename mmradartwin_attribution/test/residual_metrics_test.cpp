#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_attribution/report.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {
namespace {

std::string textOf(const std::string& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// 1.25, 2.25, ...: no two alike with the fewest digits that a metric has.
double valueOf(std::size_t metric) { return static_cast<double>(metric) + 1.25; }

std::string decimal(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof(text), "%.*f", digits, value);
  return text;
}

class ResidualMetrics : public ::testing::Test {
 protected:
  ResidualMetrics() {
    evaluation_.poses.resize(1);
    evaluation_.poses[0].used = true;
    evaluation_.poses[0].pose.name = "000";
    for (std::size_t i = 0; i < std::size(kResidualMetrics); ++i) {
      evaluation_.central.*kResidualMetrics[i].member = valueOf(i);
      evaluation_.outer.*kResidualMetrics[i].member = -valueOf(i);
    }
    ReportWriter(folder_.path()).write(evaluation_, AttributionConfig(), RunDescription());
  }
  std::string file(const std::string& name) const { return textOf(folder_.path() + "/" + name); }

  TemporaryFolder folder_;
  Evaluation evaluation_;
};

TEST_F(ResidualMetrics, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const ResidualMetric& metric : kResidualMetrics) EXPECT_TRUE(names.insert(metric.name).second) << metric.name;
}

TEST_F(ResidualMetrics, StandInTableAndPage) {
  const auto rows = tableRows(evaluation_.central, {1, 3, 5});
  const std::string text = file("table.txt"), page = file("report.html");
  for (std::size_t i = 0; i < std::size(kResidualMetrics); ++i) {
    const ResidualMetric& metric = kResidualMetrics[i];
    std::size_t found = 0;
    for (const auto& row : rows) {
      if (row[0] != metric.target) continue;
      ++found;
      EXPECT_NE(row[1].find(metric.label), std::string::npos) << metric.name;
      EXPECT_NE(row[2].find(decimal(valueOf(i), metric.digits)), std::string::npos) << metric.name << ": " << row[2];
      EXPECT_NE(row[2].find(metric.unit), std::string::npos) << metric.name;
      EXPECT_NE(text.find(row[2]), std::string::npos) << metric.name;
      const std::string cell = "<data value=\"" + nlohmann::json(valueOf(i)).dump() +
                               "\" data-of=\"summary.json#/central/" + metric.name + "\">";
      EXPECT_NE(page.find(cell), std::string::npos) << metric.name;
    }
    EXPECT_EQ(found, 1u) << metric.name;
    if (metric.word[0] == '\0') continue;
    const std::string said = metric.word + (" " + decimal(-valueOf(i), metric.digits));
    EXPECT_NE(text.find(said), std::string::npos) << said << "\nin\n" << text;
  }
}

TEST_F(ResidualMetrics, StandInTheSummary) {
  const nlohmann::json summary = nlohmann::json::parse(file("summary.json"));
  for (std::size_t i = 0; i < std::size(kResidualMetrics); ++i) {
    const char* name = kResidualMetrics[i].name;
    ASSERT_TRUE(summary["central"].contains(name)) << name;
    EXPECT_EQ(summary["central"][name], valueOf(i)) << name;
    EXPECT_EQ(summary["outer"][name], -valueOf(i)) << name;
  }
}

TEST_F(ResidualMetrics, OfSinglePosesStandInTheCsv) {
  // Of one pose there are counts of recalled regions; the spread of amplitudes is one of all poses.
  const std::set<std::string> of_all_poses = {"recall", "q3_iqr_db"};
  std::istringstream csv(file("poses.csv"));
  std::string header;
  std::getline(csv, header);
  header = "," + header + ",";
  for (const ResidualMetric& metric : kResidualMetrics) {
    const bool stands = header.find("," + std::string(metric.name) + ",") != std::string::npos;
    EXPECT_EQ(stands, of_all_poses.count(metric.name) == 0) << metric.name;
  }
}

}  // namespace
}  // namespace mmradartwin
