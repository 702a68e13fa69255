#include "mmradartwin_sim/what_if.h"

#include <functional>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;

constexpr double kWeighed = 1e-9, kMoved = 1e-6;  // of the grid's norm

/// The shipped office, with every base mechanism and some more.
class WhatIfTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    office_ = std::string(MMRADARTWIN_CONFIG) + "/office/scene.yaml";
  }
  WhatIf whatIf(const std::string& mechanisms = "  specular: {}\n  corner: {}\n  diffuse: {}\n") const {
    write("given.yaml", "scene: " + office_ + "\nmechanisms:\n" + mechanisms);
    return WhatIf(loadTwin(path("given.yaml"), std::nullopt, paperRadar()));
  }
  /// The grid is that of a twin made of the saved files.
  void expectAsMadeAnew(WhatIf& what_if, double tolerance, const std::string& what) const {
    const std::string folder = path("saved");
    std::filesystem::remove_all(folder);
    std::filesystem::create_directory(folder);
    what_if.save(folder);
    const Twin anew(loadTwin(folder + "/twin.yaml", office_, paperRadar()));
    const Simulation expected = anew.simulate(pose_);
    const Simulation& is = what_if.simulate(pose_);
    EXPECT_LT((is.grid.x - expected.grid.x).norm(), tolerance * expected.grid.x.norm()) << what;
    EXPECT_EQ(is.records.size(), expected.records.size()) << what;
    EXPECT_TRUE(is.check.ok()) << what;
  }
  double differenceToGiven(WhatIf& what_if) const {
    const Simulation given = what_if.given().simulate(pose_);
    return (what_if.simulate(pose_).grid.x - given.grid.x).norm() / given.grid.x.norm();
  }

  std::string office_;
  const Eigen::Isometry3d pose_ = radarPose(2.5, 2.2, 1, 40);
};

TEST_F(WhatIfTest, AMaterialWeighsKnownPaths) {
  WhatIf what_if = whatIf();
  what_if.simulate(pose_);
  EXPECT_EQ(what_if.work().traced, 3);
  std::set<std::pair<std::string, int>> kinds;
  for (const PathRecord& r : what_if.simulate(pose_).records) kinds.emplace(*r.event, r.bounces);
  for (const auto& kind : std::set<std::pair<std::string, int>>{
           {"corner", 2}, {"diffuse", 1}, {"specular", 1}, {"specular", 2}, {"specular", 3}}) {
    EXPECT_EQ(kinds.count(kind), 1u) << kind.first << " of " << kind.second;
  }
  what_if.setMaterial("bookshelf", "Metal");
  expectAsMadeAnew(what_if, kWeighed, "a bookshelf of metal");
  EXPECT_FALSE(what_if.work().traces());
  EXPECT_EQ(what_if.work().reflected, 3);
  EXPECT_GT(differenceToGiven(what_if), 1e-3);
  what_if.setMaterialValue("Concrete", "relative_permittivity", 9);
  expectAsMadeAnew(what_if, kWeighed, "walls of another permittivity");
  EXPECT_FALSE(what_if.work().traces());
  what_if.setMaterialValue("Concrete", "scattering_coefficient", 0.2);
  expectAsMadeAnew(what_if, kWeighed, "walls that scatter less");
  EXPECT_FALSE(what_if.work().traces());
  what_if.setActorMaterialValue("wall_north", "conductivity_s_per_m", 30);
  EXPECT_EQ(what_if.materialOf("wall_north"), "Concrete_wall_north");
  EXPECT_EQ(what_if.materialOf("wall_west"), "Concrete");
  expectAsMadeAnew(what_if, kWeighed, "one wall of another conductivity");
  EXPECT_FALSE(what_if.work().traces());
}

TEST_F(WhatIfTest, AMaterialThatBeginsToScatterIsTracedForThat) {
  WhatIf what_if = whatIf();
  what_if.simulate(pose_);
  what_if.setMaterial("cabinet_north", "Concrete");
  expectAsMadeAnew(what_if, kWeighed, "a cabinet that scatters");
  what_if.undo();
  what_if.simulate(pose_);
  EXPECT_EQ(what_if.work().traced, 1);  // scatter points alone
  EXPECT_EQ(what_if.work().reflected, 2);
}

TEST_F(WhatIfTest, WeightsAndReceiverTraceNothing) {
  WhatIf what_if = whatIf("  specular: {}\n  corner: {}\n  diffuse: {}\n  element_pattern: {cos_exponent: 1}\n");
  what_if.simulate(pose_);
  const std::vector<std::pair<std::string, std::function<void()>>> changes = {
      {"a pattern's exponent", [&] { what_if.setParameter("element_pattern", 0, "cos_exponent", 2.3); }},
      {"no pattern", [&] { what_if.switchMechanism("element_pattern", 0, false); }},
      {"a filter, still neutral", [&] { what_if.switchMechanism("if_highpass", 0, true); }},
      {"its corner", [&] { what_if.setParameter("if_highpass", 0, "corner_hz", 300e3); }},
      {"an actor's echo", [&] { what_if.switchMechanism("material_reflectivity", 0, true, "tv"); }},
      {"weaker", [&] { what_if.setParameter("material_reflectivity", 0, "delta_db", -12); }},
      {"a range bias", [&] { what_if.switchMechanism("range_bias", 0, true); }},
      {"of 4 cm", [&] { what_if.setParameter("range_bias", 0, "range_m", 0.04); }}};
  for (const auto& [what, change] : changes) {
    change();
    expectAsMadeAnew(what_if, kWeighed, what);
    EXPECT_FALSE(what_if.work().traces()) << what;
    EXPECT_EQ(what_if.work().kept, 3) << what;
  }
  EXPECT_EQ(what_if.edits().size(), changes.size());
}

