#include "mmradartwin_driver/ros/private_parameters.h"

#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

PrivateParameters::PrivateParameters(const ros::NodeHandle& nh) : nh_(nh) {}

void PrivateParameters::fail(const std::string& name, const std::string& why) const {
  throw InputError("parameter " + nh_.resolveName(name) + ": " + why);
}

std::string PrivateParameters::text(const std::string& name, const std::string& otherwise) {
  known_.insert(name);
  if (!nh_.hasParam(name)) return otherwise;
  std::string value;
  if (!nh_.getParam(name, value)) fail(name, "must be a string");
  return value;
}

std::string PrivateParameters::requiredText(const std::string& name, const std::string& what) {
  const std::string value = text(name, "");
  if (value.empty()) fail(name, "is missing: set it to " + what);
  return value;
}

bool PrivateParameters::boolean(const std::string& name, bool otherwise) {
  known_.insert(name);
  if (!nh_.hasParam(name)) return otherwise;
  bool value = false;
  if (!nh_.getParam(name, value)) fail(name, "must be true or false");
  return value;
}

int PrivateParameters::integer(const std::string& name, int otherwise, int min, int max) {
  known_.insert(name);
  if (!nh_.hasParam(name)) return otherwise;
  int value = 0;
  const std::string range = std::to_string(min) + " to " + std::to_string(max);
  if (!nh_.getParam(name, value)) fail(name, "must be a whole number, " + range);
  if (value < min || value > max) fail(name, std::to_string(value) + " is out of range: must be " + range);
  return value;
}

double PrivateParameters::number(const std::string& name, double otherwise, double min, double max) {
  known_.insert(name);
  if (!nh_.hasParam(name)) return otherwise;
  double value = 0;
  const std::string range = std::to_string(min) + " to " + std::to_string(max);
  if (!nh_.getParam(name, value)) fail(name, "must be a number, " + range);
  if (!(value >= min && value <= max)) fail(name, std::to_string(value) + " is out of range: must be " + range);
  return value;
}

void PrivateParameters::rejectUnknown() const {
  std::vector<std::string> names;
  if (!nh_.getParamNames(names)) return;
  const std::string prefix = nh_.getNamespace() + "/";
  for (const std::string& name : names) {
    if (name.compare(0, prefix.size(), prefix) != 0) continue;
    const std::string own = name.substr(prefix.size(), name.find('/', prefix.size()) - prefix.size());
    if (known_.count(own)) continue;
    std::string all;
    for (const std::string& known : known_) all += (all.empty() ? "" : ", ") + known;
    fail(own, "is unknown: the parameters are " + all);
  }
}

}  // namespace mmradartwin
