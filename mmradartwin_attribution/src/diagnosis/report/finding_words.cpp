#include "diagnosis/report/finding_words.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis::report {

std::string shownNumber(double value, int significant_digits) {
  if (std::isnan(value)) return "-";
  std::ostringstream out;
  out << std::setprecision(significant_digits) << value;
  return out.str();
}

std::string shownParameter(const FindingParameter& parameter) {
  std::ostringstream out;
  out << parameter.name << " = ";
  if (const auto* number = std::get_if<double>(&parameter.value)) {
    out << shownNumber(*number, 4) << (parameter.unit == "1" ? "" : " " + parameter.unit);
    if (!parameter.ci95.empty()) {
      out << " (" << shownNumber(parameter.ci95[0][0], 4) << " to " << shownNumber(parameter.ci95[0][1], 4) << ")";
    }
  } else if (const auto* text = std::get_if<std::string>(&parameter.value)) {
    out << *text;
  } else if (const auto* numbers = std::get_if<std::vector<double>>(&parameter.value)) {
    for (std::size_t i = 0; i < numbers->size(); ++i) out << (i ? ", " : "") << shownNumber((*numbers)[i]);
    if (parameter.unit != "1") out << " " << parameter.unit;
  } else if (const auto* texts = std::get_if<std::vector<std::string>>(&parameter.value)) {
    for (std::size_t i = 0; i < texts->size(); ++i) out << (i ? ", " : "") << (*texts)[i];
  }
  return out.str();
}

std::vector<std::string> shownJudgedBy(const Diagnosis& diagnosis) {
  const Findings& findings = diagnosis.findings;
  const std::map<std::string, std::string> of = {{"scene_m", "places of the actors"},
                                                 {"level_db", "levels of the actors' echoes"},
                                                 {"heading_deg", "headings of the poses"}};
  std::vector<std::string> sentences;
  for (const AccuracyKey& key : accuracyKeys()) {
    if (!findings.isFarWorse(key.name)) continue;
    const SpreadEstimate& found = findings.estimated.at(key.name);
    std::ostringstream out;
    out << "The " << of.at(key.name) << " err by " << shownNumber(found.value) << " " << key.unit << " ("
        << shownNumber(found.low) << " to " << shownNumber(found.high) << "), 1 sigma, where "
        << shownNumber(findings.accuracy.*key.member) << " " << key.unit << " is stated (" << key.name
        << "); the session was judged by the former.";
    sentences.push_back(out.str());
  }
  if (diagnosis.knife_edges_nats) {
    sentences.push_back(
        "The twin was judged with edges that weigh a path by the field behind them (knife_edges: 1), not by 0 "
        "or 1: so the session is " +
        shownNumber(*diagnosis.knife_edges_nats) + " nats likelier. The extended twin has it so.");
  }
  return sentences;
}

std::string shownCandidate(const CauseProbability& candidate) {
  std::string text = candidate.cause;
  for (const FindingParameter& parameter : candidate.parameters) text += " " + shownParameter(parameter);
  return text + " (" + shownNumber(candidate.probability, 2) + ")";
}

std::vector<std::string> shownBesides(const Finding& finding) {
  std::vector<std::string> words;
  if (!finding.mechanism || finding.cause == "unknown") return words;
  const std::vector<CauseParameter>& own = causeDescription(finding.cause).parameters;
  const Parameters standard = defaultMechanism(finding.mechanism->mechanism).values;
  for (const auto& item : finding.mechanism->values.all()) {
    const auto is_own = [&](const CauseParameter& p) { return p.name == item.first; };
    const bool told = finding.parameter(item.first) != nullptr || std::any_of(own.begin(), own.end(), is_own);
    if (told) continue;
    const auto* numbers = std::get_if<std::vector<double>>(&item.second);
    const auto* texts = std::get_if<std::vector<std::string>>(&item.second);
    if ((numbers && numbers->empty()) || (texts && texts->empty())) continue;
    const auto usual = standard.all().find(item.first);
    if (usual != standard.all().end() && usual->second == item.second) continue;
    words.push_back(shownParameter(FindingParameter{item.first, "1", item.second, {}}));
  }
  return words;
}

std::string joined(const std::vector<std::string>& names) {
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ";") + name;
  return all;
}

std::string shownRecord(const std::optional<RecordState>& record, const std::string& between) {
  if (!record) return between + between;
  return shownNumber(record->amplitude_db, 4) + between + shownNumber(record->range_m, 4) + between +
         shownNumber(record->azimuth_deg, 4);
}

}  // namespace mmradartwin::diagnosis::report
