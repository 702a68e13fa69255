#pragma once

#include <string>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Index of the actor that a mechanism's parameter names. Throws InputError naming mechanism and known actors where
/// there is no such actor.
int requireActor(const Scene& scene, const std::string& mechanism, const std::string& actor);

/// Which actors are of a material. Throws InputError naming mechanism and known materials where none is.
std::vector<bool> requireMaterial(const Scene& scene, const std::string& mechanism, const std::string& material);

}  // namespace mmradartwin
