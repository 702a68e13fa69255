#include "mesh/mesh_bounds.h"

#include <assimp/mesh.h>
#include <assimp/scene.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr unsigned kMostCorners = 4096;

}  // namespace

void refuseGlbBeyondItsEnd(const std::string& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  std::ifstream in(file, std::ios::binary);
  std::array<std::uint32_t, 3> header{};  // magic, version, length
  if (error || !in.read(reinterpret_cast<char*>(header.data()), sizeof header)) return;
  if (std::memcmp(header.data(), "glTF", 4) != 0) return;
  const auto refuse = [&](const std::string& what, std::uintmax_t bytes) {
    throw InputError(file + ": " + what + " to have " + std::to_string(bytes) + " bytes, and the file has " +
                     std::to_string(size) + "; it is cut off or damaged, export it again");
  };
  if (header[2] > size) refuse("says", header[2]);
  for (std::uintmax_t at = sizeof header; at + 8 <= size;) {
    std::array<std::uint32_t, 2> chunk{};  // length, type
    in.seekg(static_cast<std::streamoff>(at));
    if (!in.read(reinterpret_cast<char*>(chunk.data()), sizeof chunk)) return;
    at += sizeof chunk + std::uintmax_t{chunk[0]};
    if (at > size) refuse("says of a part", chunk[0]);
  }
}

void refuseFacesOfManyCorners(const std::string& file, const aiScene& scene) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices <= kMostCorners) continue;
      throw InputError(file + ": a face has " + std::to_string(mesh.mFaces[f].mNumIndices) +
                       " corners; allowed: " + std::to_string(kMostCorners) + "; export the surfaces as triangles");
    }
  }
}

}  // namespace mmradartwin
