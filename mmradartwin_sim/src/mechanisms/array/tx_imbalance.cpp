#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kTxImbalance = "tx_imbalance";

/// The second transmitter's block of channels turned or scaled.
class TxImbalance : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kTxImbalance; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("phase_deg", "deg", -360, 360, 0, "of the second transmitter's channels"), 0, 10),
            tried(numberSpec("gain_db", "dB", -60, 60, 0, "of the second transmitter's channels"), 0, 1)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    if (radar.slots() < 2)
      throw InputError("mechanism tx_imbalance: the radar has one transmitter only; remove the mechanism");
    receivers_ = radar.receivers();
    factor_ = std::polar(std::pow(10.0, values.number("gain_db") / 20), values.number("phase_deg") * M_PI / 180);
  }
  void receive(const PoseContext&, ComplexGrid& x) const override { x.middleRows(receivers_, receivers_) *= factor_; }

 private:
  int receivers_ = 0;
  std::complex<double> factor_ = 1;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(TxImbalance)

}  // namespace mmradartwin
