#include "ogre_texture.h"

#include <OGRE/OgreHardwarePixelBuffer.h>
#include <OGRE/OgreMaterialManager.h>
#include <OGRE/OgrePixelFormat.h>
#include <OGRE/OgreResourceGroupManager.h>
#include <OGRE/OgreTechnique.h>
#include <OGRE/OgreTextureManager.h>

namespace mmradartwin {
namespace {

const Ogre::String& group() { return Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME; }

std::string freshName() {
  static int count = 0;
  return "mmradartwin texture " + std::to_string(count++);
}

}  // namespace

OgreTexture::OgreTexture() : name_(freshName()) {
  material_ = Ogre::MaterialManager::getSingleton().create(name_, group());
  material_->setReceiveShadows(false);
  material_->getTechnique(0)->setLightingEnabled(false);
  material_->setCullingMode(Ogre::CULL_NONE);
  material_->setSceneBlending(Ogre::SBT_TRANSPARENT_ALPHA);
  material_->setDepthWriteEnabled(false);
}

OgreTexture::~OgreTexture() {
  material_->unload();
  Ogre::MaterialManager::getSingleton().remove(material_->getName(), group());
  if (texture_) Ogre::TextureManager::getSingleton().remove(texture_->getName(), group());
}

void OgreTexture::fill(const std::uint32_t* argb, unsigned width, unsigned height, bool nearest) {
  Ogre::Pass& pass = *material_->getTechnique(0)->getPass(0);
  if (!texture_ || texture_->getWidth() != width || texture_->getHeight() != height) {
    if (texture_) Ogre::TextureManager::getSingleton().remove(texture_->getName(), group());
    texture_ = Ogre::TextureManager::getSingleton().createManual(name_, group(), Ogre::TEX_TYPE_2D, width, height, 0,
                                                                 Ogre::PF_A8R8G8B8, Ogre::TU_DYNAMIC_WRITE_ONLY);
    pass.removeAllTextureUnitStates();
    Ogre::TextureUnitState& unit = *pass.createTextureUnitState(name_);
    unit.setTextureAddressingMode(Ogre::TextureUnitState::TAM_CLAMP);
    unit.setTextureFiltering(nearest ? Ogre::TFO_NONE : Ogre::TFO_BILINEAR);
  }
  // Ogre copies from the box and does not change it.
  const Ogre::PixelBox box(width, height, 1, Ogre::PF_A8R8G8B8, const_cast<std::uint32_t*>(argb));
  texture_->getBuffer()->blitFromMemory(box);
}

void OgreTexture::setAlpha(double alpha) {
  Ogre::Pass& pass = *material_->getTechnique(0)->getPass(0);
  for (unsigned short i = 0; i < pass.getNumTextureUnitStates(); ++i) {
    pass.getTextureUnitState(i)->setAlphaOperation(Ogre::LBX_MODULATE, Ogre::LBS_TEXTURE, Ogre::LBS_MANUAL, 1, alpha);
  }
}

void OgreTexture::setOverAll() { material_->setDepthCheckEnabled(false); }

}  // namespace mmradartwin
