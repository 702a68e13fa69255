#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kSurfaceRoughness = "surface_roughness";

/// Loss of the coherent reflection by roughness (Rayleigh, Ament): exp(-2 (k sigma cos theta)^2) of amplitude at every
/// specular reflection from the material. Scattered returns stay; roughness_rms_m of materials.yaml takes no part in
/// the base model.
class SurfaceRoughness : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kSurfaceRoughness; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("material", true, "", "material tag"),
            tried(numberSpec("roughness_rms_m", "m", 0, 0.01, "rms height of the surface"), 0, 0.0003)};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    rough_ = requireMaterial(scene, kSurfaceRoughness, values.text("material"));
    roughness_rms_m_ = values.number("roughness_rms_m");
  }
  void reweight(const PoseContext& context, PathRecord& record) const override {
    double factor = 1;
    for (std::size_t i = 0; i < record.reflection_cosine.size(); ++i) {
      const double cosine = record.reflection_cosine[i];
      if (cosine < 0 || record.actors[i] < 0 || !rough_[record.actors[i]]) continue;
      factor *= roughnessLoss(roughness_rms_m_, cosine, context.frequency_hz);
    }
    if (factor != 1) scaleRecord(factor, record);
  }

 private:
  std::vector<bool> rough_;
  double roughness_rms_m_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(SurfaceRoughness)

}  // namespace mmradartwin
