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
std::string formatTable(const LedgerSummary& summary, const AttributionConfig& config, const std::string& title);

}  // namespace mmradartwin
