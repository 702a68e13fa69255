#pragma once

#include <OGRE/OgreMaterial.h>
#include <OGRE/OgreTexture.h>

#include <cstdint>
#include <string>

namespace mmradartwin {

/// An unlit material with one texture of 0xAARRGGBB texels, both removed with it.
class OgreTexture {
 public:
  OgreTexture();
  ~OgreTexture();
  OgreTexture(const OgreTexture&) = delete;
  OgreTexture& operator=(const OgreTexture&) = delete;
  const Ogre::MaterialPtr& material() const { return material_; }
  /// `nearest`: a texel has sharp edges.
  void fill(const std::uint32_t* argb, unsigned width, unsigned height, bool nearest);
  void setAlpha(double alpha);
  void setOverAll();  ///< nothing hides what has this material

 private:
  const std::string name_;
  Ogre::MaterialPtr material_;
  Ogre::TexturePtr texture_;
};

}  // namespace mmradartwin
