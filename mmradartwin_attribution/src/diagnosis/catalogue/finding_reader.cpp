#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "diagnosis/catalogue/finding_format.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {

using namespace diagnosis::catalogue;

namespace {

using Json = nlohmann::ordered_json;

/// One value of findings.json, read strictly: errors name the way to it, and finish() refuses keys that were not asked
/// for.
class Entry {
 public:
  Entry(const Json& value, std::string where) : value_(value), where_(std::move(where)) {}

  [[noreturn]] void fail(const std::string& why) const { throw InputError(where_ + ": " + why); }
  bool null() const { return value_.is_null(); }
  /// True where the key is there and not null.
  bool has(const std::string& key) {
    asked_.insert(key);
    return value_.is_object() && value_.contains(key) && !value_.at(key).is_null();
  }
  Entry at(const std::string& key) {
    asked_.insert(key);
    if (!value_.is_object()) fail("must be an object with the key " + key);
    if (!value_.contains(key)) fail("key " + key + " is missing");
    return {value_.at(key), where_ + "/" + key};
  }
  std::vector<std::pair<std::string, Entry>> members() {
    if (!value_.is_object()) fail("must be an object");
    std::vector<std::pair<std::string, Entry>> all;
    for (const auto& [key, value] : value_.items()) {
      asked_.insert(key);
      all.emplace_back(key, Entry(value, where_ + "/" + key));
    }
    return all;
  }
  std::vector<Entry> items() const {
    if (!value_.is_array()) fail("must be a list");
    std::vector<Entry> all;
    for (std::size_t i = 0; i < value_.size(); ++i) all.emplace_back(value_[i], where_ + "/" + std::to_string(i));
    return all;
  }
  double number() const {
    if (!value_.is_number()) fail("must be a number");
    return value_.get<double>();
  }
  double numberOrNaN() const { return null() ? std::numeric_limits<double>::quiet_NaN() : number(); }
  int count() const {
    if (!value_.is_number_integer() || value_ < 0 || value_ > 1000000000) fail("must be a whole number from 0");
    return value_.get<int>();
  }
  std::string text() const {
    if (!value_.is_string()) fail("must be text");
    return value_.get<std::string>();
  }
  std::vector<std::string> texts() const {
    std::vector<std::string> all;
    for (const Entry& item : items()) all.push_back(item.text());
    return all;
  }
  std::array<double, 2> interval() const {
    const auto ends = items();
    if (ends.size() != 2) fail("must be a list of two numbers");
    return {ends[0].number(), ends[1].number()};
  }
  Parameters::Value value() const {
    if (value_.is_null()) return std::numeric_limits<double>::quiet_NaN();  // told where it may be: problemOf()
    if (value_.is_number()) return value_.get<double>();
    if (value_.is_string()) return value_.get<std::string>();
    if (!value_.is_array()) fail("must be a number, a text or a list of either");
    if (!value_.empty() && value_.front().is_string()) return texts();
    std::vector<double> numbers;
    for (const Entry& item : items()) numbers.push_back(item.number());
    return numbers;
  }
  std::optional<std::string> optionalText(const std::string& key) {
    return has(key) ? std::optional(at(key).text()) : std::nullopt;
  }
  std::optional<double> optionalNumber(const std::string& key) {
    return has(key) ? std::optional(at(key).number()) : std::nullopt;
  }
  std::optional<std::array<double, 2>> optionalInterval(const std::string& key) {
    return has(key) ? std::optional(at(key).interval()) : std::nullopt;
  }
  void finish() const {
    std::string known;
    for (const std::string& key : asked_) known += (known.empty() ? "" : ", ") + key;
    for (const auto& [key, value] : value_.items()) {
      if (!asked_.count(key)) fail("key " + key + " is unknown; known: " + known);
    }
  }

 private:
  const Json& value_;
  std::string where_;
  std::set<std::string> asked_;
};

FindingParameter readParameter(const std::string& name, Entry e) {
  FindingParameter parameter;
  parameter.name = name;
  parameter.value = e.at("value").value();
  parameter.unit = e.optionalText("unit").value_or("");
  if (e.has("ci95")) {
    const Entry ci95 = e.at("ci95");
    if (kindOf(parameter.value) == ParameterKind::kNumber) {
      parameter.ci95.push_back(ci95.interval());
    } else {
      for (const Entry& item : ci95.items()) parameter.ci95.push_back(item.interval());
    }
  }
  e.finish();
  return parameter;
}

GainMetric readMetric(Entry& e) {
  GainMetric metric;
  metric.before = e.at("before").numberOrNaN();
  metric.after = e.at("after").numberOrNaN();
  metric.difference_ci95 = e.optionalInterval("difference_ci95");
  return metric;
}

GainMetric readMetric(Entry& parent, const std::string& key) {
  Entry e = parent.at(key);
  const GainMetric metric = readMetric(e);
  e.finish();
  return metric;
}

FindingGain readGain(Entry e) {
  FindingGain gain;
  for (auto [name, metric] :
       {std::pair("explained_power", &gain.explained_power),
        std::pair("log_likelihood_per_pose", &gain.log_likelihood_per_pose), std::pair("q1", &gain.q1),
        std::pair("q2", &gain.q2), std::pair("q3_median_db", &gain.q3_median_db)}) {
    *metric = readMetric(e, name);
  }
  Entry recall = e.at("recall");
  gain.recall = readMetric(recall);
  if (recall.has("bands")) {
    Entry bands = recall.at("bands");
    for (std::size_t i = 0; i < 3; ++i) {
      gain.recall_band[i] = readMetric(bands, kRecallBands[i]);
    }
    bands.finish();
  }
  recall.finish();
  Entry classes = e.at("classes");
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string name = "C" + std::to_string(i + 1);
    gain.classes[i] = readMetric(classes, name);
  }
  classes.finish();
  e.finish();
  return gain;
}

