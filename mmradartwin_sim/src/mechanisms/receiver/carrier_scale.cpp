#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kCarrierScale = "carrier_scale";

/// The array is wider against the wavelength than radar.yaml says: every sine of an angle appears 1 + scale larger.
/// The ways from the elements differ from that of element 0 by 1 + scale times what geometry gives.
class CarrierScale : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kCarrierScale; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("scale", "1", -0.2, 0.2, "epsilon of sin(theta) x (1 + epsilon), 0 is none"), 0, 0.01)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    scale_ = values.number("scale");
  }
  void reweight(const PoseContext& context, PathRecord& record) const override {
    if (record.bounces == 0) return;  // coupling inside the radar has no angle
    const double reference_m = record.length_m[0];
    PerChannel<double> extra_m(record.length_m.size());
    for (std::size_t k = 0; k < extra_m.size(); ++k) extra_m[k] = scale_ * (record.length_m[k] - reference_m);
    lengthenChannels(context.radar, extra_m, record);
  }
  int rank() const override { return -1; }  // on geometry's lengths

 private:
  double scale_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(CarrierScale)

}  // namespace mmradartwin
