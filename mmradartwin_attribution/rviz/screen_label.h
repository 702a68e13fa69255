#pragma once

#include <OGRE/OgreVector3.h>

#include <QImage>
#include <memory>

namespace Ogre {
class Camera;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace mmradartwin {

/// A picture at a place of the scene that keeps its size in pixels and is never hidden.
class ScreenLabel {
 public:
  ScreenLabel(Ogre::SceneManager& scene, Ogre::SceneNode& parent);
  ~ScreenLabel();
  ScreenLabel(const ScreenLabel&) = delete;
  ScreenLabel& operator=(const ScreenLabel&) = delete;
  void setPicture(const QImage& picture);
  void setPlace(const Ogre::Vector3& in_parent);
  /// To be called when the camera may have moved.
  void fitTo(const Ogre::Camera& camera);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Words in a dark rim.
QImage wordsPicture(const QString& words);

}  // namespace mmradartwin
