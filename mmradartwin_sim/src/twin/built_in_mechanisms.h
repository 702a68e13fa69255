#pragma once

#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {

/// Adds the mechanisms of src/mechanisms; CMake writes its source from the files there.
void registerBuiltInMechanisms(MechanismRegistry& registry);

}  // namespace mmradartwin
