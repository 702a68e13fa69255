#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kName = "iq_imbalance";

/// I and Q of unequal gain or not quite in quadrature: x + beta conj(x), an image at (R_max - R, -azimuth).
class IqImbalance : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("image_db", "dB", -200, 0, "of the image against its host"), -200, -25),
            numberSpec("phase_deg", "deg", -360, 360, 0, "of beta")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    beta_ = std::polar(std::pow(10.0, values.number("image_db") / 20), values.number("phase_deg") * M_PI / 180);
  }
  int rank() const override { return 10; }  // in the mixer, after what belongs to the channels
  void receive(const PoseContext&, ComplexGrid& x) const override { x += beta_ * x.conjugate().eval(); }

 private:
  std::complex<double> beta_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(IqImbalance)

}  // namespace mmradartwin
