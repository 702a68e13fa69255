#pragma once

#include <string>

namespace mmradartwin {

/// The packages' version, with git's word where they were built from a checkout.
std::string programVersion();

}  // namespace mmradartwin
