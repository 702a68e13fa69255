#pragma once

#include <memory>

#include "mechanisms/base/parameter_specs.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/mechanism_registry.h"

/// Makes a mechanism of this library known; the last line of the class's file, within namespace mmradartwin. Each .cpp
/// of src/mechanisms holds one mechanism, and CMake calls what this defines for all of them.
#define MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Class)                      \
  void register##Class(MechanismRegistry& registry) {                       \
    registry.add(Class().name(), [] { return std::make_unique<Class>(); }); \
  }
