#include <algorithm>
#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kQuantisation = "quantisation";

/// A converter of fewer bits than the 16 of a sample: I and Q rounded to 2^bits levels over full scale.
class Quantisation : public Mechanism, public DigitiseStage {
 public:
  const std::string& name() const override { return kQuantisation; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec bits = integerSpec("bits", "1", 1, 16, 16, "of the converter");
    bits.required = true;
    return {bits};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    step_ = std::pow(2.0, 1 - values.number("bits"));
  }
  int rank() const override { return 30; }  // after noise and saturation
  void digitise(const ChirpContext&, ComplexGrid& x) const override {
    const auto rounded = [this](double v) {
      return std::min(1 - step_, std::max(-1.0, step_ * std::round(v / step_)));
    };
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x.data()[i] = {rounded(x.data()[i].real()), rounded(x.data()[i].imag())};
    }
  }

 private:
  double step_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Quantisation)

}  // namespace mmradartwin
