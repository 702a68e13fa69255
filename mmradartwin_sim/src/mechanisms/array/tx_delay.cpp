#include <cmath>
#include <string>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kTxDelay = "tx_delay";

/// One transmitter's channels come later: their beat frequencies rise, their phases at the window's centre turn by a
/// number of its own. A feed that is longer by delay_m turns them by 360 degrees for each half wavelength, of which no
/// one knows the rest to a degree.
class TxDelay : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kTxDelay; }
  std::vector<ParameterSpec> parameters() const override {
    return {weighing(numberSpec("slot", "1", 0, 15, "of the transmitter: row of tx_position_m, from 0")),
            weighing(tried(numberSpec("delay_m", "m", -5, 5, "added to the one-way range of its channels"), 0, 0.02)),
            weighing(
                tried(numberSpec("phase_deg", "deg", -360, 360, 0, "of its channels, at the window's centre"), 0, 30))};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const int slot = static_cast<int>(values.number("slot"));
    if (slot != values.number("slot") || slot >= radar.slots() || radar.slots() < 2) {
      throw InputError("mechanism tx_delay: key slot: is no transmitter; the radar has " +
                       std::to_string(radar.slots()) +
                       (radar.slots() < 2 ? " transmitter, whose delay is a range_bias" : " transmitters, from 0"));
    }
    first_ = static_cast<std::size_t>(slot * radar.receivers());
    receivers_ = static_cast<std::size_t>(radar.receivers());
    delay_m_ = values.number("delay_m");
    turn_ = std::polar(1.0, values.number("phase_deg") * M_PI / 180);
  }
  int rank() const override { return 2; }  // after geometry, a bias and the slope's error
  void reweight(const PoseContext& context, PathRecord& record) const override {
    for (std::size_t k = first_; k < first_ + receivers_; ++k) {
      record.length_m[k] += 2 * delay_m_;
      record.c[k] *= turn_;
    }
    record.phase_rad = std::arg(record.c[0]);
    record.range_bin = rangeBin(context.radar, record.length_m[0]);
  }

 private:
  std::size_t first_ = 0, receivers_ = 0;
  double delay_m_ = 0;
  std::complex<double> turn_ = 1;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(TxDelay)

}  // namespace mmradartwin
