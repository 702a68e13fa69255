#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "mirror_image.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin {
namespace {

/// Upright plates, each an actor of its own, 3 m high about the radar's height 0.
class Plates : public ::testing::Test {
 protected:
  void addPlate(double from_x_m, double from_y_m, double to_x_m, double to_y_m) {
    Actor plate;
    plate.name = "plate" + std::to_string(scene_.actors.size());
    plate.vertices = {
        {from_x_m, from_y_m, -1.5}, {to_x_m, to_y_m, -1.5}, {to_x_m, to_y_m, 1.5}, {from_x_m, from_y_m, 1.5}};
    plate.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const Eigen::Vector3d& v : plate.vertices) plate.bounds.extend(v);
    scene_.actors.push_back(plate);
  }
  std::vector<MirrorImage> imagesAt(double x_m, double y_m, int max_order, double max_length_m = 40) {
    rebuildFacets(scene_);
    rays_ = std::make_unique<RayCaster>(scene_);
    const MirrorSearch search(scene_, *rays_, wavelength_m_);
    return search.find(Eigen::Isometry3d(Eigen::Translation3d(x_m, y_m, 0)), max_order, max_length_m, 0.5);
  }
  std::string actorsOf(const MirrorImage& image) const {
    std::string names;
    for (int facet : image.facets) names += scene_.actors[scene_.facets[facet].actor].name.back();
    return names;
  }

  double wavelength_m_ = paperRadar().wavelength_m();
  Scene scene_;
  std::unique_ptr<RayCaster> rays_;
};

// Ahead, behind, ahead: 3 m, 5 m, 5 m and 3 m.
TEST_F(Plates, TwoThatFaceEachOtherMakeAnImageOfThird) {
  addPlate(3, -2, 3, 2);
  addPlate(-2, -2, -2, 2);
  const std::vector<MirrorImage> images = imagesAt(0, 0, 3);
  ASSERT_EQ(images.size(), 1u);
  EXPECT_EQ(actorsOf(images[0]), "010");
  EXPECT_NEAR(images[0].length_m, 16, 1e-9);
  const Eigen::Vector3d expected[] = {{3, 0, 0}, {-2, 0, 0}, {3, 0, 0}};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_LT((images[0].vertices[i] - expected[i]).norm(), 1e-9);
  EXPECT_NEAR(images[0].aperture, 1, 0.2);  // plates of many Fresnel zones
  EXPECT_TRUE(imagesAt(0, 0, 2).empty());
  EXPECT_TRUE(imagesAt(0, 0, 3, 15.9).empty());
}

// A radar on the bisector of two plates at 60 deg: the path closes as an equilateral triangle. The distance of the
// apex is 4 m, each plate 2 m away by its plane, and the triangle's sides 2 * 2 sin(60) = 2 sqrt(3) m... in all the
// image behind both mirrors is 2 * 4 sin(60) m away.
TEST_F(Plates, TwoAtSixtyDegreesCloseATriangle) {
  addPlate(4, 0, 4 - 2 * std::sqrt(3.0), 2);
  addPlate(4, 0, 4 - 2 * std::sqrt(3.0), -2);
  const std::vector<MirrorImage> images = imagesAt(0, 0, 2);
  ASSERT_EQ(images.size(), 2u);
  std::string both = actorsOf(images[0]) + actorsOf(images[1]);
  EXPECT_EQ(both, "0110");
  for (const MirrorImage& image : images) {
    EXPECT_NEAR(image.length_m, 8 * std::sin(M_PI / 3), 1e-9);
    // The vertices, with the radar, are an equilateral triangle.
    EXPECT_NEAR(image.vertices[0].norm(), image.length_m / 3, 1e-9);
    EXPECT_NEAR((image.vertices[0] - image.vertices[1]).norm(), image.length_m / 3, 1e-9);
  }
}

// The image in a right angle is the corner's.
TEST_F(Plates, RightAnglesMakeNone) {
  addPlate(3, -3, 3, 3);
  addPlate(0.5, 3, 3, 3);
  EXPECT_TRUE(imagesAt(0, 0, 2).empty());
}

TEST_F(Plates, AnythingInTheWayTakesThePath) {
  addPlate(3, -2, 3, 2);
  addPlate(-2, -2, -2, 2);
  ASSERT_EQ(imagesAt(0, 0, 3).size(), 1u);
  addPlate(-1, -0.1, -1, 0.1);  // between the radar and the plate behind it
  for (const MirrorImage& image : imagesAt(0, 0, 3)) EXPECT_NE(actorsOf(image), "010");
}

// Half a plate, cut where the ray meets it, gives half the field.
TEST_F(Plates, AnEdgeAtTheVertexHalvesTheAperture) {
  addPlate(3, 1e-6, 3, 3);
  addPlate(-2, -2, -2, 2);
  std::vector<MirrorImage> images = imagesAt(0, 1e-5, 3);
  ASSERT_EQ(images.size(), 1u);
  const double half = images[0].aperture;
  scene_ = Scene();
  addPlate(3, -3, 3, 3);
  addPlate(-2, -2, -2, 2);
  images = imagesAt(0, 1e-5, 3);
  ASSERT_EQ(images.size(), 1u);
  EXPECT_NEAR(half / images[0].aperture, 0.25, 0.05);  // met twice
}

}  // namespace
}  // namespace mmradartwin