FindingPlace readPlace(Entry e) {
  FindingPlace place;
  place.range_m = e.optionalInterval("range_m");
  place.azimuth_deg = e.optionalInterval("azimuth_deg");
  place.actors = e.at("actors").texts();
  place.poses = e.at("poses").texts();
  place.x_m = e.optionalNumber("x_m");
  place.y_m = e.optionalNumber("y_m");
  e.finish();
  return place;
}

Finding readFinding(Entry e) {
  Finding finding;
  const Entry cause = e.at("cause");
  finding.cause = cause.text();
  const CauseDescription* description = nullptr;
  try {
    description = &causeDescription(finding.cause);
  } catch (const InputError& error) {
    cause.fail(error.what());
  }
  const Entry residual_class = e.at("class");
  if (residual_class.text() != className(description->residual_class)) {
    residual_class.fail(finding.cause + " is of class " + className(description->residual_class));
  }
  e.at("action").text();
  for (auto& [name, entry] : e.at("parameters").members()) finding.parameters.push_back(readParameter(name, entry));
  Entry mechanism = e.at("mechanism");
  if (!mechanism.null()) {
    auto named = mechanism.members();
    if (named.size() != 1) mechanism.fail("must hold one mechanism");
    finding.mechanism = NamedParameters{named[0].first, {}};
    for (auto& [name, entry] : named[0].second.members()) finding.mechanism->values.set(name, entry.value());
  }
  for (Entry& candidate : e.at("candidates").items()) {
    finding.candidates.push_back({candidate.at("cause").text(), candidate.at("probability").number()});
    if (candidate.has("parameters")) {
      for (auto& [name, entry] : candidate.at("parameters").members()) {
        finding.candidates.back().parameters.push_back(readParameter(name, entry));
      }
    }
    candidate.finish();
  }
  finding.experiment = e.optionalText("experiment");
  Entry evidence = e.at("evidence");
  finding.evidence = {evidence.at("log_likelihood_gain").number(), evidence.at("false_alarm_rate").number(),
                      evidence.optionalText("runner_up"), evidence.optionalNumber("margin")};
  evidence.finish();
  const Entry gain = e.at("gain");
  if (!gain.null()) finding.gain = readGain(gain);
  for (const Entry& place : e.at("where").items()) finding.where.push_back(readPlace(place));
  finding.figure = e.optionalText("figure");
  finding.description = e.optionalText("description");
  e.finish();
  return finding;
}

/// Accuracies; an older file has none. The intervals of the estimates are not in the file.
void readAccuracy(Entry e, Findings& to) {
  for (const AccuracyKey& key : accuracyKeys()) {
    Entry value = e.at(key.name);
    to.accuracy.*key.member = value.at("stated").number();
    const double estimated = value.at("estimated").numberOrNaN();
    if (!std::isnan(estimated)) to.estimated[key.name] = {estimated, estimated, estimated};
    value.finish();
  }
  e.finish();
}

}  // namespace

Findings parseFindings(const std::string& json_text, const std::string& name) {
  Json root;
  try {
    root = Json::parse(json_text);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name + ": is no JSON: " + error.what());
  }
  Entry e(root, name);
  const Entry format = e.at("format");
  if (format.text() != kFindingsFormat) format.fail("is '" + format.text() + "'; allowed: " + kFindingsFormat);
  Findings all;
  Entry poses = e.at("poses");
  all.poses = poses.at("count").count();
  all.locations = poses.at("locations").count();
  all.held_out = poses.at("held_out").text();
  poses.finish();
  if (e.has("accuracy")) readAccuracy(e.at("accuracy"), all);
  for (const Entry& finding : e.at("findings").items()) all.findings.push_back(readFinding(finding));
  all.extended_twin = e.optionalText("extended_twin");
  const Entry verdict = e.at("verdict");
  if (verdict.text() != all.verdict()) verdict.fail("does not fit the findings, which make it " + all.verdict());
  e.finish();
  std::string problem;
  try {
    problem = problemOf(all);
  } catch (const InputError& error) {  // names the unknown cause of a candidate
    problem = error.what();
  }
  if (!problem.empty()) throw InputError(name + ": " + problem);
  return all;
}

Findings readFindings(const std::string& file) {
  requireRegularFile(file);
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file + ": cannot be read; give a findings.json that exists");
  std::ostringstream text;
  text << in.rdbuf();
  return parseFindings(text.str(), file);
}

}  // namespace mmradartwin
