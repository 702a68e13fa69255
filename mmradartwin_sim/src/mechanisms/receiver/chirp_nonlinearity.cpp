#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kChirpNonlinearity = "chirp_nonlinearity";

/// A ripple on the chirp's frequency, deviation_hz sin(2 pi ripple_hz t + phase). Transmitted and received chirp differ
/// by exp(j[phi_e(t) - phi_e(t - tau)]): paired echoes about every echo, ripple_hz away, their level in proportion to
/// the range while 2 pi deviation tau is small.
class ChirpNonlinearity : public Mechanism, public DistortionStage {
 public:
  const std::string& name() const override { return kChirpNonlinearity; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("deviation_hz", "Hz", 0, 1e8, "peak of the frequency's ripple"),
            numberSpec("ripple_hz", "Hz", 1, 1e9, "of the ripple along the chirp"),
            numberSpec("phase_deg", "deg", -360, 360, 0, "of the ripple at the ramp's start")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    ripple_hz_ = values.number("ripple_hz");
    index_ = values.number("deviation_hz") / ripple_hz_;
    phase_rad_ = values.number("phase_deg") * M_PI / 180;
  }
  void distort(const PoseContext& context, const std::vector<PathRecord>& paths, ComplexGrid& x) const override {
    const RadarConfig& radar = context.radar;
    const int samples = radar.samples_per_chirp;
    std::vector<std::complex<double>> ripple(static_cast<std::size_t>(samples));
    for (const PathRecord& path : paths) {
      // The ripple is slow against the spread of delays over the array: one delay for all channels.
      const double tau_s = meanLength_m(path) / kSpeedOfLight_m_per_s;
      for (int n = 0; n < samples; ++n) {
        const double t = radar.sample_time_s(n);
        ripple[static_cast<std::size_t>(n)] = std::polar(1.0, phaseError_rad(t) - phaseError_rad(t - tau_s)) - 1.0;
      }
      for (std::size_t k = 0; k < path.c.size(); ++k) {
        const double rate = 2 * M_PI * radar.slope_hz_per_s * path.length_m[k] / kSpeedOfLight_m_per_s;
        const std::complex<double> step = std::polar(1.0, rate / radar.sample_rate_hz);
        std::complex<double> tone =
            path.c[k] * std::polar(1.0, rate * (radar.sample_time_s(0) - radar.window_center_s()));
        for (int n = 0; n < samples; ++n) {
          x(static_cast<Eigen::Index>(k), n) += tone * ripple[static_cast<std::size_t>(n)];
          tone *= step;
        }
      }
    }
  }

 private:
  /// 2 pi times the integral of the ripple.
  double phaseError_rad(double t_s) const { return -index_ * std::cos(2 * M_PI * ripple_hz_ * t_s + phase_rad_); }
  double ripple_hz_ = 1, index_ = 0, phase_rad_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ChirpNonlinearity)

}  // namespace mmradartwin
