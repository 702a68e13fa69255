#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "diagnosis/catalogue/finding_format.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin {

using namespace diagnosis::catalogue;

namespace {

using Json = nlohmann::ordered_json;  ///< keys keep the order in which people read them

template <typename T>
Json orNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json(const Parameters::Value& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

Json json(const FindingParameter& parameter) {
  Json j;
  const double* value = std::get_if<double>(&parameter.value);
  j["value"] = value ? number(*value) : json(parameter.value);
  if (!parameter.unit.empty()) j["unit"] = parameter.unit;
  if (!parameter.ci95.empty()) {
    const bool single = kindOf(parameter.value) == ParameterKind::kNumber;
    j["ci95"] = single ? Json(parameter.ci95.front()) : Json(parameter.ci95);
  }
  return j;
}

Json json(const GainMetric& metric) {
  return {{"before", number(metric.before)},
          {"after", number(metric.after)},
          {"difference_ci95", orNull(metric.difference_ci95)}};
}

Json json(const FindingGain& gain) {
  Json j;
  j["explained_power"] = json(gain.explained_power);
  j["log_likelihood_per_pose"] = json(gain.log_likelihood_per_pose);
  j["recall"] = json(gain.recall);
  for (std::size_t i = 0; i < 3; ++i) j["recall"]["bands"][kRecallBands[i]] = json(gain.recall_band[i]);
  j["q1"] = json(gain.q1);
  j["q2"] = json(gain.q2);
  j["q3_median_db"] = json(gain.q3_median_db);
  for (std::size_t i = 0; i < 5; ++i) j["classes"]["C" + std::to_string(i + 1)] = json(gain.classes[i]);
  return j;
}

Json json(const Finding& finding) {
  const CauseDescription& cause = causeDescription(finding.cause);
  Json j;
  j["cause"] = finding.cause;
  j["class"] = className(cause.residual_class);
  j["action"] = cause.action();
  j["parameters"] = Json::object();
  for (const FindingParameter& parameter : finding.parameters) j["parameters"][parameter.name] = json(parameter);
  j["mechanism"] = nullptr;
  if (finding.mechanism) {
    Json values = Json::object();
    for (const auto& [name, value] : finding.mechanism->values.all()) values[name] = json(value);
    j["mechanism"] = Json::object();
    j["mechanism"][finding.mechanism->mechanism] = values;
  }
  j["candidates"] = Json::array();
  for (const CauseProbability& candidate : finding.candidates) {
    Json c{{"cause", candidate.cause}, {"probability", candidate.probability}};
    for (const FindingParameter& parameter : candidate.parameters) c["parameters"][parameter.name] = json(parameter);
    j["candidates"].push_back(c);
  }
  j["experiment"] = orNull(finding.experiment);
  j["evidence"] = {{"log_likelihood_gain", finding.evidence.log_likelihood_gain},
                   {"false_alarm_rate", finding.evidence.false_alarm_rate},
                   {"runner_up", orNull(finding.evidence.runner_up)},
                   {"margin", orNull(finding.evidence.margin)}};
  j["gain"] = finding.gain ? json(*finding.gain) : Json(nullptr);
  j["where"] = Json::array();
  for (const FindingPlace& place : finding.where) {
    j["where"].push_back(Json{{"range_m", orNull(place.range_m)},
                              {"azimuth_deg", orNull(place.azimuth_deg)},
                              {"actors", place.actors},
                              {"poses", place.poses},
                              {"x_m", orNull(place.x_m)},
                              {"y_m", orNull(place.y_m)}});
  }
  j["figure"] = orNull(finding.figure);
  if (finding.description) j["description"] = *finding.description;
  return j;
}

}  // namespace

std::string toJson(const Finding& finding) {
  const std::string problem = problemOf(finding);
  if (!problem.empty()) throw std::logic_error("finding " + finding.cause + "/" + problem);
  return json(finding).dump(1, ' ', false, Json::error_handler_t::replace);
}

std::string toJson(const Findings& findings) {
  const std::string problem = problemOf(findings);
  if (!problem.empty()) throw std::logic_error(problem);
  Json j;
  j["format"] = kFindingsFormat;
  j["poses"] = {{"count", findings.poses}, {"locations", findings.locations}, {"held_out", findings.held_out}};
  for (const AccuracyKey& key : accuracyKeys()) {
    const auto estimate = findings.estimated.find(key.name);
    j["accuracy"][key.name] = {
        {"stated", findings.accuracy.*key.member},
        {"estimated", estimate == findings.estimated.end() ? Json(nullptr) : Json(estimate->second.value)}};
  }
  j["verdict"] = findings.verdict();
  j["findings"] = Json::array();
  for (const Finding& finding : findings.findings) j["findings"].push_back(json(finding));
  j["extended_twin"] = orNull(findings.extended_twin);
  return j.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void writeFindings(const Findings& findings, const std::string& file) {
  const std::string text = toJson(findings);
  std::ofstream out(file, std::ios::trunc);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

}  // namespace mmradartwin
