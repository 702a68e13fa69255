#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kMaterialReflectivity = "material_reflectivity";

/// A material's or an actor's echo stronger or weaker, at every interaction with it.
class MaterialReflectivity : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kMaterialReflectivity; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("material", false, "", "material tag; give this or actor"),
            textSpec("actor", false, "", "actor; give this or material"),
            tried(numberSpec("delta_db", "dB", -200, 60, "echo, measured minus twin"), 0, -3)};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    const std::string& material = values.text("material");
    const std::string& actor = values.text("actor");
    if (material.empty() == actor.empty()) {
      throw InputError("mechanism material_reflectivity: give exactly one of material and actor");
    }
    factor_ = std::pow(10.0, values.number("delta_db") / 20);
    affected_.assign(scene.actors.size(), false);
    if (!actor.empty()) {
      affected_[requireActor(scene, kMaterialReflectivity, actor)] = true;
      return;
    }
    bool any = false;
    for (std::size_t i = 0; i < scene.actors.size(); ++i) {
      affected_[i] = scene.actors[i].material_tag == material;
      any = any || affected_[i];
    }
    if (!any)
      throw InputError("mechanism material_reflectivity: key material: no actor of " + scene.file + " is of " +
                       material);
  }
  void reweight(const PoseContext&, PathRecord& record) const override {
    double factor = 1;
    for (int actor : record.actors) {
      if (actor >= 0 && affected_[actor]) factor *= factor_;
    }
    if (factor != 1) scaleRecord(factor, record);
  }

 private:
  double factor_ = 1;
  std::vector<bool> affected_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(MaterialReflectivity)

}  // namespace mmradartwin
