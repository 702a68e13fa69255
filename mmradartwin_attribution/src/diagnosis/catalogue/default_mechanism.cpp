#include "diagnosis/catalogue/default_mechanism.h"

#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis::catalogue {

NamedParameters defaultMechanism(const std::string& name) {
  NamedParameters named{name, {}};
  for (const ParameterSpec& spec : MechanismRegistry::instance().create(name)->parameters()) {
    named.values.set(spec.name, spec.default_value);
  }
  return named;
}

}  // namespace mmradartwin::diagnosis::catalogue
