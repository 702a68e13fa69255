#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kPoseTimeLag = "pose_time_lag";

/// Poses are stamped later than they were true: while the radar moves it is ahead of its reported pose by what it goes
/// within the lag. A standing radar shows nothing of it, and averaged poses are of standing radars: no hypothesis about
/// paths; frames on the way tell it.
class PoseTimeLag : public Mechanism, public MountingStage {
 public:
  const std::string& name() const override { return kPoseTimeLag; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("lag_s", "s", -10, 10, "positive: poses are stamped later than the truth")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    lag_s_ = values.number("lag_s");
  }
  double poseLag_s() const override { return lag_s_; }

 private:
  double lag_s_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(PoseTimeLag)

}  // namespace mmradartwin
