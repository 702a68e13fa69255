#include "mmradartwin_attribution/ledger.h"

#include <gtest/gtest.h>

#include "mmradartwin_attribution/live_ledger.h"
#include "mmradartwin_dsp/statistics.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

TEST(Quantile, InterpolatesBetweenOrderStatistics) {
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile({4, 1, 3, 2}, 0.25), 1.75);
  EXPECT_DOUBLE_EQ(quantile({5}, 0.75), 5);
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

FieldMetrics first() {
  FieldMetrics m;
  m.active = {2, 1, 0};
  m.recalled = {1, 1, 0};
  m.top_count = {1, 3, 5};
  m.top_hits = {1, 2, 2};
  m.q1_energy = 0.2;
  m.q2_energy = 0.1;
  m.q3_db = {1, 2, 3};
  m.q4_sum_db = 30;
  m.q4_cells = 10;
  m.class_count = {1, 2, 0, 1, 0};
  return m;
}

TEST(Ledger, PoolsCountsAndAveragesEnergies) {
  FieldMetrics second;
  second.active = {2, 3, 0};
  second.recalled = {2, 0, 0};
  second.top_count = {1, 3, 3};
  second.top_hits = {0, 1, 2};
  second.q1_energy = 0.6;
  second.q2_energy = 0;
  second.q3_db = {10};
  second.q4_sum_db = 10;
  second.q4_cells = 30;
  second.class_count = {0, 0, 0, 0, 6};
  Ledger ledger;
  ledger.add(first());
  ledger.add(second);
  const LedgerSummary s = ledger.summary();
  EXPECT_EQ(s.poses, 2);
  EXPECT_DOUBLE_EQ(s.recall, 4.0 / 8);
  EXPECT_DOUBLE_EQ(s.recall_band[0], 3.0 / 4);
  EXPECT_DOUBLE_EQ(s.recall_band[1], 1.0 / 4);
  EXPECT_TRUE(std::isnan(s.recall_band[2]));
  EXPECT_DOUBLE_EQ(s.top[0], 0.5);
  EXPECT_DOUBLE_EQ(s.top[1], 0.5);
  EXPECT_DOUBLE_EQ(s.top[2], 0.5);
  EXPECT_DOUBLE_EQ(s.q1_energy, 0.4);
  EXPECT_DOUBLE_EQ(s.q2_energy, 0.05);
  EXPECT_DOUBLE_EQ(s.q3_median_db, 2.5);
  EXPECT_DOUBLE_EQ(s.q3_iqr_db, 4.75 - 1.75);
  EXPECT_DOUBLE_EQ(s.q4_mae_db, 1.0);
  EXPECT_DOUBLE_EQ(s.class_share[4], 0.6);
}

TEST(Ledger, PrintsThePapersTable) {
  Ledger ledger;
  ledger.add(first());
  const std::string table = formatTable(ledger.summary(), AttributionConfig(), "title");
  for (const char* part :
       {"Target        Metric          Result", "Placement     Recall          0.667; 0.500/1.000/-",
        "Peaks         Top-1/3/5       1.000/0.667/0.400", "Matched amp.  Q3 median/IQR   2.00/1.00 dB",
        "Under-pred.   Q1 energy       0.200", "Over-pred.    Q2 energy       0.100",
        "Background    Q4 MAE          3.00 dB", "Routing       C1/C2/C3/C4/C5  25/50/0/25/0%"}) {
    EXPECT_NE(table.find(part), std::string::npos) << part << "\nin\n" << table;
  }
}

class LiveLedgerTest : public ::testing::Test {
 protected:
  void stand(double begin_s, double seconds, double x_m, double heading_deg, const std::string& name, double q1) {
    for (int i = 0; i <= static_cast<int>(seconds * 20); ++i) {
      FieldMetrics m;
      m.q1_energy = q1;
      ledger_.add(static_cast<std::int64_t>((begin_s + i * 0.05) * 1e9), pose(x_m, heading_deg), name, i + 1, m);
    }
  }
  static Eigen::Isometry3d pose(double x_m, double heading_deg) {
    return Eigen::Translation3d(x_m, 0, 1) *
           Eigen::AngleAxisd(heading_deg * synthetic::kDegree, Eigen::Vector3d::UnitZ());
  }
  LiveLedger ledger_;
};

TEST_F(LiveLedgerTest, AStretchCountsOnce) {
  stand(0, 5, 0, 0, "a", 0.2);
  EXPECT_EQ(ledger_.summary().poses, 1);
  stand(10, 5, 1, 0, "b", 0.4);
  EXPECT_EQ(ledger_.summary().poses, 2);
  EXPECT_DOUBLE_EQ(ledger_.summary().q1_energy, 0.3);
  stand(20, 5, 1, 30, "c", 0.6);
  EXPECT_EQ(ledger_.summary().poses, 3) << "a turn is another pose";
}

TEST_F(LiveLedgerTest, ShortStretchesAreMovement) {
  stand(0, 5, 0, 0, "a", 0.2);
  for (int i = 1; i < 20; ++i) stand(5 + i * 0.5, 0.4, i * 0.1, 0, "moving", 1);
  EXPECT_EQ(ledger_.summary().poses, 1);
}

TEST_F(LiveLedgerTest, TheLongestAverageIsWhatCounts) {
  FieldMetrics early, late;
  early.q1_energy = 0.9;
  late.q1_energy = 0.1;
  ledger_.add(0, pose(0, 0), "a", 1, early);
  ledger_.add(2000000000, pose(0, 0), "a", 100, late);
  ledger_.add(2050000000, pose(0, 0), "a", 1, early);  // the average began anew
  EXPECT_DOUBLE_EQ(ledger_.summary().q1_energy, 0.1);
}

TEST_F(LiveLedgerTest, DuplicatesAreLeftOutAndListed) {
  stand(0, 5, 0, 0, "a", 0.2);
  stand(10, 5, 1, 0, "b", 0.4);
  stand(20, 5, 0.05, 0.5, "again", 0.9);
  EXPECT_EQ(ledger_.summary().poses, 2);
  EXPECT_EQ(ledger_.duplicates(), std::vector<std::string>{"again"});
  stand(30, 5, 2, 0, "c", 0.3);
  EXPECT_EQ(ledger_.summary().poses, 3);
  EXPECT_EQ(ledger_.duplicates(), std::vector<std::string>{"again"});
}

TEST_F(LiveLedgerTest, ALongDayNamesTheLastHundredDuplicates) {
  stand(0, 2, 0, 0, "a", 0.2);
  for (int i = 1; i <= 300; ++i) stand(10 * i, 1.5, i % 2, 0, std::to_string(i), 0.2);
  const std::vector<std::string> names = ledger_.duplicates();
  ASSERT_EQ(names.size(), 101u);
  EXPECT_EQ(names.front(), "200");
  EXPECT_EQ(names.back(), "300");
}

}  // namespace
}  // namespace mmradartwin
