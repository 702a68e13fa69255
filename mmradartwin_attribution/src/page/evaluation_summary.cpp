#include "page/evaluation_summary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "mmradartwin_dsp/statistics.h"
#include "mmradartwin_dsp/units.h"
#include "page/paper_figures.h"

namespace mmradartwin::page {
namespace {

nlohmann::json orNull(double value) { return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr); }

nlohmann::json fieldSummary(const LedgerSummary& s) {
  nlohmann::json j;
  j["poses"] = s.poses;
  for (const ResidualMetric& metric : kResidualMetrics) j[metric.name] = orNull(s.*metric.member);
  for (int i = 0; i < 3; ++i) {
    const char* bands[] = {"near", "mid", "far"};
    j["recall_by_band"][bands[i]] = {
        {"recall", orNull(s.recall_band[i])}, {"active", s.active[i]}, {"recalled", s.recalled[i]}};
    j["top"].push_back(orNull(s.top[i]));
  }
  j["q3_cells"] = s.q3_cells;
  for (int i = 0; i < 5; ++i) {
    j["classes"]["C" + std::to_string(i + 1)] = {{"count", s.class_count[i]}, {"share", orNull(s.class_share[i])}};
  }
  return j;
}

int sumOf(const std::array<int, 3>& counts) { return std::accumulate(counts.begin(), counts.end(), 0); }

nlohmann::json classCounts(const std::array<int, 5>& counts) {
  nlohmann::json j;
  for (std::size_t i = 0; i < 5; ++i) j["C" + std::to_string(i + 1)] = counts[i];
  return j;
}

nlohmann::json poseSummary(const Evaluation& evaluation, const PoseResult& pose) {
  const FieldMetrics& m = pose.attribution.central;
  nlohmann::json j = {{"pose", pose.pose.name},
                      {"location", pose.pose.location},
                      {"explained_power", orNull(evaluation.explainedShare(pose))},
                      {"active", sumOf(m.active)},
                      {"recalled", sumOf(m.recalled)},
                      {"q1_energy", orNull(m.q1_energy)},
                      {"q2_energy", orNull(m.q2_energy)},
                      {"q3_median_db", orNull(quantile(m.q3_db, 0.5))},
                      {"q4_mae_db", orNull(m.q4_cells > 0 ? m.q4_sum_db / m.q4_cells : std::nan(""))}};
  j["classes"] = classCounts(m.class_count);
  return j;
}

/// Expected places that answered in the recording, and residuals, of one actor or of several that make a corner.
struct ActorCount {
  int active = 0, recalled = 0;
  std::array<int, 5> classes{};
  int residuals() const { return std::accumulate(classes.begin(), classes.end(), 0); }
};

nlohmann::json byActor(const Evaluation& evaluation) {
  std::map<std::string, ActorCount> counts;
  for (const PoseResult& pose : evaluation.poses) {
    for (const ResponseRegion& region : pose.attribution.regions) {
      if (region.field != Field::kCentral || !region.measured_strong) continue;
      ++counts[region.actor].active;
      counts[region.actor].recalled += region.simulated_strong ? 1 : 0;
    }
    for (const Residual& residual : pose.attribution.residuals) {
      ++counts[residual.actor].classes[static_cast<std::size_t>(residual.residual_class) - 1];
    }
  }
  std::vector<std::pair<std::string, ActorCount>> ordered(counts.begin(), counts.end());
  std::stable_sort(ordered.begin(), ordered.end(), [](const auto& a, const auto& b) {
    return a.second.active - a.second.recalled + a.second.residuals() >
           b.second.active - b.second.recalled + b.second.residuals();
  });
  nlohmann::json j = nlohmann::json::array();
  for (const auto& [actor, count] : ordered) {
    j.push_back({{"actor", actor},
                 {"active", count.active},
                 {"recalled", count.recalled},
                 {"classes", classCounts(count.classes)}});
  }
  return j;
}

/// Indices in "poses", the pose that is explained least first; those of which that is not known stand last.
std::vector<std::size_t> fromWorst(const nlohmann::json& poses) {
  std::vector<std::size_t> order(poses.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const nlohmann::json &x = poses[a]["explained_power"], &y = poses[b]["explained_power"];
    if (x.is_null() || y.is_null()) return !x.is_null();
    return x.get<double>() < y.get<double>();
  });
  return order;
}

}  // namespace

nlohmann::json evaluationSummary(const Evaluation& evaluation, const AttributionConfig& config,
                                 const RunDescription& run) {
  nlohmann::json j;
  j["format"] = "mmradartwin_evaluation/1";
  j["version"] = run.version;
  j["command"] = run.command;
  j["recording"] = run.recording;
  j["simulated"] = run.simulated;
  j["explained_power"] = orNull(evaluation.explainedShare());
  j["explained_power_against"] = evaluation.expected_known ? "expectation over phases" : "one draw of phases";
  j["central"] = fieldSummary(evaluation.central);
  j["central"]["min_range_m"] = config.min_range_m;
  j["central"]["near_limit_m"] = config.near_limit_m;
  j["central"]["far_limit_m"] = config.far_limit_m;
  j["central"]["max_azimuth_deg"] = std::round(1e9 * config.max_azimuth_rad / kDegree) / 1e9;
  const int active = sumOf(evaluation.central.active), recalled = sumOf(evaluation.central.recalled);
  j["expected_places"] = {{"active", active}, {"recalled", recalled}, {"missed", active - recalled}};
  j["by_actor"] = byActor(evaluation);
  j["outer"] = fieldSummary(evaluation.outer);
  j["outer"].erase("classes");
  for (const PaperFigure& figure : kPaperFigures) {
    j["paper"][nlohmann::json::json_pointer(figure.name)] = figure.value;
  }
  j["paper"]["poses"] = kPaperPoses;
  j["poses"] = nlohmann::json::array();
  for (const PoseResult& pose : evaluation.poses) {
    if (pose.used) j["poses"].push_back(poseSummary(evaluation, pose));
  }
  const std::vector<std::size_t> order = fromWorst(j["poses"]);
  j["worst_first"] = nlohmann::json::array();
  for (std::size_t i : order) j["worst_first"].push_back(j["poses"][i]["pose"]);
  j["convention"] = {{"poses_where_conjugated_agrees_better", evaluation.conjugated_better}};
  j["duplicates"] = evaluation.duplicates;
  j["problems"] = nlohmann::json::array();
  for (const PoseProblem& p : evaluation.problems) j["problems"].push_back({{"pose", p.pose}, {"message", p.message}});
  j["configuration"] = {{"attribution", "attribution.yaml"}, {"radar", "radar.yaml"}};
  if (!run.twin_yaml.empty()) j["configuration"]["twin"] = "twin.yaml";
  j["inputs"] = nlohmann::json::array();
  for (const InputFile& f : run.inputs) j["inputs"].push_back({{"file", f.file}, {"sha256", f.sha256}});
  return j;
}

}  // namespace mmradartwin::page
