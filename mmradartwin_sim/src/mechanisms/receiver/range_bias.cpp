#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kRangeBias = "range_bias";

/// A delay inside the radar: every path is longer by twice the bias, the same at all channels.
class RangeBias : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kRangeBias; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("range_m", "m", -5, 5, "added to every one-way range"), 0, 0.02)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    range_m_ = values.number("range_m");
  }
  void reweight(const PoseContext& context, PathRecord& record) const override {
    lengthen(context.radar, delay_m(), record);
  }
  double delay_m() const override { return 2 * range_m_; }

 private:
  double range_m_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(RangeBias)

}  // namespace mmradartwin
