#include <assimp/DefaultIOSystem.h>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <unordered_map>

#include "mesh/far_vertices.h"
#include "mesh/gltf_extensions.h"
#include "mesh/mesh_bounds.h"
#include "mesh/obj_numbers.h"
#include "mesh/ply_reader.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/mesh_frame.h"
#include "mmradartwin_sim/scene.h"
#include "scene/declared_frame.h"

namespace mmradartwin {
namespace {

constexpr double kHuge_m = 1e6;

struct FloatHash {
  std::size_t operator()(const std::array<float, 3>& v) const {
    std::size_t h = 1469598103934665603ULL;
    for (float f : v) {
      std::uint32_t bits;
      std::memcpy(&bits, &f, sizeof bits);
      h = (h ^ bits) * 1099511628211ULL;
    }
    return h;
  }
};

/// assimp keeps single precision; an OBJ or PLY file's own digits are looked up by the float they round to.
using FullPrecision = std::unordered_map<std::array<float, 3>, Eigen::Vector3d, FloatHash>;

void keep(const Eigen::Vector3d& v, FullPrecision& exact) {
  exact.emplace(std::array<float, 3>{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])}, v);
}

/// The vertex of an OBJ file's line, where it holds one; rest: what stands behind it.
std::optional<Eigen::Vector3d> objVertex(const std::string& line, std::string* rest = nullptr) {
  if (line.size() < 2 || line[0] != 'v' || (line[1] != ' ' && line[1] != '\t')) return std::nullopt;
  const char* at = line.c_str() + 1;
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    char* end = nullptr;
    v[i] = std::strtod(at, &end);
    if (end == at) return std::nullopt;
    at = end;
  }
  if (rest) *rest = at;
  return v;
}

FullPrecision readObjVertices(std::istream& in) {
  FullPrecision exact;
  std::string line;
  while (std::getline(in, line)) {
    if (const auto v = objVertex(line)) keep(*v, exact);
  }
  return exact;
}

/// An OBJ file's text with an origin, in its own coordinates, taken off its vertices. Names of materials stay; what
/// its material library says of them is not needed.
std::string objWithoutOrigin(const std::string& file, const Eigen::Vector3d& origin) {
  std::ifstream in(file);
  std::ostringstream text;
  std::string line, rest;
  while (std::getline(in, line)) {
    if (const auto v = objVertex(line, &rest)) {
      const Eigen::Vector3d near = *v - origin;
      text << "v " << formatExact(near.x()) << ' ' << formatExact(near.y()) << ' ' << formatExact(near.z()) << rest
           << '\n';
    } else {
      text << line << '\n';
    }
  }
  return text.str();
}

/// assimp's own reading of digits may differ by an ulp from the nearest float, so neighbours are tried too.
Eigen::Vector3d restore(const FullPrecision& exact, const aiVector3D& p) {
  const Eigen::Vector3d coarse(p.x, p.y, p.z);
  if (exact.empty()) return coarse;
  const auto near = [](float f, int step) {
    return step == 0 ? f : std::nextafter(f, step > 0 ? HUGE_VALF : -HUGE_VALF);
  };
  for (int dx : {0, 1, -1}) {
    for (int dy : {0, 1, -1}) {
      for (int dz : {0, 1, -1}) {
        const auto found = exact.find({near(p.x, dx), near(p.y, dy), near(p.z, dz)});
        if (found != exact.end()) return found->second;
      }
    }
  }
  return coarse;
}

std::string lowerExtension(const std::string& file) {
  std::string e = std::filesystem::path(file).extension().string();
  std::transform(e.begin(), e.end(), e.begin(), [](unsigned char c) { return std::tolower(c); });
  return e;
}

/// The files that assimp opens: the mesh, with another text where one is given, and those that the mesh names, an OBJ's
/// materials and a glTF's buffers. None but regular files is opened: reading a pipe or a device may wait without end.
class MeshFiles : public Assimp::DefaultIOSystem {
 public:
  explicit MeshFiles(std::string mesh, std::optional<std::string> text = std::nullopt)
      : mesh_(std::move(mesh)), text_(std::move(text)) {}

  bool Exists(const char* file) const override {
    std::error_code error;
    return std::filesystem::exists(file, error);
  }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    if (text_ && file == mesh_) {
      return new Assimp::MemoryIOStream(reinterpret_cast<const std::uint8_t*>(text_->data()), text_->size());
    }
    std::error_code error;
    if (std::filesystem::is_directory(file, error)) return nullptr;
    try {
      requireRegularFile(file);
    } catch (const InputError& refused) {  // assimp goes on without the file, and refuseWhatWasNoFile() speaks
      if (refused_.empty()) refused_ = refused.what();
      return nullptr;
    }
    return DefaultIOSystem::Open(file, mode);
  }
  /// Throws InputError where assimp asked for something else than a file.
  void refuseWhatWasNoFile() const {
    if (!refused_.empty()) throw InputError(mesh_ + ": names " + refused_);
  }

 private:
  const std::string mesh_;
  const std::optional<std::string> text_;
  std::string refused_;
};

