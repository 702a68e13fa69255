#include "mmradartwin_sim/mechanism_list.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

std::string kindOf(const ParameterSpec& spec) {
  switch (spec.kind) {
    case ParameterKind::kNumber:
      return "number";
    case ParameterKind::kInteger:
      return "whole number";
    case ParameterKind::kText:
      return "text";
    case ParameterKind::kNumbers:
      return "list of numbers";
    case ParameterKind::kTexts:
      return "list of texts";
  }
  return "";
}

bool isNumeric(const ParameterSpec& spec) {
  return spec.kind != ParameterKind::kText && spec.kind != ParameterKind::kTexts;
}

std::string shown(double value) { return significantNumber(value, 6); }

/// Unit and range, as "dB/m, -20 to 20".
std::string rangeOf(const ParameterSpec& spec) {
  if (!isNumeric(spec)) return kindOf(spec);
  return kindOf(spec) + (spec.unit.empty() ? "" : ", " + spec.unit) + ", " + shown(spec.min) + " to " + shown(spec.max);
}

/// A value that the range allows: the typical one, else the default, else the middle.
double exampleOf(const ParameterSpec& spec) {
  const auto* own = std::get_if<double>(&spec.default_value);
  double value = !std::isnan(spec.typical) ? spec.typical : own ? *own : (spec.min + spec.max) / 2;
  value = std::min(spec.max, std::max(spec.min, value));
  return spec.kind == ParameterKind::kInteger ? std::round(value) : value;
}

std::string exampleText(const ParameterSpec& spec) {
  switch (spec.kind) {
    case ParameterKind::kNumber:
    case ParameterKind::kInteger:
      return shown(exampleOf(spec));
    case ParameterKind::kNumbers:
      return "[" + shown(exampleOf(spec)) + "]";
    case ParameterKind::kTexts:
      return "[NAME]";
    case ParameterKind::kText:
      break;
  }
  const auto* own = std::get_if<std::string>(&spec.default_value);
  return own && !own->empty() ? *own : "NAME";
}

bool hasTypical(const ParameterSpec& spec) { return !std::isnan(spec.typical); }

}  // namespace

std::string mechanismList() {
  const MechanismRegistry& registry = MechanismRegistry::instance();
  std::ostringstream out;
  std::size_t longest = 0;
  for (const std::string& name : registry.names()) longest = std::max(longest, name.size());
  for (const std::string& name : registry.names()) {
    std::vector<std::string> parameters;
    for (const ParameterSpec& spec : registry.create(name)->parameters()) parameters.push_back(spec.name);
    out << std::left << std::setw(static_cast<int>(longest) + 2) << name
        << (parameters.empty() ? "(no parameters)" : join(parameters, ", ")) << "\n";
  }
  out << "simulate --mechanisms NAME says all about one.\n";
  return out.str();
}

std::string mechanismText(const std::string& name) {
  const MechanismRegistry& registry = MechanismRegistry::instance();
  const std::vector<std::string> names = registry.names();
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    throw InputError("--mechanisms " + name + ": no such mechanism; " + didYouMean(name, names) +
                     "--mechanisms alone lists them");
  }
  const std::unique_ptr<Mechanism> mechanism = registry.create(name);
  std::ostringstream out;
  out << name << (mechanism->standsSeveralTimes() ? " (may stand several times)" : "") << "\n";
  std::vector<std::string> yaml;
  const std::vector<ParameterSpec> specs = mechanism->parameters();
  for (const ParameterSpec& spec : specs) {
    out << "  " << spec.name << ": " << spec.meaning << "\n      " << rangeOf(spec)
        << (spec.required ? ", needed" : "");
    if (const auto* own = std::get_if<double>(&spec.default_value); own && !spec.required && isNumeric(spec)) {
      out << ", default " << shown(*own);
    }
    if (!std::isnan(spec.neutral)) out << ", does nothing at " << shown(spec.neutral);
    out << "\n";
    if (spec.required || hasTypical(spec)) yaml.push_back(spec.name + ": " + exampleText(spec));
  }
  if (specs.empty()) out << "  no parameters\n";
  out << "twin.yaml, below mechanisms:\n  " << name << ": {" << join(yaml, ", ") << "}\n";
  return out.str();
}

}  // namespace mmradartwin
