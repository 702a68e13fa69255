#include "mmradartwin_attribution/ledger.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "mmradartwin_dsp/statistics.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

double share(double part, double whole) { return whole > 0 ? part / whole : std::numeric_limits<double>::quiet_NaN(); }

std::string fixed(double value, int digits) {
  if (std::isnan(value)) return "-";
  std::ostringstream s;
  s.setf(std::ios::fixed);
  s.precision(digits);
  s << value;
  return s.str();
}

}  // namespace

void Ledger::add(const FieldMetrics& pose) {
  ++poses_;
  for (int i = 0; i < 3; ++i) {
    active_[i] += pose.active[i];
    recalled_[i] += pose.recalled[i];
    top_hits_[i] += pose.top_hits[i];
    top_count_[i] += pose.top_count[i];
  }
  q1_sum_ += pose.q1_energy;
  q2_sum_ += pose.q2_energy;
  q3_db_.insert(q3_db_.end(), pose.q3_db.begin(), pose.q3_db.end());
  q4_sum_db_ += pose.q4_sum_db;
  q4_cells_ += pose.q4_cells;
  for (int i = 0; i < 5; ++i) class_count_[i] += pose.class_count[i];
}

LedgerSummary Ledger::summary() const {
  LedgerSummary s;
  s.poses = poses_;
  s.active = active_;
  s.recalled = recalled_;
  s.recall =
      share(std::accumulate(recalled_.begin(), recalled_.end(), 0), std::accumulate(active_.begin(), active_.end(), 0));
  for (int i = 0; i < 3; ++i) {
    s.recall_band[i] = share(recalled_[i], active_[i]);
    s.top[i] = share(top_hits_[i], top_count_[i]);
  }
  s.q3_cells = static_cast<int>(q3_db_.size());
  std::vector<double> q3_db = q3_db_;
  std::sort(q3_db.begin(), q3_db.end());
  s.q3_median_db = quantileOfSorted(q3_db, 0.5);
  s.q3_iqr_db = quantileOfSorted(q3_db, 0.75) - quantileOfSorted(q3_db, 0.25);
  s.q1_energy = share(q1_sum_, poses_);
  s.q2_energy = share(q2_sum_, poses_);
  s.q4_mae_db = share(q4_sum_db_, static_cast<double>(q4_cells_));
  s.class_count = class_count_;
  const double residuals = std::accumulate(class_count_.begin(), class_count_.end(), 0);
  for (int i = 0; i < 5; ++i) s.class_share[i] = share(class_count_[i], residuals);
  return s;
}

const std::vector<PoseColumn>& poseColumns() {
  static const std::vector<PoseColumn> columns = {
      {"q1_energy", [](const FieldMetrics& m) { return fixedNumber(m.q1_energy, 5); }},
      {"q2_energy", [](const FieldMetrics& m) { return fixedNumber(m.q2_energy, 5); }},
      {"q1_cells", [](const FieldMetrics& m) { return std::to_string(m.q1_cells); }},
      {"q2_cells", [](const FieldMetrics& m) { return std::to_string(m.q2_cells); }},
      {"q3_median_db", [](const FieldMetrics& m) { return fixedNumber(quantile(m.q3_db, 0.5), 3); }},
      {"q3_cells", [](const FieldMetrics& m) { return std::to_string(m.q3_db.size()); }},
      {"q4_mae_db", [](const FieldMetrics& m) { return fixedNumber(share(m.q4_sum_db, m.q4_cells), 3); }},
      {"q4_cells", [](const FieldMetrics& m) { return std::to_string(m.q4_cells); }},
  };
  return columns;
}

std::vector<std::array<std::string, 3>> tableRows(const LedgerSummary& s, const std::vector<int>& top_k) {
  const auto joined = [](const std::array<double, 3>& v) {
    return fixed(v[0], 3) + "/" + fixed(v[1], 3) + "/" + fixed(v[2], 3);
  };
  std::vector<std::array<std::string, 3>> rows;
  std::string unit;  // of the last row
  const auto endRow = [&] {
    if (!rows.empty() && !unit.empty()) rows.back()[2] += " " + unit;
    unit.clear();
  };
  for (const ResidualMetric& metric : kResidualMetrics) {
    const std::string value = fixed(s.*metric.member, metric.digits);
    if (!rows.empty() && rows.back()[0] == metric.target) {
      rows.back()[1] += std::string("/") + metric.label;
      rows.back()[2] += "/" + value;
    } else {
      endRow();
      rows.push_back({metric.target, metric.label, value});
    }
    unit = metric.unit;
    if (metric.member == &LedgerSummary::recall) {
      rows.back()[2] += "; " + joined(s.recall_band);
      std::string peaks = "Top-";
      for (std::size_t i = 0; i < top_k.size(); ++i) peaks += (i ? "/" : "") + std::to_string(top_k[i]);
      rows.push_back({"Peaks", peaks, joined(s.top)});
    }
  }
  endRow();
  std::string routing;
  for (int i = 0; i < 5; ++i) routing += (i ? "/" : "") + fixed(100 * s.class_share[i], 0);
  rows.push_back({"Routing", "C1/C2/C3/C4/C5", routing + "%"});
  return rows;
}

std::string metricsLine(const LedgerSummary& summary) {
  std::string line;
  for (const ResidualMetric& metric : kResidualMetrics) {
    if (metric.word[0] == '\0') continue;
    line += (line.empty() ? "" : ", ") + std::string(metric.word) + " " + fixed(summary.*metric.member, metric.digits);
    if (metric.unit[0] != '\0') line += std::string(" ") + metric.unit;
  }
  return line;
}

std::string formatTable(const LedgerSummary& summary, const AttributionConfig& config, const std::string& title) {
  const auto rows = tableRows(summary, config.top_k);
  std::array<std::size_t, 3> width{6, 6, 6};
  for (const auto& row : rows) {
    for (int i = 0; i < 3; ++i) width[i] = std::max(width[i], row[i].size());
  }
  const auto line = [&](const std::array<std::string, 3>& row) {
    std::string text;
    for (int i = 0; i < 3; ++i) text += row[i] + (i < 2 ? std::string(width[i] - row[i].size() + 2, ' ') : "");
    return text + "\n";
  };
  const std::string rule(width[0] + width[1] + width[2] + 4, '-');
  std::string text = title + "\n" + rule + "\n" + line({"Target", "Metric", "Result"}) + rule + "\n";
  for (const auto& row : rows) text += line(row);
  return text + rule + "\n";
}

}  // namespace mmradartwin
