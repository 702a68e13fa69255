#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kIfHighpass = "if_highpass";

/// The receiver's IF high-pass: two first-order sections whose corners stand in a fixed ratio. corner_hz is where both
/// together have lost 3 dB. The device's corner steps go by factors of two; radar.yaml's if_highpass_hz tells the ratio
/// where it is known.
class IfHighpass : public Mechanism, public ToneStage {
 public:
  const std::string& name() const override { return kIfHighpass; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("corner_hz", "Hz", 1e3, 1e7, "-3 dB of the whole"), 1000, 350000),
        numberSpec("ratio", "1", 0, 100, 0, "of the second section's corner to the first; 0: radar.yaml's, else 2")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    double ratio = values.number("ratio");
    if (ratio <= 0) {
      const auto& known = radar.if_highpass_hz;
      ratio = known.size() == 2 && known[0] > 0 && known[1] > 0 ? known[1] / known[0] : 2;
    }
    // (1 + x)(1 + ratio^2 x) = 2 with x = (first/corner)^2.
    const double a = ratio * ratio, b = 1 + a;
    const double x = (-b + std::sqrt(b * b + 4 * a)) / (2 * a);
    first_hz_ = values.number("corner_hz") * std::sqrt(x);
    second_hz_ = ratio * first_hz_;
  }
  std::complex<double> toneGain(const PoseContext& context, double length_m) const override {
    const double beat_hz = context.radar.slope_hz_per_s * length_m / kSpeedOfLight_m_per_s;
    if (std::abs(beat_hz) < 1e-3) return 0.0;
    using Complex = std::complex<double>;
    return 1.0 / (Complex(1, -first_hz_ / beat_hz) * Complex(1, -second_hz_ / beat_hz));
  }

 private:
  double first_hz_ = 0, second_hz_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(IfHighpass)

}  // namespace mmradartwin
