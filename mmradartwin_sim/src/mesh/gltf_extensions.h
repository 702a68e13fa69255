#pragma once

#include <string>

namespace mmradartwin {

/// Throws InputError for a glTF file (.gltf or .glb) whose surfaces are held by an extension that is not read: one that
/// it requires, or one that it uses in a way that would drop or misplace surfaces in silence. Names the extension and
/// how to export without it. What concerns looks alone (materials, textures, lights) may be required. A file that is no
/// JSON passes: reading it says what is wrong.
void refuseUnreadExtensions(const std::string& file);

}  // namespace mmradartwin
