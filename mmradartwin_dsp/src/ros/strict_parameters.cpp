#include "mmradartwin_dsp/ros/strict_parameters.h"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

std::string shown(XmlRpc::XmlRpcValue& value) {
  std::ostringstream text;
  value.write(text);
  return "'" + text.str() + "'";
}

std::string shown(double value) {
  std::ostringstream text;
  text.precision(10);
  text << value;
  return text.str();
}

std::string range(double min, double max) { return shown(min) + " to " + shown(max); }

/// PyYAML hands 77.0e9 over as a string.
bool toNumber(XmlRpc::XmlRpcValue& value, double& number) {
  switch (value.getType()) {
    case XmlRpc::XmlRpcValue::TypeDouble:
      number = static_cast<double>(value);
      return true;
    case XmlRpc::XmlRpcValue::TypeInt:
      number = static_cast<int>(value);
      return true;
    case XmlRpc::XmlRpcValue::TypeString: {
      const std::string text = static_cast<std::string>(value);
      char* end = nullptr;
      number = std::strtod(text.c_str(), &end);
      return !text.empty() && *end == '\0';
    }
    default:
      return false;
  }
}

}  // namespace

void StrictParameters::fail(const std::string& name, const std::string& why) const {
  throw InputError("parameter " + (nh_ ? nh_->resolveName(name) : name) + ": " + why);
}

bool StrictParameters::read(const ParameterDescription& description, XmlRpc::XmlRpcValue& value) {
  descriptions_.push_back(description);
  if (!nh_) return false;
  known_.insert(nh_->resolveName(description.name));
  return nh_->getParam(description.name, value);
}

double StrictParameters::readNumber(const ParameterDescription& description, double default_value, double min,
                                    double max) {
  XmlRpc::XmlRpcValue value;
  if (!read(description, value)) return default_value;
  double number = 0;
  if (!toNumber(value, number)) {
    fail(description.name, shown(value) + " is no number; allowed: " + description.range);
  }
  if (!(std::isfinite(number) && number >= min && number <= max)) {
    fail(description.name, shown(value) + " is out of range; allowed: " + description.range);
  }
  return number;
}

double StrictParameters::number(const std::string& name, double default_value, double min, double max,
                                const std::string& meaning) {
  return readNumber({name, "number", shown(default_value), range(min, max), meaning}, default_value, min, max);
}

int StrictParameters::integer(const std::string& name, int default_value, int min, int max,
                              const std::string& meaning) {
  const ParameterDescription description{name, "whole number", shown(default_value), range(min, max), meaning};
  const double value = readNumber(description, default_value, min, max);
  if (value != std::floor(value)) fail(name, shown(value) + " is no whole number; allowed: " + description.range);
  return static_cast<int>(value);
}

bool StrictParameters::boolean(const std::string& name, bool default_value, const std::string& meaning) {
  XmlRpc::XmlRpcValue value;
  if (!read({name, "true or false", default_value ? "true" : "false", "", meaning}, value)) return default_value;
  if (value.getType() != XmlRpc::XmlRpcValue::TypeBoolean) fail(name, shown(value) + " is neither true nor false");
  return static_cast<bool>(value);
}

std::string StrictParameters::readText(const ParameterDescription& description) {
  XmlRpc::XmlRpcValue value;
  if (!read(description, value)) return "";
  if (value.getType() != XmlRpc::XmlRpcValue::TypeString) fail(description.name, shown(value) + " is no text");
  return static_cast<std::string>(value);
}

std::string StrictParameters::text(const std::string& name, const std::string& default_value,
                                   const std::string& meaning) {
  const std::string text = readText({name, "text", "\"" + default_value + "\"", "", meaning});
  if (!text.empty()) return text;
  if (!default_value.empty() && nh_ && nh_->hasParam(name)) fail(name, "is empty");
  return default_value;
}

std::string StrictParameters::requiredText(const std::string& name, const std::string& meaning) {
  const std::string value = readText({name, "text", "", "", meaning});
  if (value.empty() && nh_) fail(name, "is missing: set it to " + meaning);
  return value;
}

std::string StrictParameters::baseFolder() {
  if (!base_folder_) {
    const std::string folder =
        readText({"base_folder", "path", "\"\"", "",
                  "folder from which the relative paths of other parameters are seen; empty: the "
                  "one in which the node runs, which roslaunch makes ~/.ros"});
    base_folder_ = std::filesystem::absolute(folder.empty() ? "." : folder).lexically_normal().string();
  }
  return *base_folder_;
}

std::string StrictParameters::readPath(const std::string& name, bool required, const std::string& meaning) {
  const std::string folder = baseFolder();
  const std::string value = readText({name, "path", required ? "" : "\"\"", "", meaning});
  if (value.empty()) {
    if (required && nh_) fail(name, "is missing: set it to " + meaning);
    return "";
  }
  try {
    return resolvePath(value, folder + "/.");
  } catch (const InputError& error) {
    fail(name, error.what());
  }
}

std::string StrictParameters::path(const std::string& name, const std::string& meaning) {
  return readPath(name, false, meaning);
}

std::string StrictParameters::existingPath(const std::string& name, const std::string& meaning) {
  const std::string path = readPath(name, false, meaning);
  std::error_code error;  // a name that is too long, say
  if (!path.empty() && !std::filesystem::exists(path, error)) fail(name, path + ": does not exist");
  return path;
}

std::string StrictParameters::requiredPath(const std::string& name, const std::string& meaning) {
  const std::string path = readPath(name, true, meaning);
  std::error_code error;
  if (!path.empty() && !std::filesystem::exists(path, error)) fail(name, path + ": does not exist");
  return path;
}

void StrictParameters::ofDiagnosticUpdater() {
  number("diagnostic_period", 1.0, 0.01, 3600, "time from one report in /diagnostics to the next, s");
  boolean("diagnostic_updater_use_fqn", false, "true: reports have the node's name with its namespace");
}

void StrictParameters::rejectUnknown() const {
  if (!nh_) return;
  std::vector<std::string> names;
  nh_->getParamNames(names);
  const std::string own = nh_->getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.compare(0, own.size(), own) != 0 || known_.count(name)) continue;
    std::string known;
    for (const std::string& parameter : known_) known += (known.empty() ? "" : ", ") + parameter.substr(own.size());
    throw InputError("parameter " + name + ": is not known; known: " + known);
  }
}

}  // namespace mmradartwin
