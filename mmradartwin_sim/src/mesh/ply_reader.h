#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace mmradartwin {

/// A polygon mesh in its file's coordinates.
struct PlyMesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::vector<int>> faces;               ///< of three corners or more
  std::vector<std::array<unsigned char, 3>> colors;  ///< of each vertex, where the file has red, green and blue

  /// The mesh as an OBJ file's text in single precision, which assimp reads without fault.
  std::string toObj() const;
};

/// Throws InputError where a PLY file is not whole: a header without end, no vertices, no faces, fewer data than the
/// header says, a face of fewer than three vertices or of one that is not there. assimp does not come back from some of
/// these, and misreads binary data that begin like a line's end.
PlyMesh readPly(const std::string& file);
/// readPly() of a file that may be a point cloud: it need not have faces, and lines of two points are left out. At most
/// so many vertices and faces. Throws InputError.
PlyMesh readPlyScan(const std::string& file, std::uint64_t most_vertices, std::uint64_t most_faces);

}  // namespace mmradartwin
