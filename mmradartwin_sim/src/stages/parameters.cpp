#include "mmradartwin_sim/parameters.h"

namespace mmradartwin {

void Parameters::set(const std::string& name, Value value) { values_[name] = std::move(value); }
bool Parameters::has(const std::string& name) const { return values_.count(name) > 0; }
double Parameters::number(const std::string& name) const { return std::get<double>(values_.at(name)); }
const std::string& Parameters::text(const std::string& name) const { return std::get<std::string>(values_.at(name)); }
const std::vector<double>& Parameters::numbers(const std::string& name) const {
  return std::get<std::vector<double>>(values_.at(name));
}
const std::vector<std::string>& Parameters::texts(const std::string& name) const {
  return std::get<std::vector<std::string>>(values_.at(name));
}

}  // namespace mmradartwin
