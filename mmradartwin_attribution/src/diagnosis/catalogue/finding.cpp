#include "mmradartwin_attribution/finding.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using Json = nlohmann::ordered_json;  // keys in the order of DESIGN section 5, for people who read the file

constexpr const char* kFormat = "mmradartwin_findings/1";
constexpr const char* kBands[] = {"near", "mid", "far"};

bool finite(const Parameters::Value& value) {
  if (const double* number = std::get_if<double>(&value)) return std::isfinite(*number);
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    for (double v : *numbers) {
      if (!std::isfinite(v)) return false;
    }
  }
  return true;
}

ParameterKind kindOf(const Parameters::Value& value) {
  constexpr ParameterKind kinds[] = {ParameterKind::kNumber, ParameterKind::kText, ParameterKind::kNumbers,
                                     ParameterKind::kTexts};
  return kinds[value.index()];
}

std::string kindName(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::kText:
      return "text";
    case ParameterKind::kNumbers:
      return "a list of numbers";
    case ParameterKind::kTexts:
      return "a list of texts";
    default:
      return "a number";
  }
}

/// What is wrong with a finding's content, "" if nothing.
std::string problem(const Finding& f) {
  const CauseDescription& cause = causeDescription(f.cause);
  std::set<int> groups, given;
  for (const CauseParameter& wanted : cause.parameters) {
    if (wanted.one_of) groups.insert(wanted.one_of);
    const FindingParameter* p = f.parameter(wanted.name);
    if (!p && !wanted.one_of) return "parameters/" + wanted.name + ": is missing";
    if (!p) continue;
    given.insert(wanted.one_of);
    if (p->unit != wanted.unit) {
      return "parameters/" + wanted.name + ": has the unit '" + p->unit + "'; it must be '" + wanted.unit + "'";
    }
    if (kindOf(p->value) != wanted.kind) return "parameters/" + wanted.name + ": must be " + kindName(wanted.kind);
  }
  for (int group : groups) {
    if (given.count(group)) continue;
    std::string names;
    for (const CauseParameter& wanted : cause.parameters) {
      if (wanted.one_of == group) names += (names.empty() ? "" : " or ") + wanted.name;
    }
    return "parameters: " + names + " is missing";
  }
  std::set<std::string> seen;
  for (const FindingParameter& p : f.parameters) {
    const std::string at = "parameters/" + p.name;
    if (!seen.insert(p.name).second) return at + ": is given twice";
    if (!finite(p.value)) return at + ": is not finite";
    const auto* list = std::get_if<std::vector<double>>(&p.value);
    const std::size_t elements = list ? list->size() : kindOf(p.value) == ParameterKind::kNumber ? 1 : 0;
    if (!p.ci95.empty() && p.ci95.size() != elements) return at + ": needs one interval per number";
    for (const auto& [low, high] : p.ci95) {
      if (!(std::isfinite(low) && std::isfinite(high) && low <= high)) return at + ": ci95 is no interval";
    }
  }
  double total = 0;
  for (const CauseProbability& c : f.candidates) {
    causeDescription(c.cause);
    if (!(c.probability >= 0 && c.probability <= 1)) return "candidates: probabilities must be 0 to 1";
    total += c.probability;
  }
  if (total > 1 + 1e-9) return "candidates: probabilities add up to more than 1";
  if (!std::isfinite(f.evidence.log_likelihood_gain)) return "evidence/log_likelihood_gain: is not finite";
  if (!(f.evidence.false_alarm_rate >= 0 && f.evidence.false_alarm_rate <= 1)) {
    return "evidence/false_alarm_rate: must be 0 to 1";
  }
  if (f.cause == "unknown" && !f.description) return "description: is missing; an unknown cause needs one";
  return "";
}

std::string problem(const Findings& all) {
  for (std::size_t i = 0; i < all.findings.size(); ++i) {
    const std::string at = "findings/" + std::to_string(i);
    if (all.findings[i].cause == "unknown" && i + 1 < all.findings.size()) return at + ": unknown must stand last";
    const std::string why = problem(all.findings[i]);
    if (!why.empty()) return at + "/" + why;
  }
  if (all.poses < 0 || all.locations < 0) return "poses: counts must not be negative";
  return "";
}

template <typename T>
Json orNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json(const Parameters::Value& value) {
  return std::visit([](const auto& v) { return Json(v); }, value);
}

Json json(const FindingParameter& p) {
  Json j;
  j["value"] = json(p.value);
  if (!p.unit.empty()) j["unit"] = p.unit;
  if (!p.ci95.empty()) j["ci95"] = kindOf(p.value) == ParameterKind::kNumber ? Json(p.ci95.front()) : Json(p.ci95);
  return j;
}

Json json(const GainMetric& m) {
  return {{"before", number(m.before)}, {"after", number(m.after)}, {"difference_ci95", orNull(m.difference_ci95)}};
}

