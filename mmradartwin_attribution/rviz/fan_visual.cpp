#include "fan_visual.h"

#include <OGRE/OgreCamera.h>
#include <OGRE/OgreManualObject.h>
#include <OGRE/OgreSceneManager.h>
#include <OGRE/OgreSceneNode.h>

#include <QImage>
#include <QPainter>
#include <cmath>
#include <vector>

#include "map_painting.h"
#include "ogre_texture.h"
#include "scale_ticks.h"
#include "screen_label.h"

namespace mmradartwin {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kGridAbove_m = 0.003;

Ogre::Vector3 polar(double range_m, double azimuth_rad, double z) {
  return {static_cast<float>(range_m * std::cos(azimuth_rad)), static_cast<float>(range_m * std::sin(azimuth_rad)),
          static_cast<float>(z)};
}

Ogre::ColourValue ogreColor(Rgb c) { return Ogre::ColourValue(c.r / 255.0F, c.g / 255.0F, c.b / 255.0F, 1); }

}  // namespace

struct FanVisual::Impl {
  Impl(Ogre::SceneManager& in, Ogre::SceneNode* of) : scene(in), node(of) {}

  Ogre::SceneManager& scene;
  Ogre::SceneNode* node;
  OgreTexture texture;
  Ogre::ManualObject *fan = nullptr, *lines = nullptr;
  std::vector<std::unique_ptr<ScreenLabel>> labels;
  std::unique_ptr<ScreenLabel> title, bar;
  std::shared_ptr<const FanGeometry> geometry;
  double up_to_m = 0, up_to_rad = 0, alpha = 1;
  bool grid = true, color_bar = false;
  QString title_words, unit;
  ColorScale scale;
  double reference_db = 0;
  bool surroundings_due = true;

  void drawSurroundings();
};

FanVisual::FanVisual(Ogre::SceneManager& scene, Ogre::SceneNode& parent)
    : impl_(std::make_unique<Impl>(scene, parent.createChildSceneNode())) {
  impl_->fan = scene.createManualObject();
  impl_->lines = scene.createManualObject();
  impl_->node->attachObject(impl_->fan);
  impl_->node->attachObject(impl_->lines);
}

FanVisual::~FanVisual() {
  impl_->labels.clear();
  impl_->title.reset();
  impl_->bar.reset();
  impl_->scene.destroyManualObject(impl_->fan);
  impl_->scene.destroyManualObject(impl_->lines);
  impl_->scene.destroySceneNode(impl_->node);
}

void FanVisual::setFan(const std::shared_ptr<const FanGeometry>& geometry, double up_to_m, double up_to_rad) {
  if (geometry == impl_->geometry && up_to_m == impl_->up_to_m && up_to_rad == impl_->up_to_rad) return;
  impl_->geometry = geometry;
  impl_->up_to_m = up_to_m;
  impl_->up_to_rad = up_to_rad;
  impl_->surroundings_due = true;
  const FanMesh mesh = geometry->mesh(2 * kDegree, up_to_m);
  impl_->fan->clear();
  impl_->fan->estimateVertexCount(mesh.vertices.size());
  impl_->fan->estimateIndexCount(mesh.triangles.size());
  impl_->fan->begin(impl_->texture.material()->getName(), Ogre::RenderOperation::OT_TRIANGLE_LIST);
  for (const FanMesh::Vertex& v : mesh.vertices) {
    impl_->fan->position(static_cast<float>(v.place.x_m), static_cast<float>(v.place.y_m), 0);
    impl_->fan->textureCoord(static_cast<float>(v.u), static_cast<float>(v.v));
  }
  for (std::uint32_t index : mesh.triangles) impl_->fan->index(index);
  impl_->fan->end();
}

void FanVisual::setMap(const ShadedMap& map) {
  impl_->texture.fill(map.argb.data(), static_cast<unsigned>(impl_->geometry->angles()),
                      static_cast<unsigned>(impl_->geometry->ranges()), true);
  impl_->texture.setAlpha(impl_->alpha);
  const auto changed = [&](double before, double now) { return std::abs(before - now) > 1e-3; };
  if (impl_->scale.map != map.scale.map ||
      changed(impl_->scale.low_db - impl_->reference_db, map.scale.low_db - map.reference_db) ||
      changed(impl_->scale.high_db - impl_->reference_db, map.scale.high_db - map.reference_db)) {
    impl_->surroundings_due = true;
  }
  impl_->scale = map.scale;
  impl_->reference_db = map.reference_db;
}

