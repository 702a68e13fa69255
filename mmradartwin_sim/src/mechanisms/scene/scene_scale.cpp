#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kSceneScale = "scene_scale";

/// The whole room is larger or smaller than its scan, about map's origin; the radar's poses stay.
class SceneScale : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kSceneScale; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("scale", "1", -0.5, 0.5, "epsilon of the true scene = the twin's x (1 + epsilon)"), 0, 0.005)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    scale_ = values.number("scale");
  }
  int rank() const override { return 1; }  // after mechanisms that place actors in the twin's room
  void editScene(Scene& scene) const override { scaleScene(scene, 1 + scale_); }

 private:
  double scale_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(SceneScale)

}  // namespace mmradartwin
