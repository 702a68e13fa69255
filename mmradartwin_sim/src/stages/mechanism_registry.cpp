#include "mmradartwin_sim/mechanism_registry.h"

#include "mmradartwin_dsp/input_error.h"
#include "stages/built_in_mechanisms.h"

namespace mmradartwin {

MechanismRegistry& MechanismRegistry::instance() {
  static MechanismRegistry registry = [] {
    MechanismRegistry r;
    registerBuiltInMechanisms(r);
    return r;
  }();
  return registry;
}

void MechanismRegistry::add(const std::string& name, Factory factory) { factories_[name] = std::move(factory); }

std::unique_ptr<Mechanism> MechanismRegistry::create(const std::string& name) const {
  const auto found = factories_.find(name);
  if (found != factories_.end()) return found->second();
  std::string known;
  for (const auto& [k, factory] : factories_) known += (known.empty() ? "" : ", ") + k;
  throw InputError("unknown mechanism " + name + "; known: " + known);
}

std::vector<std::string> MechanismRegistry::names() const {
  std::vector<std::string> names;
  for (const auto& [k, factory] : factories_) names.push_back(k);
  return names;
}

}  // namespace mmradartwin
