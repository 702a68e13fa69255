#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kActorMoved = "actor_moved";

/// An actor that stands elsewhere: moved, and turned about its centroid (of surface area) by Rz(dyaw) Ry(dpitch)
/// Rx(droll) in map's axes. A diagnosis tries moves in the floor plane alone.
class ActorMoved : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kActorMoved; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        textSpec("actor", true, "", "name of the actor"),
        tried(numberSpec("dx_m", "m", -100, 100, 0, "true minus twin, along map's x"), 0, 0.05),
        tried(numberSpec("dy_m", "m", -100, 100, 0, "true minus twin, along map's y"), 0, 0.05),
        tried(numberSpec("dyaw_deg", "deg", -180, 180, 0, "true minus twin, about the actor's centroid"), 0, 2),
        numberSpec("dz_m", "m", -100, 100, 0, "true minus twin, upwards"),
        numberSpec("dpitch_deg", "deg", -90, 90, 0, "the same about map's y through the centroid, before the yaw"),
        numberSpec("droll_deg", "deg", -180, 180, 0, "the same about map's x through the centroid, before the pitch")};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kActorMoved, values.text("actor"));
    shift_ = Eigen::Vector3d(values.number("dx_m"), values.number("dy_m"), values.number("dz_m"));
    const auto turn = [&](const char* key, const Eigen::Vector3d& axis) {
      return Eigen::AngleAxisd(values.number(key) * M_PI / 180, axis);
    };
    turn_ = turn("dyaw_deg", Eigen::Vector3d::UnitZ()) * turn("dpitch_deg", Eigen::Vector3d::UnitY()) *
            turn("droll_deg", Eigen::Vector3d::UnitX());
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
    moveActor(scene, actor_, Eigen::Translation3d(centroid + shift_) * turn_ * Eigen::Translation3d(-centroid));
  }

 private:
  int actor_ = -1;
  Eigen::Vector3d shift_ = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn_ = Eigen::Quaterniond::Identity();
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ActorMoved)

}  // namespace mmradartwin
