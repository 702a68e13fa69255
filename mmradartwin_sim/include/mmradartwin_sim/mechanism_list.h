#pragma once

#include <string>

namespace mmradartwin {

/// The registered mechanisms, a line each with the names of their parameters.
std::string mechanismList();
/// All about one: parameters with unit, range and meaning, and a line of YAML to copy into a twin.yaml. Throws
/// InputError for a name that nobody has registered.
std::string mechanismText(const std::string& name);

}  // namespace mmradartwin
