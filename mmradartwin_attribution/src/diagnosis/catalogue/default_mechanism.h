#pragma once

#include <string>

#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::catalogue {

/// A mechanism with all of its parameters at their defaults. Throws InputError for an unknown name.
NamedParameters defaultMechanism(const std::string& name);

}  // namespace mmradartwin::diagnosis::catalogue
