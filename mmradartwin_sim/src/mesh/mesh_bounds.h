#pragma once

#include <string>

struct aiScene;

namespace mmradartwin {

/// Throws InputError for a binary glTF whose header or chunks say more bytes than the file has: room would be made for
/// all of them.
void refuseGlbBeyondItsEnd(const std::string& file);

/// Throws InputError for a mesh with a face of more corners than any exporter writes: making triangles of it takes
/// time by their square.
void refuseFacesOfManyCorners(const std::string& file, const aiScene& scene);

}  // namespace mmradartwin
