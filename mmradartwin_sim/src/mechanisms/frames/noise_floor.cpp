#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kNoiseFloor = "noise_floor";

/// Thermal noise: circular, white, independent over receivers, samples and chirps. The level is the rms of one complex
/// sample of one chirp; averaging n chirps takes 10 log10 n off it, the range transform another 10 log10(N 2/3).
class NoiseFloor : public Mechanism, public DigitiseStage {
 public:
  const std::string& name() const override { return kNoiseFloor; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("level_dbfs", "dBFS", -200, 0, "rms of a complex sample, that the twin states"),
            numberSpec("delta_db", "dB", -100, 100, 0, "above what the twin states")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    rms_ = std::pow(10.0, (values.number("level_dbfs") + values.number("delta_db")) / 20);
  }
  void digitise(const ChirpContext& now, ComplexGrid& x) const override {
    const std::uint64_t key = drawKey(now.draw, 0x6E6F697365);
    for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] += rms_ * drawNormal(drawKey(key, i));
  }

 private:
  double rms_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(NoiseFloor)

}  // namespace mmradartwin
