#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kTransmission = "transmission";

/// A panel that lets rays through, one_way_db at each crossing; its own front still reflects as before, its own back
/// stays hidden. One leg of a path crosses it once, however thick its mesh. The delay inside is left out: (n - 1) d is
/// millimetres.
class Transmission : public Mechanism, public SceneStage, public WeightStage {
 public:
  const std::string& name() const override { return kTransmission; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("actor", true, "", "name of the actor"),
            weighing(tried(numberSpec("one_way_db", "dB", -200, 0, "level of one crossing, negative"), -200, -5))};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kTransmission, values.text("actor"));
    once_ = std::pow(10.0, values.number("one_way_db") / 20);
  }
  void editScene(Scene& scene) const override { scene.actors[actor_].occludes = false; }
  void build(const Scene& scene, const RadarConfig&) override {
    Scene alone;
    alone.actors = {scene.actors[actor_]};
    alone.actors.front().occludes = true;
    panel_ = std::make_unique<RayCaster>(alone);
  }
  void reweight(const PoseContext& context, PathRecord& record) const override {
    if (record.vertices.empty()) return;
    Eigen::Vector3d from = context.T_map_radar.translation();
    const Eigen::Vector3d radar = from;
    int crossings = 0;
    if (record.vertices.size() == 1) {
      crossings = crosses(radar, record.vertices.front()) ? 2 : 0;  // out and back on one line
    } else {
      for (const Eigen::Vector3d& v : record.vertices) {
        crossings += crosses(from, v);
        from = v;
      }
      crossings += crosses(from, radar);
    }
    if (crossings > 0) scaleRecord(std::pow(once_, crossings), record);
  }

 private:
  bool crosses(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
    return (b - a).norm() > 3e-3 && !panel_->visible(a, b, 1e-3);
  }
  int actor_ = -1;
  double once_ = 1;
  std::unique_ptr<RayCaster> panel_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Transmission)

}  // namespace mmradartwin
