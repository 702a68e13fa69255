#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/receiver_wave.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kEmpiricalTone = "empirical_tone";

/// A tone of one beat frequency with a phase of its own in every frame, wherever the radar stands (a clock, say): what
/// a diagnosis found without a cause. It is one wave over the receivers, the same for all transmitters.
class EmpiricalTone : public Mechanism, public ChirpStage {
 public:
  const std::string& name() const override { return kEmpiricalTone; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("beat_hz", "Hz", -1e9, 1e9, "in the sampled signal, that of an echo being positive"),
            numberSpec("level_db", "dB", -200, 200, "over the session's strongest echo"),
            numberSpec("azimuth_deg", "deg", -90, 90, 0, "of an echo with the same phases over the receivers")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    turn_rad_ = 2 * M_PI * values.number("beat_hz") / radar.sample_rate_hz;
    level_ = std::pow(10.0, values.number("level_db") / 20);
    wave_ = receiverWave(radar, values.number("azimuth_deg"));
  }
  bool needsStrongestAmplitude() const override { return true; }
  void changeChirp(const ChirpContext& now, ComplexGrid& x) const override {
    const double phase_rad = 2 * M_PI * drawUniform(drawKey(now.frame_draw, 0x746f6e65));
    const double level = level_ * now.pose.strongest_amplitude();
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      x.col(n) += std::polar(level, turn_rad_ * static_cast<double>(n) + phase_rad) * wave_;
    }
  }

 private:
  double turn_rad_ = 0, level_ = 0;
  Eigen::VectorXcd wave_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EmpiricalTone)

}  // namespace mmradartwin
