#include "mechanisms/base/builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "actor_absent";

/// An actor of the scene that is not in the room: it neither reflects nor hides anything.
class ActorAbsent : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override { return {textSpec("actor", true, "", "name of the actor")}; }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kName, values.text("actor"));
  }
  void editScene(Scene& scene) const override { removeActor(scene, actor_); }

 private:
  int actor_ = -1;
};

}  // namespace

std::unique_ptr<Mechanism> makeActorAbsent() { return std::make_unique<ActorAbsent>(); }

}  // namespace mmradartwin
