#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kExcessAttenuation = "excess_attenuation";

/// Loss that grows with the way: dB of power per metre of one-way range, on every path.
class ExcessAttenuation : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kExcessAttenuation; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("db_per_m", "dB/m", -20, 20, "loss of power per metre of one-way range, positive is a loss"),
              0, 0.5)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    db_per_m_ = values.number("db_per_m");
  }
  void reweight(const PoseContext&, PathRecord& record) const override {
    // Coupling inside the radar (no interaction at all) has no way through the room.
    if (record.bounces > 0) scaleRecord(std::pow(10.0, -db_per_m_ * 0.5 * record.length_m[0] / 20), record);
  }
  int rank() const override { return -1; }  // the way is the geometry's, before delays of the radar lengthen it

 private:
  double db_per_m_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ExcessAttenuation)

}  // namespace mmradartwin
