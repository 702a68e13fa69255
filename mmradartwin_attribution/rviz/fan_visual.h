#pragma once

#include <OGRE/OgreVector3.h>

#include <QString>
#include <memory>

#include "fan_geometry.h"
#include "map_shading.h"

namespace Ogre {
class Camera;
class Quaternion;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace mmradartwin {

/// A map in the scene: one texture on a fan of triangles, with rings and rays, and words of constant size around it.
class FanVisual {
 public:
  FanVisual(Ogre::SceneManager& scene, Ogre::SceneNode& parent);
  ~FanVisual();
  FanVisual(const FanVisual&) = delete;
  FanVisual& operator=(const FanVisual&) = delete;
  /// The part of the fan that is shown: up to a range and to an angle at either side.
  void setFan(const std::shared_ptr<const FanGeometry>& geometry, double up_to_m, double up_to_rad);
  void setMap(const ShadedMap& map);
  void setPlace(const Ogre::Vector3& position, const Ogre::Quaternion& orientation);
  void setAlpha(double alpha);
  void setTitle(const QString& title);
  /// Rings and rays with their words; a colour bar beside the fan.
  void setSurroundings(bool grid, bool color_bar, const QString& unit);
  void setVisible(bool visible);
  void fitLabelsTo(const Ogre::Camera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mmradartwin
