#include "mmradartwin_attribution/response_region.h"

#include <gtest/gtest.h>

#include <random>

#include "fresnel_aperture.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

using synthetic::kDegree;

// A room of 6 x 4 x 2.8 m, corner at the origin, walls named by compass with north along +y.
class RoomTest : public ::testing::Test {
 protected:
  void addQuad(const std::string& actor, const Eigen::Vector3d& o, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    int index = scene_.actorIndex(actor);
    if (index < 0) {
      index = static_cast<int>(scene_.actors.size());
      Actor added;
      added.name = actor;
      added.material_tag = "Concrete";
      scene_.actors.push_back(added);
    }
    Actor& target = scene_.actors[index];
    const int first = static_cast<int>(target.vertices.size());
    for (const Eigen::Vector3d& v : {o, Eigen::Vector3d(o + a), Eigen::Vector3d(o + a + b), Eigen::Vector3d(o + b)}) {
      target.vertices.push_back(v);
      target.bounds.extend(v);
    }
    target.triangles.push_back({first, first + 1, first + 2});
    target.triangles.push_back({first, first + 2, first + 3});
  }

  void addBox(const std::string& actor, const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
    const Eigen::Vector3d s = max - min, x(s.x(), 0, 0), y(0, s.y(), 0), z(0, 0, s.z());
    addQuad(actor, min, y, z);
    addQuad(actor, min + x, y, z);
    addQuad(actor, min, x, z);
    addQuad(actor, min + y, x, z);
    addQuad(actor, min, x, y);
    addQuad(actor, min + z, x, y);
  }

  void SetUp() override {
    addQuad("east", {6, 0, 0}, {0, 4, 0}, {0, 0, 2.8});
    addQuad("west", {0, 0, 0}, {0, 4, 0}, {0, 0, 2.8});
    addQuad("north", {0, 4, 0}, {6, 0, 0}, {0, 0, 2.8});
    addQuad("south", {0, 0, 0}, {6, 0, 0}, {0, 0, 2.8});
    addQuad("floor", {0, 0, 0}, {6, 0, 0}, {0, 4, 0});
    addQuad("ceiling", {0, 0, 2.8}, {6, 0, 0}, {0, 4, 0});
  }

  std::vector<ResponseRegion> regionsAt(double x, double y, double heading_deg) {
    rebuildFacets(scene_);
    rays_ = std::make_unique<RayCaster>(scene_);
    model_ = std::make_unique<RegionModel>(scene_, *rays_, field_, radar_);
    return model_->regions(pose(x, y, heading_deg));
  }

  static Eigen::Isometry3d pose(double x, double y, double heading_deg) {
    return Eigen::Translation3d(x, y, 1.0) * Eigen::AngleAxisd(heading_deg * kDegree, Eigen::Vector3d::UnitZ());
  }

  static const ResponseRegion* find(const std::vector<ResponseRegion>& regions, RegionKind kind, double range_m,
                                    double azimuth_deg) {
    for (const ResponseRegion& r : regions) {
      if (r.kind == kind && std::abs(r.range_m - range_m) < 0.02 &&
          std::abs(r.azimuth_rad / kDegree - azimuth_deg) < 0.3) {
        return &r;
      }
    }
    return nullptr;
  }

  static int count(const std::vector<ResponseRegion>& regions, RegionKind kind) {
    return static_cast<int>(
        std::count_if(regions.begin(), regions.end(), [kind](const ResponseRegion& r) { return r.kind == kind; }));
  }

  RadarConfig radar_ = paperRadar();
  EvaluationField field_{AttributionConfig(), radar_, SignalChain(radar_).axes()};
  Scene scene_;
  std::unique_ptr<RayCaster> rays_;
  std::unique_ptr<RegionModel> model_;
};

TEST_F(RoomTest, FeetAndCornersOfAnEmptyRoom) {
  const auto regions = regionsAt(2, 2, 0);
  const ResponseRegion* east = find(regions, RegionKind::kFacing, 4, 0);
  ASSERT_NE(east, nullptr);
  EXPECT_EQ(east->actor, "east");
  EXPECT_EQ(east->material, "Concrete");
  EXPECT_LT((east->point - Eigen::Vector3d(6, 2, 1)).norm(), 1e-6);
  const ResponseRegion* corner = find(regions, RegionKind::kCorner, std::sqrt(20.0), 26.565);
  ASSERT_NE(corner, nullptr);
  EXPECT_EQ(corner->actor, "east;north");
  ASSERT_NE(find(regions, RegionKind::kCorner, std::sqrt(20.0), -26.565), nullptr);
  EXPECT_EQ(count(regions, RegionKind::kFacing), 1) << "the feet of north and south lie at +-90 deg, west is behind";
  EXPECT_EQ(count(regions, RegionKind::kCorner), 2);
  for (const ResponseRegion& r : regions) {
    EXPECT_EQ(r.actor.find("floor"), std::string::npos) << "floor and ceiling only occlude";
    EXPECT_EQ(r.actor.find("ceiling"), std::string::npos);
  }
}

