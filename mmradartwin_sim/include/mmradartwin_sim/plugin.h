#pragma once

#include <string>

namespace mmradartwin {

/// Loads libraries that bring mechanisms of their own (mmradartwin_sim/register_mechanism.h), names parted by ':'. A
/// name is a path, package://PACKAGE/PATH, or a bare file name that the dynamic loader finds. A library that is loaded
/// already is passed over. Throws InputError for a library that is missing, has no mechanisms, or brings one whose name
/// is taken. `origin` says in errors where the names stand. Not to be called while twins are made on other threads.
void loadMechanismPlugins(const std::string& libraries, const std::string& origin);

/// Loads those of the environment variable MMRADARTWIN_PLUGINS; loadTwin() does it by itself.
void loadMechanismPluginsOfEnvironment();

}  // namespace mmradartwin
