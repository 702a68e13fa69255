#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kName = "actor_moved";

/// An actor that stands elsewhere: moved in the floor plane and turned about its centroid (of surface area).
class ActorMoved : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kName; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("actor", true, "", "name of the actor"),
            tried(numberSpec("dx_m", "m", -100, 100, 0, "true minus twin, along map's x"), 0, 0.05),
            tried(numberSpec("dy_m", "m", -100, 100, 0, "true minus twin, along map's y"), 0, 0.05),
            tried(numberSpec("dyaw_deg", "deg", -180, 180, 0, "true minus twin, about the actor's centroid"), 0, 2)};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kName, values.text("actor"));
    shift_ = Eigen::Vector3d(values.number("dx_m"), values.number("dy_m"), 0);
    yaw_rad_ = values.number("dyaw_deg") * M_PI / 180;
  }
  void editScene(Scene& scene) const override {
    const Actor& actor = scene.actors[actor_];
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    double area = 0;
    for (const auto& t : actor.triangles) {
      const Eigen::Vector3d &a = actor.vertices[t[0]], &b = actor.vertices[t[1]], &c = actor.vertices[t[2]];
      const double weight = (b - a).cross(c - a).norm();
      centroid += weight * (a + b + c) / 3;
      area += weight;
    }
    centroid /= area;
    moveActor(scene, actor_,
              Eigen::Translation3d(centroid + shift_) * Eigen::AngleAxisd(yaw_rad_, Eigen::Vector3d::UnitZ()) *
                  Eigen::Translation3d(-centroid));
  }

 private:
  int actor_ = -1;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
  double yaw_rad_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ActorMoved)

}  // namespace mmradartwin
