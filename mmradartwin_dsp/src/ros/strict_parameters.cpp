#include "mmradartwin_dsp/ros/strict_parameters.h"

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

std::string shown(XmlRpc::XmlRpcValue& value) {
  std::ostringstream text;
  value.write(text);
  return "'" + text.str() + "'";
}

std::string range(double min, double max) {
  std::ostringstream text;
  text << "allowed: " << min << " to " << max;
  return text.str();
}

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
  throw InputError("parameter " + nh_.resolveName(name) + ": " + why);
}

double StrictParameters::number(const std::string& name, double default_value, double min, double max) {
  known_.insert(nh_.resolveName(name));
  XmlRpc::XmlRpcValue value;
  if (!nh_.getParam(name, value)) return default_value;
  double number = 0;
  if (!toNumber(value, number)) fail(name, shown(value) + " is no number; " + range(min, max));
  if (!(std::isfinite(number) && number >= min && number <= max)) {
    fail(name, shown(value) + " is out of range; " + range(min, max));
  }
  return number;
}

int StrictParameters::integer(const std::string& name, int default_value, int min, int max) {
  const double value = number(name, default_value, min, max);
  if (value != std::floor(value)) fail(name, std::to_string(value) + " is no whole number; " + range(min, max));
  return static_cast<int>(value);
}

bool StrictParameters::boolean(const std::string& name, bool default_value) {
  known_.insert(nh_.resolveName(name));
  XmlRpc::XmlRpcValue value;
  if (!nh_.getParam(name, value)) return default_value;
  if (value.getType() != XmlRpc::XmlRpcValue::TypeBoolean) fail(name, shown(value) + " is neither true nor false");
  return static_cast<bool>(value);
}

std::string StrictParameters::text(const std::string& name, const std::string& default_value) {
  known_.insert(nh_.resolveName(name));
  XmlRpc::XmlRpcValue value;
  if (!nh_.getParam(name, value)) return default_value;
  if (value.getType() != XmlRpc::XmlRpcValue::TypeString) fail(name, shown(value) + " is no text");
  const std::string text = static_cast<std::string>(value);
  if (text.empty() && !default_value.empty()) fail(name, "is empty");
  return text;
}

std::string StrictParameters::requiredText(const std::string& name, const std::string& what) {
  const std::string value = text(name, "");
  if (value.empty()) fail(name, "is missing: set it to " + what);
  return value;
}

void StrictParameters::rejectUnknown() const {
  std::vector<std::string> names;
  nh_.getParamNames(names);
  const std::string own = nh_.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.compare(0, own.size(), own) != 0 || known_.count(name)) continue;
    std::string known;
    for (const std::string& parameter : known_) known += (known.empty() ? "" : ", ") + parameter.substr(own.size());
    throw InputError("parameter " + name + ": is not known; known: " + known);
  }
}

}  // namespace mmradartwin
