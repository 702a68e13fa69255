#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kRangeScale = "range_scale";

/// Slope or sampling rate off: beat frequencies scale, phases across the channels stay.
class RangeScale : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kRangeScale; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("scale", "1", -0.5, 0.5, "epsilon of range x (1 + epsilon)"), 0, 0.005)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    scale_ = values.number("scale");
  }
  int rank() const override { return 1; }  // after a bias, which the wrong slope scales too
  void reweight(const PoseContext& context, PathRecord& record) const override {
    for (double& length : record.length_m) length *= 1 + scale_;
    record.range_bin = rangeBin(context.radar, record.length_m[0]);
  }

 private:
  double scale_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(RangeScale)

}  // namespace mmradartwin
