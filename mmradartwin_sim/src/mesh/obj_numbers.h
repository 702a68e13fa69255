#pragma once

#include <optional>
#include <string>

namespace mmradartwin {

/// The text of an OBJ file with a digit on either side of every point in its vertices, normals and texture coordinates
/// (.5, -.05, 5.): assimp skips a vertex whose number begins with a point. Nothing where all have one already.
std::optional<std::string> withDigitsAroundPoints(const std::string& obj);

}  // namespace mmradartwin