std::string textOf(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Numbers actors that are named alike: the second of a name becomes NAME_2, or the next number that is free.
void numberNames(std::vector<Actor>& actors) {
  std::set<std::string> taken, seen;
  for (const Actor& actor : actors) taken.insert(actor.name);
  for (Actor& actor : actors) {
    if (seen.insert(actor.name).second) continue;
    actor.name_in_mesh = actor.name;
    int number = 2;
    while (taken.count(actor.name_in_mesh + "_" + std::to_string(number))) ++number;
    actor.name += "_" + std::to_string(number);
    taken.insert(actor.name);
    seen.insert(actor.name);
  }
}

class Collector {
 public:
  /// to_map: linear map of assimp's coordinates to metres with z up; origin: taken off them.
  Collector(const std::string& file, const aiScene& scene, FullPrecision exact, const Eigen::Matrix3d& to_map,
            const Eigen::Vector3d& origin)
      : file_(file),
        scene_(scene),
        extension_(lowerExtension(file)),
        exact_(std::move(exact)),
        to_map_(to_map),
        origin_(origin) {
    stem_ = std::filesystem::path(file).stem().string();
  }

  std::vector<Actor> collect() {
    visit(*scene_.mRootNode, aiMatrix4x4());
    return std::move(actors_);
  }

 private:
  std::string actorName(const aiNode& node, const aiMesh& mesh) const {
    if (extension_ == ".ply" || extension_ == ".stl") return stem_;
    std::string name = node.mName.C_Str();
    if (extension_ == ".obj") {
      if (name.empty() || name == "defaultobject" || &node == scene_.mRootNode) name = stem_;
      return name;
    }
    if (name.empty()) name = mesh.mName.C_Str();
    return name.empty() ? stem_ : name;
  }

  void visit(const aiNode& node, const aiMatrix4x4& above) {
    const aiMatrix4x4 T = above * node.mTransformation;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) add(node, *scene_.mMeshes[node.mMeshes[i]], T);
    for (unsigned i = 0; i < node.mNumChildren; ++i) visit(*node.mChildren[i], T);
  }

  void add(const aiNode& node, const aiMesh& mesh, const aiMatrix4x4& T) {
    if (!(mesh.mPrimitiveTypes & aiPrimitiveType_TRIANGLE)) return;
    std::string name = actorName(node, mesh);
    aiString tag_text;
    scene_.mMaterials[mesh.mMaterialIndex]->Get(AI_MATKEY_NAME, tag_text);
    const std::string tag = tag_text.C_Str();
    Actor* actor = nullptr;
    // One surface material per actor: what an object has in further materials becomes actors NAME.TAG of its own.
    for (int attempt = 0; attempt < 2 && !actor; ++attempt) {
      const auto key = std::make_pair(&node, name);
      const auto found = index_.find(key);
      const bool same_group = found == index_.end() && extension_ == ".obj" && by_name_.count(name);
      if (found == index_.end() && !same_group) {
        index_[key] = actors_.size();
        if (extension_ == ".obj") by_name_[name] = actors_.size();
        actors_.emplace_back();
        actors_.back().name = name;
        actors_.back().material_tag = tag;
        actor = &actors_.back();
      } else {
        Actor& candidate = actors_[same_group ? by_name_[name] : found->second];
        if (candidate.material_tag == tag)
          actor = &candidate;
        else
          name += "." + tag;
      }
    }
    if (!actor) throw InputError(file_ + ": object " + name + " is there twice; give objects names of their own");
    const int base = static_cast<int>(actor->vertices.size());
    const bool identity = T.IsIdentity();
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& p = mesh.mVertices[i];
      Eigen::Vector3d v = identity
                              ? restore(exact_, p)
                              : Eigen::Vector3d(double(T.a1) * p.x + double(T.a2) * p.y + double(T.a3) * p.z + T.a4,
                                                double(T.b1) * p.x + double(T.b2) * p.y + double(T.b3) * p.z + T.b4,
                                                double(T.c1) * p.x + double(T.c2) * p.y + double(T.c3) * p.z + T.c4);
      v = to_map_ * v - origin_;
      if (!v.allFinite() || v.cwiseAbs().maxCoeff() > kHuge_m) {
        throw InputError(file_ + ": object " + name + ": a vertex is not a finite number within 1e6; repair the mesh" +
                         (v.allFinite() ? ", or take an origin off" + originAdvice(v) : ""));
      }
      actor->vertices.push_back(v);
    }
    for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
      const aiFace& face = mesh.mFaces[i];
      if (face.mNumIndices != 3) continue;
      for (int k = 0; k < 3; ++k) {
        if (face.mIndices[k] >= mesh.mNumVertices)
          throw InputError(file_ + ": object " + name + ": a face names a vertex that is not there");
      }
      actor->triangles.push_back({base + static_cast<int>(face.mIndices[0]), base + static_cast<int>(face.mIndices[1]),
                                  base + static_cast<int>(face.mIndices[2])});
    }
  }

  const std::string file_;
  const aiScene& scene_;
  std::string extension_, stem_;
  FullPrecision exact_;
  const Eigen::Matrix3d to_map_;
  const Eigen::Vector3d origin_;
  std::vector<Actor> actors_;
  std::map<std::pair<const aiNode*, std::string>, std::size_t> index_;
  std::map<std::string, std::size_t> by_name_;
};