Json json(const FindingGain& g) {
  Json j;
  j["explained_power"] = json(g.explained_power);
  j["log_likelihood_per_pose"] = json(g.log_likelihood_per_pose);
  j["recall"] = json(g.recall);
  for (std::size_t i = 0; i < 3; ++i) j["recall"]["bands"][kBands[i]] = json(g.recall_band[i]);
  j["q1"] = json(g.q1);
  j["q2"] = json(g.q2);
  j["q3_median_db"] = json(g.q3_median_db);
  for (std::size_t i = 0; i < 5; ++i) j["classes"]["C" + std::to_string(i + 1)] = json(g.classes[i]);
  return j;
}

Json json(const Finding& f) {
  const CauseDescription& cause = causeDescription(f.cause);
  Json j;
  j["cause"] = f.cause;
  j["class"] = className(cause.residual_class);
  j["action"] = cause.action();
  j["parameters"] = Json::object();
  for (const FindingParameter& p : f.parameters) j["parameters"][p.name] = json(p);
  j["mechanism"] = nullptr;
  if (f.mechanism) {
    Json values = Json::object();
    for (const auto& [name, value] : f.mechanism->values.all()) values[name] = json(value);
    j["mechanism"] = Json::object();
    j["mechanism"][f.mechanism->mechanism] = values;
  }
  j["candidates"] = Json::array();
  for (const CauseProbability& c : f.candidates) {
    j["candidates"].push_back(Json{{"cause", c.cause}, {"probability", c.probability}});
  }
  j["experiment"] = orNull(f.experiment);
  j["evidence"] = {{"log_likelihood_gain", f.evidence.log_likelihood_gain},
                   {"false_alarm_rate", f.evidence.false_alarm_rate},
                   {"runner_up", orNull(f.evidence.runner_up)},
                   {"margin", orNull(f.evidence.margin)}};
  j["gain"] = f.gain ? json(*f.gain) : Json(nullptr);
  j["where"] = Json::array();
  for (const FindingPlace& p : f.where) {
    j["where"].push_back(Json{{"range_m", orNull(p.range_m)},
                              {"azimuth_deg", orNull(p.azimuth_deg)},
                              {"actors", p.actors},
                              {"poses", p.poses},
                              {"x_m", orNull(p.x_m)},
                              {"y_m", orNull(p.y_m)}});
  }
  j["figure"] = orNull(f.figure);
  if (f.description) j["description"] = *f.description;
  return j;
}

/// A value of the file, read strictly: errors name the way to it, and finish() refuses keys that were not asked for.
class Entry {
 public:
  Entry(const Json& value, std::string where) : value_(value), where_(std::move(where)) {}

  [[noreturn]] void fail(const std::string& why) const { throw InputError(where_ + ": " + why); }
  bool null() const { return value_.is_null(); }
  /// Not null, and there.
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
  FindingParameter p;
  p.name = name;
  p.value = e.at("value").value();
  p.unit = e.optionalText("unit").value_or("");
  if (e.has("ci95")) {
    const Entry ci95 = e.at("ci95");
    if (kindOf(p.value) == ParameterKind::kNumber) {
      p.ci95.push_back(ci95.interval());
    } else {
      for (const Entry& item : ci95.items()) p.ci95.push_back(item.interval());
    }
  }
  e.finish();
  return p;
}

GainMetric readMetric(Entry& e) {
  GainMetric m;
  m.before = e.at("before").numberOrNaN();
  m.after = e.at("after").numberOrNaN();
  m.difference_ci95 = e.optionalInterval("difference_ci95");
  return m;
}

GainMetric readMetric(Entry& parent, const std::string& key) {
  Entry e = parent.at(key);
  const GainMetric m = readMetric(e);
  e.finish();
  return m;
}

FindingGain readGain(Entry e) {
  FindingGain g;
  for (auto [name, metric] : {std::pair("explained_power", &g.explained_power),
                              std::pair("log_likelihood_per_pose", &g.log_likelihood_per_pose), std::pair("q1", &g.q1),
                              std::pair("q2", &g.q2), std::pair("q3_median_db", &g.q3_median_db)}) {
    *metric = readMetric(e, name);
  }
  Entry recall = e.at("recall");
  g.recall = readMetric(recall);
  if (recall.has("bands")) {
    Entry bands = recall.at("bands");
    for (std::size_t i = 0; i < 3; ++i) {
      g.recall_band[i] = readMetric(bands, kBands[i]);
    }
    bands.finish();
  }
  recall.finish();
  Entry classes = e.at("classes");
  for (std::size_t i = 0; i < 5; ++i) {
    const std::string name = "C" + std::to_string(i + 1);
    g.classes[i] = readMetric(classes, name);
  }
  classes.finish();
  e.finish();
  return g;
}

FindingPlace readPlace(Entry e) {
  FindingPlace p;
  p.range_m = e.optionalInterval("range_m");
  p.azimuth_deg = e.optionalInterval("azimuth_deg");
  p.actors = e.at("actors").texts();
  p.poses = e.at("poses").texts();
  p.x_m = e.optionalNumber("x_m");
  p.y_m = e.optionalNumber("y_m");
  e.finish();
  return p;
}

