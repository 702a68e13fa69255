#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kDcOffset = "dc_offset";

/// A constant per channel: range bin 0, no law over the channels.
class DcOffset : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kDcOffset; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("level_db", "dB", -200, 100, "over the session's strongest echo, rms over channels")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    level_ = std::pow(10.0, values.number("level_db") / 20);
    // Fixed numbers, not the session's seed: the offset belongs to the device.
    vector_.resize(radar.channels());
    for (Eigen::Index k = 0; k < vector_.size(); ++k) vector_[k] = drawNormal(drawKey(20240611, k));
    vector_ *= std::sqrt(static_cast<double>(vector_.size())) / vector_.norm();
  }
  int rank() const override { return 11; }
  bool needsStrongestAmplitude() const override { return true; }
  void receive(const PoseContext& context, ComplexGrid& x) const override {
    x.colwise() += level_ * context.strongest_amplitude() * vector_;
  }

 private:
  double level_ = 0;
  Eigen::VectorXcd vector_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(DcOffset)

}  // namespace mmradartwin
