#include "diagnosis/catalogue/finding_format.h"

#include <cmath>
#include <set>

namespace mmradartwin::diagnosis::catalogue {
namespace {

bool finite(const Parameters::Value& value) {
  if (const double* number = std::get_if<double>(&value)) return std::isfinite(*number);
  if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    for (double v : *numbers) {
      if (!std::isfinite(v)) return false;
    }
  }
  return true;
}

/// True for a speed that a recording leaves open: NaN here, null in files.
bool mayBeUntold(const FindingParameter& parameter) {
  const double* number = std::get_if<double>(&parameter.value);
  return number && std::isnan(*number) && parameter.ci95.empty() && parameter.unit == "m/s";
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

/// Problem with the parameters that the cause demands: one that is missing, or has another unit or kind.
std::string problemOfDemanded(const Finding& finding) {
  std::set<int> groups, given;
  const CauseDescription& cause = causeDescription(finding.cause);
  for (const CauseParameter& wanted : cause.parameters) {
    const std::string key = "parameters/" + wanted.name;
    if (wanted.one_of) groups.insert(wanted.one_of);
    const FindingParameter* parameter = finding.parameter(wanted.name);
    if (!parameter && !wanted.one_of && !wanted.optional) return key + ": is missing";
    if (!parameter) continue;
    given.insert(wanted.one_of);
    if (parameter->unit != wanted.unit) {
      return key + ": has the unit '" + parameter->unit + "'; it must be '" + wanted.unit + "'";
    }
    const ParameterKind kind = kindOf(parameter->value);
    if (kind != wanted.kind && !(wanted.or_list && kind == ParameterKind::kNumbers))
      return key + ": must be " + kindName(wanted.kind);
  }
  for (int group : groups) {
    if (given.count(group)) continue;
    std::string names;
    for (const CauseParameter& wanted : cause.parameters) {
      if (wanted.one_of == group) names += (names.empty() ? "" : " or ") + wanted.name;
    }
    return "parameters: " + names + " is missing";
  }
  return "";
}

/// Problem with the parameters that there are: given twice, not finite, without proper intervals.
std::string problemOfGiven(const Finding& finding) {
  std::set<std::string> seen;
  for (const FindingParameter& parameter : finding.parameters) {
    const std::string key = "parameters/" + parameter.name;
    if (!seen.insert(parameter.name).second) return key + ": is given twice";
    if (!finite(parameter.value) && !mayBeUntold(parameter)) return key + ": is not finite";
    const auto* list = std::get_if<std::vector<double>>(&parameter.value);
    const std::size_t elements = list ? list->size() : kindOf(parameter.value) == ParameterKind::kNumber ? 1 : 0;
    if (!parameter.ci95.empty() && parameter.ci95.size() != elements) return key + ": needs one interval per number";
    for (const auto& [low, high] : parameter.ci95) {
      if (!(std::isfinite(low) && std::isfinite(high) && low <= high)) return key + ": ci95 is no interval";
    }
  }
  return "";
}

/// Problem with probabilities of candidates and with the evidence.
std::string problemOfEvidence(const Finding& finding) {
  double total = 0;
  for (const CauseProbability& candidate : finding.candidates) {
    causeDescription(candidate.cause);
    if (!(candidate.probability >= 0 && candidate.probability <= 1)) return "candidates: probabilities must be 0 to 1";
    total += candidate.probability;
    for (const FindingParameter& parameter : candidate.parameters) {
      if (!finite(parameter.value)) return "candidates/" + parameter.name + ": is not finite";
    }
  }
  if (total > 1 + 1e-9) return "candidates: probabilities add up to more than 1";
  if (!std::isfinite(finding.evidence.log_likelihood_gain)) return "evidence/log_likelihood_gain: is not finite";
  if (!(finding.evidence.false_alarm_rate >= 0 && finding.evidence.false_alarm_rate <= 1)) {
    return "evidence/false_alarm_rate: must be 0 to 1";
  }
  return "";
}

}  // namespace

ParameterKind kindOf(const Parameters::Value& value) {
  constexpr ParameterKind kinds[] = {ParameterKind::kNumber, ParameterKind::kText, ParameterKind::kNumbers,
                                     ParameterKind::kTexts};
  return kinds[value.index()];
}

std::string problemOf(const Finding& finding) {
  for (const auto check : {problemOfDemanded, problemOfGiven, problemOfEvidence}) {
    const std::string problem = check(finding);
    if (!problem.empty()) return problem;
  }
  if (finding.cause == "unknown" && !finding.description) {
    return "description: is missing; an unknown cause needs one";
  }
  return "";
}

std::string problemOf(const Findings& findings) {
  const std::vector<Finding>& all = findings.findings;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string key = "findings/" + std::to_string(i);
    if (all[i].cause == "unknown" && i + 1 < all.size()) return key + ": unknown must stand last";
    const std::string problem = problemOf(all[i]);
    if (!problem.empty()) return key + "/" + problem;
  }
  if (findings.poses < 0 || findings.locations < 0) return "poses: counts must not be negative";
  return "";
}

}  // namespace mmradartwin::diagnosis::catalogue
