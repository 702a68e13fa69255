#include "screen_label.h"

#include <OGRE/OgreBillboardSet.h>
#include <OGRE/OgreCamera.h>
#include <OGRE/OgreSceneManager.h>
#include <OGRE/OgreSceneNode.h>
#include <OGRE/OgreViewport.h>

#include <QPainter>
#include <cmath>

#include "map_painting.h"
#include "ogre_texture.h"

namespace mmradartwin {

struct ScreenLabel::Impl {
  Impl(Ogre::SceneManager& in, Ogre::SceneNode* of) : scene(in), node(of), board(in.createBillboardSet(1)) {}

  Ogre::SceneManager& scene;
  Ogre::SceneNode* node;
  OgreTexture texture;
  Ogre::BillboardSet* board;
  double width_px = 0, height_px = 0;
  double pixel_m = 0;  ///< as it is drawn now
};

ScreenLabel::ScreenLabel(Ogre::SceneManager& scene, Ogre::SceneNode& parent)
    : impl_(std::make_unique<Impl>(scene, parent.createChildSceneNode())) {
  impl_->texture.setOverAll();
  impl_->board->setMaterialName(impl_->texture.material()->getName());
  impl_->board->createBillboard(Ogre::Vector3::ZERO);
  impl_->board->setRenderQueueGroup(Ogre::RENDER_QUEUE_OVERLAY - 1);
  impl_->node->attachObject(impl_->board);
}

ScreenLabel::~ScreenLabel() {
  impl_->scene.destroyBillboardSet(impl_->board);
  impl_->scene.destroySceneNode(impl_->node);
}

void ScreenLabel::setPicture(const QImage& picture) {
  const QImage argb = picture.convertToFormat(QImage::Format_ARGB32);
  impl_->width_px = argb.width();
  impl_->height_px = argb.height();
  impl_->texture.fill(reinterpret_cast<const std::uint32_t*>(argb.constBits()), static_cast<unsigned>(argb.width()),
                      static_cast<unsigned>(argb.height()), false);
  impl_->pixel_m = 0;
}

void ScreenLabel::setPlace(const Ogre::Vector3& in_parent) { impl_->node->setPosition(in_parent); }

void ScreenLabel::fitTo(const Ogre::Camera& camera) {
  if (!camera.getViewport()) return;
  // Half of the view's height is 1 after projection and division by the depth, of which an orthogonal view has none.
  const Ogre::Matrix4& projection = camera.getProjectionMatrix();
  const Ogre::Vector3 seen = camera.getViewMatrix() * impl_->node->_getDerivedPosition();
  const double depth = projection[3][2] * seen.z + projection[3][3];
  const double pixel_m = 2 * depth / (projection[1][1] * camera.getViewport()->getActualHeight());
  impl_->board->setVisible(depth > 0);
  if (depth <= 0 || std::abs(pixel_m - impl_->pixel_m) < 1e-3 * pixel_m) return;
  impl_->pixel_m = pixel_m;
  impl_->board->setDefaultDimensions(static_cast<float>(pixel_m * impl_->width_px),
                                     static_cast<float>(pixel_m * impl_->height_px));
}

QImage wordsPicture(const QString& words) {
  constexpr double kRim_px = 3;
  const QSizeF size = textSize(words);
  QImage picture(static_cast<int>(std::ceil(size.width() + 2 * kRim_px)),
                 static_cast<int>(std::ceil(size.height() + 2 * kRim_px)), QImage::Format_ARGB32);
  picture.fill(Qt::transparent);
  QPainter painter(&picture);
  drawRimmedText(painter, {kRim_px, kRim_px + 0.8 * size.height()}, words);
  return picture;
}

}  // namespace mmradartwin