Finding readFinding(Entry e) {
  Finding f;
  const Entry cause = e.at("cause");
  f.cause = cause.text();
  const CauseDescription* description = nullptr;
  try {
    description = &causeDescription(f.cause);
  } catch (const InputError& error) {
    cause.fail(error.what());
  }
  const Entry residual_class = e.at("class");
  if (residual_class.text() != className(description->residual_class)) {
    residual_class.fail(f.cause + " is of class " + className(description->residual_class));
  }
  e.at("action").text();
  for (auto& [name, entry] : e.at("parameters").members()) f.parameters.push_back(readParameter(name, entry));
  Entry mechanism = e.at("mechanism");
  if (!mechanism.null()) {
    auto named = mechanism.members();
    if (named.size() != 1) mechanism.fail("must hold one mechanism");
    f.mechanism = NamedParameters{named[0].first, {}};
    for (auto& [name, entry] : named[0].second.members()) f.mechanism->values.set(name, entry.value());
  }
  for (Entry& c : e.at("candidates").items()) {
    f.candidates.push_back({c.at("cause").text(), c.at("probability").number()});
    c.finish();
  }
  f.experiment = e.optionalText("experiment");
  Entry evidence = e.at("evidence");
  f.evidence = {evidence.at("log_likelihood_gain").number(), evidence.at("false_alarm_rate").number(),
                evidence.optionalText("runner_up"), evidence.optionalNumber("margin")};
  evidence.finish();
  const Entry gain = e.at("gain");
  if (!gain.null()) f.gain = readGain(gain);
  for (const Entry& place : e.at("where").items()) f.where.push_back(readPlace(place));
  f.figure = e.optionalText("figure");
  f.description = e.optionalText("description");
  e.finish();
  return f;
}

}  // namespace

std::array<double, 2> Finding::placeError_m() const {
  const auto half = [&](const std::string& axis) {
    const FindingParameter* p = parameter(axis);
    if (p == nullptr) p = parameter("d" + axis);
    return p != nullptr && !p->ci95.empty() ? (p->ci95[0][1] - p->ci95[0][0]) / 2 : 0;
  };
  return {half("x_m"), half("y_m")};
}

double ChangedRecord::strongest_db() const {
  return std::max(before ? before->amplitude_db : -INFINITY, after ? after->amplitude_db : -INFINITY);
}

const FindingParameter* Finding::parameter(const std::string& name) const {
  for (const FindingParameter& p : parameters) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

std::string Findings::verdict() const {
  if (findings.empty()) return "none";
  return findings.front().cause == "unknown" ? "unknown" : "named";
}

std::string toJson(const Finding& finding) {
  const std::string why = problem(finding);
  if (!why.empty()) throw std::logic_error("finding " + finding.cause + "/" + why);
  return json(finding).dump(1);
}

std::string toJson(const Findings& findings) {
  const std::string why = problem(findings);
  if (!why.empty()) throw std::logic_error(why);
  Json j;
  j["format"] = kFormat;
  j["poses"] = {{"count", findings.poses}, {"locations", findings.locations}, {"held_out", findings.held_out}};
  j["verdict"] = findings.verdict();
  j["findings"] = Json::array();
  for (const Finding& f : findings.findings) j["findings"].push_back(json(f));
  j["extended_twin"] = orNull(findings.extended_twin);
  return j.dump(1) + "\n";
}

void writeFindings(const Findings& findings, const std::string& file) {
  const std::string text = toJson(findings);
  std::ofstream out(file, std::ios::trunc);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

Findings parseFindings(const std::string& json_text, const std::string& name) {
  Json root;
  try {
    root = Json::parse(json_text);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name + ": is no JSON: " + error.what());
  }
  Entry e(root, name);
  const Entry format = e.at("format");
  if (format.text() != kFormat) format.fail("is '" + format.text() + "'; allowed: " + kFormat);
  Findings all;
  Entry poses = e.at("poses");
  all.poses = poses.at("count").count();
  all.locations = poses.at("locations").count();
  all.held_out = poses.at("held_out").text();
  poses.finish();
  for (const Entry& f : e.at("findings").items()) all.findings.push_back(readFinding(f));
  all.extended_twin = e.optionalText("extended_twin");
  const Entry verdict = e.at("verdict");
  if (verdict.text() != all.verdict()) verdict.fail("does not fit the findings, which make it " + all.verdict());
  e.finish();
  std::string why;
  try {
    why = problem(all);
  } catch (const InputError& error) {  // a candidate's name
    why = error.what();
  }
  if (!why.empty()) throw InputError(name + ": " + why);
  return all;
}

Findings readFindings(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError(file + ": cannot be read; give a findings.json that exists");
  std::ostringstream text;
  text << in.rdbuf();
  return parseFindings(text.str(), file);
}

}  // namespace mmradartwin
