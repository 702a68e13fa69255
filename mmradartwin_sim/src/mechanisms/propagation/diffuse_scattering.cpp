#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kDiffuseScattering = "diffuse_scattering";

/// A material scatters though the twin has it smooth (or scatters otherwise than the twin says): sets the scattering
/// coefficient S in the scene, so that `diffuse` returns S and every specular reflection sqrt(1 - S^2).
class DiffuseScattering : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kDiffuseScattering; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("material", true, "", "material tag"),
            tried(numberSpec("scattering_coefficient", "1", 0, 1, "S: the share S^2 of the reflected power scatters"),
                  0, 0.4)};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    affected_ = requireMaterial(scene, kDiffuseScattering, values.text("material"));
    coefficient_ = values.number("scattering_coefficient");
    for (std::size_t i = 0; i < affected_.size(); ++i) {
      if (affected_[i] && scene.actors[i].material.model == MaterialModel::kScalar) {
        throw InputError("mechanism diffuse_scattering: key material: " + values.text("material") +
                         " is a scalar lobe material, whose scattering is its diff_back_db; change that, or use the "
                         "physical table");
      }
    }
  }
  void editScene(Scene& scene) const override {
    for (std::size_t i = 0; i < affected_.size(); ++i) {
      if (affected_[i]) scene.actors[i].material.scattering_coefficient = coefficient_;
    }
  }

 private:
  std::vector<bool> affected_;
  double coefficient_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(DiffuseScattering)

}  // namespace mmradartwin
