#pragma once

#include <array>
#include <string>
#include <vector>

#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {

/// The paper's evaluation metrics over a set of poses, one field of view. NaN where nothing was there to count.
struct LedgerSummary {
  int poses = 0;
  double recall = 0;
  std::array<double, 3> recall_band{};  ///< near, mid, far
  std::array<int, 3> active{}, recalled{};
  std::array<double, 3> top{};  ///< by config.top_k
  double q3_median_db = 0, q3_iqr_db = 0;
  int q3_cells = 0;
  double q1_energy = 0, q2_energy = 0;  ///< means over poses
  double q4_mae_db = 0;
  std::array<int, 5> class_count{};
  std::array<double, 5> class_share{};  ///< of all residuals
};

enum class Better { kGreater, kSmaller, kNearZero };

/// One figure of a ledger. Its names, unit and member stand here alone: table, text, JSON and message are filled from
/// the list below.
struct ResidualMetric {
  const char* name;  ///< in JSON; of the Ledger message's field, too
  const char* unit;  ///< "" for a share
  double LedgerSummary::*member;
  Better better;
  const char* target;  ///< row of the paper's table; metrics of one target stand side by side
  const char* label;   ///< in that row
  const char* word;    ///< in the line about the outer field; "" where it is left out
  int digits;
};

inline constexpr ResidualMetric kResidualMetrics[] = {
    {"recall", "", &LedgerSummary::recall, Better::kGreater, "Placement", "Recall", "recall", 3},
    {"q3_median_db", "dB", &LedgerSummary::q3_median_db, Better::kNearZero, "Matched amp.", "Q3 median", "Q3 median",
     2},
    {"q3_iqr_db", "dB", &LedgerSummary::q3_iqr_db, Better::kSmaller, "Matched amp.", "IQR", "", 2},
    {"q1_energy", "", &LedgerSummary::q1_energy, Better::kSmaller, "Under-pred.", "Q1 energy", "Q1", 3},
    {"q2_energy", "", &LedgerSummary::q2_energy, Better::kSmaller, "Over-pred.", "Q2 energy", "Q2", 3},
    {"q4_mae_db", "dB", &LedgerSummary::q4_mae_db, Better::kSmaller, "Background", "Q4 MAE", "Q4", 2},
};

/// A column of poses.csv about the cells of one pose.
struct PoseColumn {
  const char* name;  ///< the metric's where it is one of a single pose
  std::string (*text)(const FieldMetrics& pose);
};
const std::vector<PoseColumn>& poseColumns();

/// Adds up poses. Regions, cells and responses are pooled; Q1 and Q2 energy are means over poses.
class Ledger {
 public:
  void add(const FieldMetrics& pose);
  LedgerSummary summary() const;

 private:
  int poses_ = 0;
  std::array<int, 3> active_{}, recalled_{}, top_hits_{}, top_count_{};
  double q1_sum_ = 0, q2_sum_ = 0, q4_sum_db_ = 0;
  long long q4_cells_ = 0;
  std::vector<double> q3_db_;
  std::array<int, 5> class_count_{};
};

/// The paper's table (Target, Metric, Result) as text, in its layout: Placement, Peaks, Matched amp., Under-pred.,
/// Over-pred., Background, Routing.
std::vector<std::array<std::string, 3>> tableRows(const LedgerSummary& summary, const std::vector<int>& top_k);
/// The metrics with words and units in one line: "recall 0.500, Q3 median 1.00 dB, ...".
std::string metricsLine(const LedgerSummary& summary);
std::string formatTable(const LedgerSummary& summary, const AttributionConfig& config, const std::string& title);

}  // namespace mmradartwin