void FanVisual::setPlace(const Ogre::Vector3& position, const Ogre::Quaternion& orientation) {
  impl_->node->setPosition(position);
  impl_->node->setOrientation(orientation);
}

void FanVisual::setAlpha(double alpha) {
  impl_->alpha = alpha;
  impl_->texture.setAlpha(alpha);
}

void FanVisual::setTitle(const QString& title) {
  if (title == impl_->title_words) return;
  impl_->title_words = title;
  impl_->surroundings_due = true;
}

void FanVisual::setSurroundings(bool grid, bool color_bar, const QString& unit) {
  if (grid == impl_->grid && color_bar == impl_->color_bar && unit == impl_->unit) return;
  impl_->grid = grid;
  impl_->color_bar = color_bar;
  impl_->unit = unit;
  impl_->surroundings_due = true;
}

void FanVisual::setVisible(bool visible) { impl_->node->setVisible(visible); }

void FanVisual::Impl::drawSurroundings() {
  surroundings_due = false;
  labels.clear();
  title.reset();
  bar.reset();
  lines->clear();
  const auto label = [this](double range_m, double azimuth_rad, const QImage& picture) {
    auto made = std::make_unique<ScreenLabel>(scene, *node);
    made->setPicture(picture);
    made->setPlace(polar(range_m, azimuth_rad, kGridAbove_m));
    return made;
  };
  if (!title_words.isEmpty()) title = label(1.14 * up_to_m, 0, wordsPicture(title_words));
  if (color_bar) {
    QImage picture(kColorBarWidth_px + 40, 190, QImage::Format_ARGB32);
    picture.fill(toQColor(kBackground));
    QPainter painter(&picture);
    drawColorBar(painter, QRectF(6, 2, picture.width() - 10, 184), scale, reference_db, unit);
    bar = label(1.05 * up_to_m, -up_to_rad, picture);
  }
  if (!grid) return;
  lines->begin("BaseWhiteNoLighting", Ogre::RenderOperation::OT_LINE_LIST);
  const auto line = [this](const Ogre::Vector3& a, const Ogre::Vector3& b) {
    for (const Ogre::Vector3& p : {a, b}) {
      lines->position(p);
      lines->colour(ogreColor(kGrid));
    }
  };
  const std::vector<double> rings = ticks(0, up_to_m, 7);
  constexpr int kSteps = 60;
  for (double range : rings) {
    if (range == 0) continue;
    for (int i = 0; i < kSteps; ++i) {
      const auto angle = [&](int step) { return up_to_rad * (2.0 * step / kSteps - 1); };
      line(polar(range, angle(i), kGridAbove_m), polar(range, angle(i + 1), kGridAbove_m));
    }
    // The outermost ring's words would lie over those of the outermost ray.
    if (range < 0.93 * up_to_m) labels.push_back(label(range, -up_to_rad, wordsPicture(QString("%1 m").arg(range))));
  }
  const int last_deg = static_cast<int>(up_to_rad / kDegree + 0.5);
  for (int deg = -90; deg <= 90; deg += 30) {
    if (std::abs(deg) > last_deg) continue;
    line(polar(0, 0, kGridAbove_m), polar(up_to_m, deg * kDegree, kGridAbove_m));
    labels.push_back(label(1.05 * up_to_m, deg * kDegree,
                           wordsPicture(QString::fromUtf8("%1°").arg(deg).replace('-', QChar(0x2212)))));
  }
  lines->end();
}

void FanVisual::fitLabelsTo(const Ogre::Camera& camera) {
  if (impl_->surroundings_due) impl_->drawSurroundings();
  for (const auto& label : impl_->labels) label->fitTo(camera);
  if (impl_->title) impl_->title->fitTo(camera);
  if (impl_->bar) impl_->bar->fitTo(camera);
}

}  // namespace mmradartwin
