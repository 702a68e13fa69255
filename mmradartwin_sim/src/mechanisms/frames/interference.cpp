#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/receiver_wave.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kInterference = "interference";

/// Chirps of another radar that cross ours in some frames: its beat sweeps through the receiver's band as
/// exp(j pi d_slope (t - t0)^2) and is seen while it lies within +-f_s/2, that is for f_s^2/d_slope samples. One wave
/// over the receivers of a chirp, another for every chirp.
class Interference : public Mechanism, public ChirpStage {
 public:
  const std::string& name() const override { return kInterference; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("frame_fraction", "1", 0, 1, "of frames that are hit"),
            numberSpec("level_db", "dB", -200, 200, 20, "of the burst over the session's strongest echo"),
            numberSpec("slope_difference_hz_per_s", "Hz/s", 1e9, 1e16, 1.5e12, "of the two chirps"),
            numberSpec("azimuth_deg", "deg", -90, 90, 20, "from where it comes, in radar_link")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    fraction_ = values.number("frame_fraction");
    level_ = std::pow(10.0, values.number("level_db") / 20);
    slope_hz_per_s_ = values.number("slope_difference_hz_per_s");
    wave_ = receiverWave(radar, values.number("azimuth_deg"));
  }
  bool needsStrongestAmplitude() const override { return true; }
  void changeChirp(const ChirpContext& now, ComplexGrid& x) const override {
    if (drawUniform(drawKey(now.frame_draw, 0x627572737473)) >= fraction_) return;
    const RadarConfig& radar = now.pose.radar;
    const std::uint64_t key = drawKey(now.draw, 0x6372 + 1);
    const double crossing = drawUniform(key) * radar.samples_per_chirp / radar.sample_rate_hz;
    const double phase_rad = 2 * M_PI * drawUniform(drawKey(key, 1));
    const double level = level_ * now.pose.strongest_amplitude();
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      const double t = static_cast<double>(n) / radar.sample_rate_hz - crossing;
      if (std::abs(slope_hz_per_s_ * t) >= radar.sample_rate_hz / 2) continue;
      x.col(n) += std::polar(level, M_PI * slope_hz_per_s_ * t * t + phase_rad) * wave_;
    }
  }

 private:
  double fraction_ = 0, level_ = 0, slope_hz_per_s_ = 1;
  Eigen::VectorXcd wave_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Interference)

}  // namespace mmradartwin
