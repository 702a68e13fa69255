#include "mmradartwin_sim/pose_placement.h"

#include <gtest/gtest.h>

#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class PosePlacement : public SceneFiles {
 protected:
  static V unturned(const V& p) { return p; }
  static V yUp(const V& p) { return {p.x(), p.z(), -p.y()}; }

  /// A furnished room of 6 x 5 x 2.7 m in a corner of the map, in the coordinates of a file.
  std::string room(const std::string& material, double units_per_m, V (*turn)(const V&) = unturned,
                   const V& origin = V::Zero()) {
    const auto sheet = [&](const std::string& name, const V& corner, const V& a, const V& b) {
      addRectangle(name, material, units_per_m * turn(corner + origin), units_per_m * turn(a), units_per_m * turn(b));
    };
    sheet("west", {0, 0, 0}, {0, 5, 0}, {0, 0, 2.7});
    sheet("east", {6, 0, 0}, {0, 5, 0}, {0, 0, 2.7});
    sheet("south", {0, 0, 0}, {6, 0, 0}, {0, 0, 2.7});
    sheet("north", {0, 5, 0}, {6, 0, 0}, {0, 0, 2.7});
    sheet("floor", {0, 0, 0}, {6, 0, 0}, {0, 5, 0});
    sheet("cupboard", {4, 1, 0}, {0, 1, 0}, {0, 0, 2});
    return writeScene();
  }

  static std::vector<Pose> poses(double scale = 1, const V& origin = V::Zero()) {
    std::vector<Pose> list;
    for (const auto& [x, y, yaw_deg] : std::vector<std::array<double, 3>>{{2, 2, 0}, {3, 3.5, 90}, {1.5, 4, 180}}) {
      Pose pose;
      pose.name = std::to_string(list.size());
      pose.T_map_radar = radarPose(scale * x + origin.x(), scale * y + origin.y(), scale * 1 + origin.z(), yaw_deg);
      list.push_back(pose);
    }
    return list;
  }

  std::string refusal(const std::string& scene, const std::vector<Pose>& at) const {
    return errorOf([&] { placedTwin(loadTwin("", scene, paperRadar()), at, "poses.csv"); });
  }
};

TEST_F(PosePlacement, TakesWhatFits) { EXPECT_EQ(refusal(room("Metal", 1), poses()), ""); }

TEST_F(PosePlacement, TakesARadarInFrontOfASheet) {
  addRectangle("sheet", "Metal", {3, -0.5, 0.6}, {0, 1, 0}, {0, 0, 0.8});
  Pose pose;
  pose.T_map_radar = radarPose(0, 0, 1);
  EXPECT_EQ(refusal(writeScene(), {pose}), "");
}

TEST_F(PosePlacement, NamesTheUnitOfAScene) {
  for (const auto& [per_m, unit] : std::vector<std::pair<double, std::string>>{{1000, "mm"}, {100, "cm"}}) {
    // A rough scene of that size has too many scatter points for a twin.
    for (const std::string material : {"Metal", "RoughConcrete"}) {
      const std::string error = refusal(room(material, per_m), poses());
      EXPECT_TRUE(contains(error, "poses.csv: the scene is ")) << error;
      EXPECT_TRUE(contains(error, "unit: " + unit)) << error;
      EXPECT_FALSE(contains(error, "up: y")) << error;
      EXPECT_FALSE(contains(error, "spacing")) << error;
      const std::string turned = refusal(room(material, per_m, yUp), poses());
      EXPECT_TRUE(contains(turned, "unit: " + unit)) << turned;
      EXPECT_TRUE(contains(turned, "up: y")) << turned;
    }
  }
  addRectangle("sheet", "Metal", {3000, -500, 600}, {0, 1000, 0}, {0, 0, 800});
  Pose pose;
  pose.T_map_radar = radarPose(0, 0, 1);
  const std::string sheet = refusal(writeScene(), {pose});
  EXPECT_TRUE(contains(sheet, "unit: mm")) << sheet;
}

TEST_F(PosePlacement, NamesASceneWithYUp) {
  const std::string error = refusal(room("Metal", 1, yUp), poses());
  EXPECT_TRUE(contains(error, "the twin has no echo at any pose")) << error;
  EXPECT_TRUE(contains(error, "up: y")) << error;
  EXPECT_FALSE(contains(error, "unit:")) << error;
}

TEST_F(PosePlacement, NamesTheUnitOfPoses) {
  const std::string millimetres = refusal(room("Metal", 1), poses(1000));
  EXPECT_TRUE(contains(millimetres, "poses.csv: pose '0' stands ")) << millimetres;
  EXPECT_TRUE(contains(millimetres, "the poses are in mm")) << millimetres;
  const std::string centimetres = refusal(room("Metal", 1), poses(100));
  EXPECT_TRUE(contains(centimetres, "the poses are in cm")) << centimetres;
}

TEST_F(PosePlacement, NamesAnOriginToTakeOff) {
  const std::string scene = refusal(room("Metal", 1, unturned, {4512, 3110, 0}), poses());
  EXPECT_TRUE(contains(scene, "origin: [4500, 3100, 0]")) << scene;
  const std::string of_poses = refusal(room("Metal", 1), poses(1, {4512, 3110, 0}));
  EXPECT_TRUE(contains(of_poses, "take the map's origin off x, y and z of the poses")) << of_poses;
}

TEST_F(PosePlacement, RefusesARadarThatSeesNothing) {
  addRectangle("sheet", "Metal", {3, -0.5, 0.6}, {0, 1, 0}, {0, 0, 0.8});
  Pose away;
  away.T_map_radar = radarPose(0, 0, 1, 180);
  const std::string error = refusal(writeScene(), {away});
  EXPECT_TRUE(contains(error, "poses.csv: the twin has no echo at any pose")) << error;
  EXPECT_TRUE(contains(error, "where the radar looks")) << error;
}

TEST_F(PosePlacement, GuessesNoUnitForARadarOutside) {
  for (const double away_m : {25.0, 90.0, 150.0}) {
    const std::string error = refusal(room("Metal", 1), poses(1, {away_m, 0, 0}));
    EXPECT_TRUE(contains(error, "m outside the scene")) << error;
    EXPECT_TRUE(contains(error, "check units, axes and origin")) << error;
  }
}

TEST_F(PosePlacement, NamesASceneInKilometres) {
  const std::string error = refusal(room("Metal", 0.001), poses());
  EXPECT_TRUE(contains(error, "the scene is in km")) << error;
}

TEST_F(PosePlacement, LeavesLargeHallsAlone) {
  addRectangle("wall", "Metal", {3, -200, 0}, {0, 400, 0}, {0, 0, 110});
  addRectangle("floor", "Metal", {-200, -200, 0}, {400, 0, 0}, {0, 400, 0});
  Pose pose;
  pose.T_map_radar = radarPose(0, 0, 1);
  EXPECT_EQ(refusal(writeScene(), {pose}), "");
}

}  // namespace
}  // namespace mmradartwin
