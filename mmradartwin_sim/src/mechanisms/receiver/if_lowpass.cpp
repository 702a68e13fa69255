#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kIfLowpass = "if_lowpass";

/// Edge of the receiver's decimation filter: a Butterworth low-pass on the tone of each path, as it stands ahead of
/// the sampler.
class IfLowpass : public Mechanism, public ToneStage {
 public:
  const std::string& name() const override { return kIfLowpass; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("corner_hz", "Hz", 1e3, 1e9, "-3 dB of the whole"), 1e+09, 4.5e+06),
            integerSpec("order", "1", 1, 20, 6, "of the Butterworth edge")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    corner_hz_ = values.number("corner_hz");
    order_ = static_cast<int>(values.number("order"));
  }
  std::complex<double> toneGain(const PoseContext& context, double length_m) const override {
    // Poles on the unit circle's left half at angles (2k + n - 1)/(2n) pi, s = j f / corner.
    const std::complex<double> s(0, context.radar.slope_hz_per_s * length_m / kSpeedOfLight_m_per_s / corner_hz_);
    std::complex<double> gain = 1;
    for (int k = 1; k <= order_; ++k) gain /= s - std::polar(1.0, M_PI * (2 * k + order_ - 1) / (2.0 * order_));
    // The product of all -poles is 1, so that the gain at 0 Hz is 1.
    return gain;
  }

 private:
  double corner_hz_ = 1;
  int order_ = 6;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(IfLowpass)

}  // namespace mmradartwin