void refuseStatedTwice(const std::string& file, const MeshFrame& stated, const DeclaredFrame& declared) {
  if (declared.upright && stated.y_up) {
    throw InputError(file +
                     ": declares its axes itself, so that scene.yaml's up cannot be given for it; where the file "
                     "is wrong, turn it by rpy_deg");
  }
  if (declared.unit_m && stated.unit_m) {
    throw InputError(file +
                     ": declares its unit itself, so that scene.yaml's unit cannot be given for it; where the "
                     "file is wrong, give a scale");
  }
}

}  // namespace

std::vector<Actor> loadMesh(const std::string& file) { return loadMesh(file, MeshFrame()); }

std::vector<Actor> loadMesh(const std::string& file, const MeshFrame& stated) {
  requireRegularFile(file);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw InputError(file + ": no such mesh file");
  const std::string extension = lowerExtension(file);
  if (extension == ".glb") refuseGlbBeyondItsEnd(file);
  if (extension == ".gltf" || extension == ".glb") refuseUnreadExtensions(file);
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_LINE | aiPrimitiveType_POINT);
  const unsigned steps = aiProcess_Triangulate | aiProcess_SortByPType;
  // The digits of these files are read here, so that a far origin is taken off before single precision.
  const bool digits = extension == ".ply" || extension == ".obj";
  const Eigen::Matrix3d stated_frame = stated.toUpright();
  const Eigen::Vector3d off =
      digits ? Eigen::Vector3d(stated_frame.inverse() * stated.origin) : Eigen::Vector3d::Zero();
  FullPrecision exact;
  const aiScene* scene = nullptr;
  std::optional<std::string> text;  // in place of the file's own
  if (extension == ".obj") {
    // A digit on either side of every point, which assimp wants.
    const std::string own = off.isZero(0) ? textOf(file) : objWithoutOrigin(file, off);
    text = withDigitsAroundPoints(own).value_or(own);
    std::istringstream in(*text);
    exact = readObjVertices(in);
  }
  auto* files = new MeshFiles(file, std::move(text));
  importer.SetIOHandler(files);  // which deletes it
  if (extension == ".ply") {
    PlyMesh mesh = readPly(file);
    for (Eigen::Vector3d& v : mesh.vertices) keep(v -= off, exact);
    const std::string obj = mesh.toObj();
    scene = importer.ReadFileFromMemory(obj.data(), obj.size(), 0, "obj");
  } else {
    scene = importer.ReadFile(file, 0);
  }
  files->refuseWhatWasNoFile();
  if (scene) {
    refuseFacesOfManyCorners(file, *scene);
    scene = importer.ApplyPostProcessing(steps);
  }
  if (!scene || !scene->mRootNode) {
    std::string why = importer.GetErrorString();
    std::replace(why.begin(), why.end(), '\n', ' ');
    throw InputError(file + ": cannot be read as a mesh (" + why + "); OBJ, PLY, STL and glTF are known");
  }
  const DeclaredFrame declared = declaredFrame(extension, *scene);
  refuseStatedTwice(file, stated, declared);
  const Eigen::Matrix3d to_map =
      declared.upright.value_or(Eigen::Matrix3d::Identity()) * declared.unit_m.value_or(1) * stated_frame;
  std::vector<Actor> actors =
      Collector(file, *scene, std::move(exact), to_map, digits ? Eigen::Vector3d::Zero() : stated.origin).collect();
  actors.erase(std::remove_if(actors.begin(), actors.end(), [](const Actor& a) { return a.triangles.empty(); }),
               actors.end());
  if (actors.empty()) throw InputError(file + ": holds no triangles; export the surfaces as a triangle mesh");
  numberNames(actors);
  refuseFarVertices(file, actors, digits ? Eigen::Vector3d::Zero() : stated.origin);
  return actors;
}

}  // namespace mmradartwin