// A closed plate of any thickness is its front; a copy of it changes nothing.
TEST_F(RoomTest, NothingWithinAThinBodyIsARegion) {
  for (double t_mm : {0.5, 2.0, 5.0, 9.0}) {
    const std::size_t room = scene_.actors.size();
    for (const std::string& name : {"plate", "plate_001"}) {
      addBox(name, {4, 1.5, 0.6}, {4 + t_mm * 1e-3, 2.5, 1.4});
      const auto regions = regionsAt(2, 2, 0);
      int of_plate = 0;
      for (const ResponseRegion& r : regions) {
        if (r.actor.find("plate") == std::string::npos || r.kind == RegionKind::kExtent) continue;
        ++of_plate;
        EXPECT_TRUE(r.kind == RegionKind::kFacing || r.kind == RegionKind::kImage) << t_mm << " mm";
        EXPECT_EQ(r.actor.find("plate_001"), std::string::npos) << t_mm << " mm";
        if (r.kind == RegionKind::kImage) {
          EXPECT_NE(r.actor.find(';'), std::string::npos) << t_mm << " mm: no mirrors face each other in a plate";
        } else {
          EXPECT_NEAR(r.range_m, 2, 1e-9);
        }
      }
      EXPECT_GE(of_plate, 1) << t_mm << " mm";
    }
    scene_.actors.resize(room);
  }
}

TEST_F(RoomTest, TheHeadingTurnsRegions) {
  const auto regions = regionsAt(2, 2, 45);
  EXPECT_NE(find(regions, RegionKind::kFacing, 4, -45), nullptr);
  EXPECT_NE(find(regions, RegionKind::kFacing, 2, 45), nullptr);
  EXPECT_NE(find(regions, RegionKind::kCorner, std::sqrt(20.0), 26.565 - 45), nullptr);
  const ResponseRegion* outer = find(regions, RegionKind::kCorner, std::sqrt(20.0), -26.565 - 45);
  ASSERT_NE(outer, nullptr);
  EXPECT_EQ(outer->field, Field::kOuter);
}

TEST_F(RoomTest, AWallFacesTheRadarInAMirror) {
  // East, west, east: 3 m to the one wall, 6 m to the other and both ways back, 18 m in all.
  const auto regions = regionsAt(3, 2, 0);
  const ResponseRegion* image = find(regions, RegionKind::kImage, 9, 0);
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->actor, "east;west");
  EXPECT_NEAR(image->support_db, 20 * std::log10(radar_.wavelength_m() / (8 * M_PI * 9)), 1.5) << "three large mirrors";
  AttributionConfig config;
  config.regions.image_order = 1;
  const EvaluationField field(config, radar_, SignalChain(radar_).axes());
  EXPECT_EQ(count(RegionModel(scene_, *rays_, field, radar_).regions(pose(3, 2, 0)), RegionKind::kImage), 0);
}

// Two plates meet at 60 deg, 4 m ahead of a radar that looks along their bisector. A path over both leaves at +30 and
// comes back at -30 deg, or the other way round: an equilateral triangle with sides of 4 tan(30) = 2.31 m. Over TX 0
// and 4 d the two add up to 2 cos(pi k/2) at element k, which steers to sin = +-1/2 alike.
TEST_F(RoomTest, PathsThatDepartAndArriveApartLieWhereTheArrayHasTheirLobes) {
  addQuad("left", {5, 2, 0}, {-1.6 * std::sqrt(3.0), 1.6, 0}, {0, 0, 2.5});
  addQuad("right", {5, 2, 0}, {-1.6 * std::sqrt(3.0), -1.6, 0}, {0, 0, 2.5});
  const auto regions = regionsAt(1, 2, 0);
  const double pitch = radar_.virtual_pitch_m() / radar_.wavelength_m() * 2;  // 1 at the ramp's start
  int lobes = 0;
  for (const ResponseRegion& r : regions) {
    if (r.kind != RegionKind::kImage || std::abs(r.range_m - 2 * std::sqrt(3.0)) > 0.01) continue;
    ++lobes;
    EXPECT_NEAR(std::abs(std::sin(r.azimuth_rad)), 0.5, 0.5 * std::abs(pitch - 1) + 0.01);
    EXPECT_TRUE(r.actor == "left;right" || r.actor == "right;left") << r.actor;
  }
  EXPECT_EQ(lobes, 2);
}

