#pragma once

namespace mmradartwin {

class MechanismRegistry;

/// Adds the mechanisms of src/mechanisms; CMake writes its source from the files there.
void registerBuiltInMechanisms(MechanismRegistry& registry);

}  // namespace mmradartwin
