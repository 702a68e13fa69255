#pragma once

#include <string>

namespace mmradartwin {

/// Throws InputError where a PLY file is not whole: a header without end, no vertices, no faces, fewer data than the
/// header says, a face of fewer than three vertices or of one that is not there. assimp does not come back from some
/// of these.
void checkPly(const std::string& file);

}  // namespace mmradartwin
