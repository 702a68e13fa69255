#include <algorithm>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kAdcSaturation = "adc_saturation";

/// A gain at which this share of all I and Q values of the session lies beyond full scale, where it is held. The
/// session's gain_db is that gain.
class AdcSaturation : public Mechanism, public DigitiseStage {
 public:
  const std::string& name() const override { return kAdcSaturation; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("clipped_fraction", "1", 1e-9, 0.5, "of all I and Q values of the session")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    fraction_ = values.number("clipped_fraction");
  }
  int rank() const override { return 20; }  // after the noise
  double clippedFraction() const override { return fraction_; }
  void digitise(const ChirpContext&, ComplexGrid& x) const override {
    const auto held = [](double v) { return std::min(32767.0 / 32768, std::max(-1.0, v)); };
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = {held(x.data()[i].real()), held(x.data()[i].imag())};
  }

 private:
  double fraction_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(AdcSaturation)

}  // namespace mmradartwin
