#include <algorithm>
#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kEchoReplica = "echo_replica";

/// Every echo once more at a fixed distance behind (or before) itself: a reflection inside a radome or a cable, paired
/// echoes of a modulated chirp, the far face of a panel. Direction, actors and channels are the echo's.
class EchoReplica : public Mechanism, public ReplicaStage {
 public:
  const std::string& name() const override { return kEchoReplica; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {weighing(numberSpec("behind_m", "m", -50, 50, "one-way range of the replica less that of its echo")),
            weighing(numberSpec("level_db", "dB", -200, 20, "of the replica against its echo")),
            weighing(textSpec("actor", false, "", "only of paths that meet this actor"))};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    extra_m_ = 2 * values.number("behind_m");
    level_ = std::pow(10.0, values.number("level_db") / 20);
    const std::string& actor = values.text("actor");
    actor_ = actor.empty() ? -1 : requireActor(scene, kEchoReplica, actor);
  }
  bool replicate(const PoseContext& context, PathRecord& record) const override {
    if (actor_ >= 0 && std::count(record.actors.begin(), record.actors.end(), actor_) == 0) return false;
    const double length_m = record.length_m[0] + extra_m_;
    if (length_m <= 0 || length_m > 2 * context.max_range_m) return false;
    record.event = &kEchoReplica;
    scaleRecord(level_, record);
    lengthen(context.radar, extra_m_, record);
    return true;
  }

 private:
  double extra_m_ = 0, level_ = 0;
  int actor_ = -1;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EchoReplica)

}  // namespace mmradartwin
