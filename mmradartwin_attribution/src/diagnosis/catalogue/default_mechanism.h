#pragma once

#include <string>

#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::catalogue {

/// Defaults of every parameter of a mechanism. Throws InputError for an unknown name.
NamedParameters defaultMechanism(const std::string& name);

}  // namespace mmradartwin::diagnosis::catalogue
