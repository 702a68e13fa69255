#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kChannelPhaseError = "channel_phase_error";

/// A phase and gain per virtual channel, the same for all paths.
class ChannelPhaseError : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kChannelPhaseError; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec phase = numberSpec("phase_deg", "deg", -360, 360, "per virtual channel, channel 0 is 0");
    phase.kind = ParameterKind::kNumbers;
    phase.required = false;
    phase.default_value = std::vector<double>();
    phase.neutral = 0;
    phase.typical = 10;
    ParameterSpec gain = numberSpec("gain_db", "dB", -60, 60, "per virtual channel, channel 0 is 0");
    gain.kind = ParameterKind::kNumbers;
    gain.required = false;
    gain.default_value = std::vector<double>();
    gain.neutral = 0;
    gain.typical = 1;
    return {phase, gain};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    const std::size_t channels = static_cast<std::size_t>(radar.channels());
    factor_.assign(channels, 1.0);
    for (const char* key : {"phase_deg", "gain_db"}) {
      const std::vector<double>& v = values.numbers(key);
      if (v.empty()) continue;
      if (v.size() != channels) {
        throw InputError("mechanism channel_phase_error: key " + std::string(key) + ": has " +
                         std::to_string(v.size()) + " numbers; the radar has " + std::to_string(channels) +
                         " virtual channels");
      }
      for (std::size_t k = 0; k < channels; ++k) {
        factor_[k] *=
            key[0] == 'p' ? std::polar(1.0, v[k] * M_PI / 180) : std::complex<double>(std::pow(10.0, v[k] / 20));
      }
    }
  }
  void receive(const PoseContext&, ComplexGrid& x) const override {
    for (Eigen::Index k = 0; k < x.rows(); ++k) x.row(k) *= factor_[static_cast<std::size_t>(k)];
  }

 private:
  std::vector<std::complex<double>> factor_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ChannelPhaseError)

}  // namespace mmradartwin
