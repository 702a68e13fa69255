#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kActorAbsent = "actor_absent";

/// An actor of the scene that is not in the room: it neither reflects nor hides anything.
class ActorAbsent : public Mechanism, public SceneStage {
 public:
  const std::string& name() const override { return kActorAbsent; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override { return {textSpec("actor", true, "", "name of the actor")}; }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kActorAbsent, values.text("actor"));
  }
  void editScene(Scene& scene) const override { removeActor(scene, actor_); }

 private:
  int actor_ = -1;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ActorAbsent)

}  // namespace mmradartwin
