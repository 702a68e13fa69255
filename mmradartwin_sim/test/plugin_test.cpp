#include "mmradartwin_sim/plugin.h"

#include <cstdlib>

#include "scene_files.h"

namespace mmradartwin {
namespace {

// One process, one registry: what a test loads stays, so that errors come before success here.
class PluginTest : public SceneFiles {
 protected:
  void TearDown() override {
    unsetenv("MMRADARTWIN_PLUGINS");
    SceneFiles::TearDown();
  }
  double level(const std::string& scene, const std::string& more) {
    return makeTwin(scene, "  specular: {}\n" + more).simulate(radarPose(0, 0, 0)).records.at(0).amplitude;
  }
};

TEST_F(PluginTest, NamesWhatCannotBeLoaded) {
  const std::string missing = errorOf([] { loadMechanismPlugins("/nowhere/libcurtain.so", "--plugins"); });
  EXPECT_EQ(missing.find("--plugins: plug-in /nowhere/libcurtain.so cannot be loaded"), 0u) << missing;
  EXPECT_EQ(missing.find('\n'), std::string::npos);
  write("text.so", "no library at all\n");
  EXPECT_NE(errorOf([&] { loadMechanismPlugins(path("text.so"), "x"); }).find("text.so cannot be loaded"),
            std::string::npos);
  const std::string wrong = errorOf([] { loadMechanismPlugins(MMRADARTWIN_EMPTY_PLUGIN, "x"); });
  EXPECT_NE(wrong.find("brings no mechanism"), std::string::npos) << wrong;
  const std::string clash = errorOf([] { loadMechanismPlugins(MMRADARTWIN_CLASHING_PLUGIN, "x"); });
  EXPECT_NE(clash.find("mechanism specular is known already"), std::string::npos) << clash;
}

TEST_F(PluginTest, AddsAMechanismToTwins) {
  addWall("wall", "Metal", {3, -3}, {3, 3});
  const std::string scene = writeScene();
  const std::string curtain = "  paper_curtain: {loss_db: 7}\n";
  EXPECT_NE(errorOf([&] { level(scene, curtain); }).find("unknown mechanism paper_curtain"), std::string::npos);
  setenv("MMRADARTWIN_PLUGINS", MMRADARTWIN_PLUGIN ":" MMRADARTWIN_PLUGIN, 1);
  EXPECT_NEAR(db(level(scene, curtain) / level(scene, "")), -7, 1e-9);
  EXPECT_NE(errorOf([&] { level(scene, "  paper_curtain: {loss_db: 41}\n"); }).find("loss_db"), std::string::npos);
  // Again by another way: loaded already, nothing clashes.
  EXPECT_EQ(errorOf([] { loadMechanismPlugins(MMRADARTWIN_PLUGIN, "--plugins"); }), "");
}

}  // namespace
}  // namespace mmradartwin
