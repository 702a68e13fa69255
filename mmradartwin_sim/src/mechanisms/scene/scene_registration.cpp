#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kSceneRegistration = "scene_registration";

/// The whole room stands elsewhere in map: turned about map's origin, then shifted.
class SceneRegistration : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kSceneRegistration; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("x_m", "m", -100, 100, 0, "true minus twin, along map's x"), 0, 0.03),
            tried(numberSpec("y_m", "m", -100, 100, 0, "true minus twin, along map's y"), 0, 0.03),
            tried(numberSpec("yaw_deg", "deg", -180, 180, 0, "true minus twin, about map's origin"), 0, 0.5)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    T_ = Eigen::Translation3d(values.number("x_m"), values.number("y_m"), 0) *
         Eigen::AngleAxisd(values.number("yaw_deg") * M_PI / 180, Eigen::Vector3d::UnitZ());
  }
  int rank() const override { return 2; }  // after mechanisms that place actors in the twin's room, and its scale
  void editScene(Scene& scene) const override {
    for (std::size_t i = 0; i < scene.actors.size(); ++i) moveActor(scene, static_cast<int>(i), T_);
    for (Actor& screen : scene.occluders_only) {
      for (auto& v : screen.vertices) v = T_ * v;
    }
  }

 private:
  Eigen::Isometry3d T_ = Eigen::Isometry3d::Identity();
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(SceneRegistration)

}  // namespace mmradartwin
