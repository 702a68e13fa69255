#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kPhaseNoise = "phase_noise";

/// Phase noise of the one oscillator that sends and mixes: each echo carries exp(j[phi(t) - phi(t - tau)]), whose
/// spectrum is S_phi(f) 4 sin^2(pi f tau), 2 L(f) = S_phi(f). With S_phi falling as 1/f^2 above the loop's bandwidth
/// the frequency noise is white, S_phi f^2, and phi(t) - phi(t - tau) = tau times it while f tau is small: the skirt of
/// a host is flat and grows with the square of its range. Below the loop's bandwidth ranges of metres cancel it anyway.
class PhaseNoise : public Mechanism, public ModulationStage {
 public:
  const std::string& name() const override { return kPhaseNoise; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("level_dbc_per_hz", "dBc/Hz", -200, -40, "single sideband, at offset_hz"),
            numberSpec("offset_hz", "Hz", 1, 1e9, 1e6, "from the carrier, where level_dbc_per_hz holds")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    // One complex sample covers a bandwidth of f_s: frequency noise of two-sided density L(f) f^2, times 2 pi for
    // rad/s.
    rate_rad_per_s_ = 2 * M_PI * values.number("offset_hz") *
                      std::sqrt(std::pow(10.0, values.number("level_dbc_per_hz") / 10) * radar.sample_rate_hz);
  }
  void modulateChirp(const ChirpContext& now, const ComplexGrid& delayed, ComplexGrid& x) const override {
    const std::uint64_t key = drawKey(now.draw, 0x7068617365);
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      // Real, the same at all receivers: sqrt(2) Re of a unit circular normal is a unit normal.
      const double rate = rate_rad_per_s_ * std::sqrt(2.0) * drawNormal(drawKey(key, n)).real();
      x.col(n) += std::complex<double>(0, rate) * delayed.col(n);
    }
  }

 private:
  double rate_rad_per_s_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(PhaseNoise)

}  // namespace mmradartwin
