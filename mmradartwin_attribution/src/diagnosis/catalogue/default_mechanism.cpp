#include "diagnosis/catalogue/default_mechanism.h"

#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis::catalogue {

NamedParameters defaultMechanism(const std::string& name) {
  NamedParameters named{name, {}};
  for (const ParameterSpec& s : MechanismRegistry::instance().create(name)->parameters()) {
    named.values.set(s.name, s.default_value);
  }
  return named;
}

}  // namespace mmradartwin::diagnosis::catalogue