TEST_F(RoomTest, AnObjectHidesWhatIsBehindAndFacesTheRadar) {
  addBox("cabinet", {4.5, 1.5, 0.01}, {5.0, 2.5, 2.0});
  const auto regions = regionsAt(2, 2, 0);
  const ResponseRegion* cabinet = find(regions, RegionKind::kFacing, 2.5, 0);
  ASSERT_NE(cabinet, nullptr);
  EXPECT_EQ(cabinet->actor, "cabinet");
  EXPECT_EQ(find(regions, RegionKind::kFacing, 4, 0), nullptr) << "the wall's foot is hidden";
  for (const ResponseRegion& r : regions) {
    if (r.kind == RegionKind::kCorner) {
      EXPECT_EQ(r.actor.find("cabinet"), std::string::npos) << "convex edges are none";
    }
  }
  EXPECT_NE(find(regions, RegionKind::kCorner, std::sqrt(20.0), 26.565), nullptr);
}

TEST_F(RoomTest, AnObjectAgainstTheMiddleOfAWallMakesTwoCorners) {
  addBox("cabinet", {5.5, 1.6, 0.01}, {6.0, 2.4, 2.0});
  const auto regions = regionsAt(1, 2, 0);
  // Beside its front (4.5 m ahead) the cabinet's sides are hidden from here; from the side one is seen.
  for (const ResponseRegion& r : regions) {
    if (r.kind == RegionKind::kCorner) {
      EXPECT_EQ(r.actor.find("cabinet"), std::string::npos);
    }
  }
  const auto beside = regionsAt(4, 3.4, 0);
  const ResponseRegion* corner = find(beside, RegionKind::kCorner, std::hypot(2, 1), std::atan2(-1, 2) / kDegree);
  ASSERT_NE(corner, nullptr);
  EXPECT_NE(corner->actor.find("cabinet"), std::string::npos);
  EXPECT_NE(corner->actor.find("east"), std::string::npos);
}

TEST_F(RoomTest, ASmallObjectTurnedAwayHasItsNearestVisiblePoint) {
  // A thin post, turned by 45 deg: no face looks at the radar, its edge is nearest, at 3 m.
  const double h = 0.2;
  addQuad("post", {5 - 0.0, 2, 0.01}, {h, h, 0}, {0, 0, 2});
  addQuad("post", {5 - 0.0, 2, 0.01}, {h, -h, 0}, {0, 0, 2});
  addQuad("post", {5 + h, 2 + h, 0.01}, {h, -h, 0}, {0, 0, 2});
  addQuad("post", {5 + h, 2 - h, 0.01}, {h, h, 0}, {0, 0, 2});
  const auto regions = regionsAt(2, 2, 0);
  int found = 0;
  for (const ResponseRegion& r : regions) {
    if (r.actor != "post") continue;
    ++found;
    EXPECT_TRUE(r.kind == RegionKind::kExtent || r.kind == RegionKind::kEdge);
    EXPECT_NEAR(r.range_m, 3.0, 0.2);
    EXPECT_NEAR(r.azimuth_rad / kDegree, 0, 2);
  }
  EXPECT_EQ(found, 1);
}

TEST_F(RoomTest, NoTwoRegionsOfOneActorShareACell) {
  addBox("cabinet", {4.5, 0.3, 0.01}, {5.2, 1.1, 1.8});
  addBox("desk", {1.0, 3.0, 0.01}, {2.5, 3.6, 0.75});
  regionsAt(2, 2, 0);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0.4, 4.2), y(1.3, 2.8), heading(-180, 180);
  const double sine_bin = radar_.wavelength_m() / (2 * radar_.virtual_pitch_m()) / 32;
  int checked = 0;
  for (int i = 0; i < 200; ++i) {
    const auto regions = model_->regions(pose(x(random), y(random), heading(random)));
    for (std::size_t a = 0; a < regions.size(); ++a) {
      for (std::size_t b = a + 1; b < regions.size(); ++b) {
        if (regions[a].actors != regions[b].actors) continue;
        ++checked;
        EXPECT_TRUE(std::abs(regions[a].range_m - regions[b].range_m) > radar_.range_bin_m() ||
                    std::abs(std::sin(regions[a].azimuth_rad) - std::sin(regions[b].azimuth_rad)) > sine_bin);
      }
    }
  }
  EXPECT_GT(checked, 0);
}

TEST(FresnelAperture, LimitsOfTheClosedForm) {
  EXPECT_NEAR(fresnelAperture(-100, 100), 1, 0.01) << "an unbounded plane";
  EXPECT_NEAR(fresnelAperture(0, 100), 0.5, 0.005) << "a half plane, on its edge: -6 dB";
  EXPECT_NEAR(fresnelAperture(-0.05, 0.05), 0.1 / std::sqrt(2.0), 2e-3) << "small: its width in u over sqrt 2";
  EXPECT_LT(fresnelAperture(5, 10), 0.1);
}

}  // namespace
}  // namespace mmradartwin