TEST_F(WhatIfTest, AMovedActorIsTracedWhereItMatters) {
  WhatIf what_if = whatIf(
      "  specular: {}\n  corner: {}\n  diffuse: {}\n  edge_diffraction: {level: 1}\n"
      "  element_pattern: {cos_exponent: 1}\n");
  what_if.simulate(pose_);
  what_if.moveActor("sofa", V(0.3, -0.2, 0), 25);
  expectAsMadeAnew(what_if, kMoved, "sofa moved");
  EXPECT_GT(differenceToGiven(what_if), 1e-3);
  what_if.moveActor("cabinet_east", V(-0.4, 0, 0), 0);
  what_if.simulate(pose_);
  EXPECT_EQ(what_if.work().updated, 1);  // of scatter points those nearby
  expectAsMadeAnew(what_if, kMoved, "cabinet, too");
  what_if.hideActor("sofa", true);
  expectAsMadeAnew(what_if, kMoved, "sofa hidden");
  what_if.setMaterial("cabinet_east", "Wood");
  expectAsMadeAnew(what_if, kMoved, "another material of what was moved");
  EXPECT_FALSE(what_if.placement("cabinet_east").hidden);
  EXPECT_TRUE(what_if.placement("sofa").hidden);
  EXPECT_EQ(what_if.placement("sofa").yaw_deg, 25);
  what_if.placeRadar(0.1, -0.05, 4, 1);
  expectAsMadeAnew(what_if, kMoved, "radar turned");
  what_if.placeRadar(0, 0, 0, 0);
  what_if.hideActor("sofa", false);
  what_if.moveActor("sofa", V::Zero(), 0);
  what_if.moveActor("cabinet_east", V::Zero(), 0);
  what_if.setMaterial("cabinet_east", "Metal");
  expectAsMadeAnew(what_if, kMoved, "all back by hand");
  EXPECT_LT(differenceToGiven(what_if), kWeighed);
}

TEST_F(WhatIfTest, UndoAndRevert) {
  WhatIf what_if = whatIf();
  EXPECT_FALSE(what_if.undo());
  EXPECT_FALSE(what_if.revert());
  what_if.moveActor("tv", V(0.5, 0, 0), 0);
  for (double x : {0.1, 0.2, 0.3}) {
    what_if.continueLast();
    what_if.moveActor("bin", V(x, 0, 0), 0);
  }
  EXPECT_EQ(what_if.edits().size(), 2u);  // one drag is one change
  EXPECT_TRUE(what_if.undo());
  EXPECT_EQ(what_if.placement("bin").shift_m, V::Zero());
  EXPECT_EQ(what_if.placement("tv").shift_m, V(0.5, 0, 0));
  EXPECT_TRUE(what_if.revert());
  EXPECT_TRUE(what_if.edits().empty());
  EXPECT_EQ(differenceToGiven(what_if), 0);
  EXPECT_TRUE(what_if.undo());
  EXPECT_EQ(what_if.placement("tv").shift_m, V(0.5, 0, 0));
  EXPECT_TRUE(what_if.undo());
  EXPECT_TRUE(what_if.edits().empty());
  EXPECT_FALSE(what_if.undo());
}

TEST_F(WhatIfTest, WhatCannotBeIsRefusedAndChangesNothing) {
  WhatIf what_if = whatIf();
  EXPECT_THROW(what_if.setMaterial("nobody", "Wood"), InputError);
  EXPECT_THROW(what_if.setMaterial("tv", "Unobtainium"), InputError);
  EXPECT_THROW(what_if.setMaterialValue("Wood", "relative_permittivity", 0.5), InputError);
  EXPECT_THROW(what_if.setMaterialValue("Metal", "relative_permittivity", 3), InputError);
  EXPECT_THROW(what_if.setParameter("specular", 0, "max_bounces", 9), InputError);
  EXPECT_THROW(what_if.setParameter("element_pattern", 0, "cos_exponent", 1), InputError);
  EXPECT_THROW(what_if.switchMechanism("corner", 1, true), InputError);
  EXPECT_THROW(what_if.switchMechanism("transmission", 0, true), InputError);
  EXPECT_THROW(what_if.switchMechanism("no_such_thing", 0, true), InputError);
  EXPECT_THROW(what_if.moveActor("tv", V(NAN, 0, 0), 0), InputError);
  EXPECT_TRUE(what_if.edits().empty());
  EXPECT_EQ(differenceToGiven(what_if), 0);
  // A radar within a thing is refused at its pose alone.
  what_if.moveActor(
      "cabinet_east",
      pose_.translation() - what_if.given()
                                .scene()
                                .actors[static_cast<std::size_t>(what_if.given().scene().actorIndex("cabinet_east"))]
                                .bounds.center(),
      0);
  EXPECT_THROW(what_if.simulate(pose_), InputError);
  what_if.undo();
  EXPECT_EQ(differenceToGiven(what_if), 0);
}

TEST_F(WhatIfTest, ASavedSceneCanTakeItsMeshesAlong) {
  WhatIf what_if = whatIf();
  what_if.setMaterial("tv", "Wood");
  const std::string folder = path("copy");
  std::filesystem::create_directory(folder);
  what_if.save(folder, true);
  const Scene saved = loadScene(folder + "/scene.yaml", 77.93e9);
  EXPECT_EQ(saved.actors[static_cast<std::size_t>(saved.actorIndex("tv"))].material_tag, "Wood");
  std::ifstream text(folder + "/scene.yaml");
  const std::string all((std::istreambuf_iterator<char>(text)), {});
  EXPECT_EQ(all.find(MMRADARTWIN_CONFIG), std::string::npos) << all;
}

}  // namespace
}  // namespace mmradartwin
