#include "scene/declared_frame.h"

#include <assimp/scene.h>

#include <Eigen/Geometry>
#include <cmath>

namespace mmradartwin {
namespace {

constexpr double kFbxUnit_m = 0.01;  ///< UnitScaleFactor counts centimetres

int setting(const aiScene& scene, const char* key, int otherwise) {
  int value = otherwise;
  return scene.mMetaData && scene.mMetaData->Get(key, value) ? value : otherwise;
}

/// The unit vector of an axis of FBX's settings; zero for one that is none.
Eigen::Vector3d axis(int number, int sign) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  if (number >= 0 && number < 3) direction[number] = sign < 0 ? -1 : 1;
  return direction;
}

/// FBX's up, front (towards who looks) and right axes. The three have to be right-handed: where they are not, exporters
/// have got the last two wrong, and up alone holds.
Eigen::Matrix3d uprightFromFbx(const aiScene& scene) {
  const Eigen::Vector3d up = axis(setting(scene, "UpAxis", 1), setting(scene, "UpAxisSign", 1));
  const Eigen::Vector3d front = axis(setting(scene, "FrontAxis", 2), setting(scene, "FrontAxisSign", 1));
  const Eigen::Vector3d right = axis(setting(scene, "CoordAxis", 0), setting(scene, "CoordAxisSign", 1));
  Eigen::Matrix3d turn;
  turn << right.transpose(), -front.transpose(), up.transpose();
  if (turn.determinant() > 0.5) return turn;
  if (up.isZero()) return uprightFromYUp();
  return Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix().array().round();
}

double fbxUnit_m(const aiScene& scene) {
  double factor = 1;
  float single = 1;
  if (scene.mMetaData && scene.mMetaData->Get("UnitScaleFactor", single)) factor = single;
  if (scene.mMetaData) scene.mMetaData->Get("UnitScaleFactor", factor);
  return kFbxUnit_m * (factor > 0 && std::isfinite(factor) ? factor : 1);
}

}  // namespace

Eigen::Matrix3d uprightFromYUp() {
  Eigen::Matrix3d turn;
  turn << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return turn;
}

DeclaredFrame declaredFrame(const std::string& extension, const aiScene& scene) {
  if (extension == ".gltf" || extension == ".glb" || extension == ".dae" || extension == ".zae") {
    return {uprightFromYUp(), 1.0};
  }
  if (extension == ".fbx") return {uprightFromFbx(scene), fbxUnit_m(scene)};
  return {};
}

}  // namespace mmradartwin
