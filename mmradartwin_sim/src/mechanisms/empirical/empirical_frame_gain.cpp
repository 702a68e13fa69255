#include <algorithm>
#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kEmpiricalFrameGain = "empirical_frame_gain";

/// A level that changes from frame to frame, at every pose alike: what a diagnosis found without a cause.
class EmpiricalFrameGain : public Mechanism, public ChirpStage {
 public:
  const std::string& name() const override { return kEmpiricalFrameGain; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec gain =
        optionalNumbersSpec("gain_db", "dB", -120, 120, "of each frame of a pose; the last one holds for all beyond");
    gain.required = true;
    return {gain};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    for (double db : values.numbers("gain_db")) gain_.push_back(std::pow(10.0, db / 20));
  }
  void changeChirp(const ChirpContext& now, ComplexGrid& x) const override {
    if (!gain_.empty()) x *= gain_[std::min(static_cast<std::size_t>(now.frame), gain_.size() - 1)];
  }

 private:
  std::vector<double> gain_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EmpiricalFrameGain)

}  // namespace mmradartwin
