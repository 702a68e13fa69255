#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kPhaseDrift = "phase_drift";

/// Every frame is turned against the one before by the same angle, so that their average loses.
class PhaseDrift : public Mechanism, public ChirpStage {
 public:
  const std::string& name() const override { return kPhaseDrift; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("rad_per_frame", "rad", -3.2, 3.2, "turn from one frame to the next")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    rad_per_frame_ = values.number("rad_per_frame");
  }
  void changeChirp(const ChirpContext& now, ComplexGrid& x) const override {
    x *= std::polar(1.0, rad_per_frame_ * now.frame);
  }

 private:
  double rad_per_frame_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(PhaseDrift)

}  // namespace mmradartwin
