#include <complex>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kTransmitterCoupling = "transmitter_coupling";

/// A transmitter that is switched off still radiates a little: every transmitter's slot carries the others' signals,
/// too, all at the same complex share.
class TransmitterCoupling : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kTransmitterCoupling; }
  std::vector<ParameterSpec> parameters() const override {
    const auto share = [](const char* name, const char* meaning) {
      return tried(numberSpec(name, "1", -1, 1, 0, meaning), 0, 0.1);
    };
    return {share("share_real", "of another transmitter's signal, in phase"),
            share("share_imaginary", "the same, a quarter turn ahead")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    if (radar.tx_position_m.size() < 2) {
      throw InputError("mechanism transmitter_coupling: the radar has one transmitter; there is none to couple with");
    }
    share_ = {values.number("share_real"), values.number("share_imaginary")};
  }
  int rank() const override { return -10; }  // in the antennas, before any gain or phase of a channel
  void receive(const PoseContext& context, ComplexGrid& x) const override {
    const Eigen::Index receivers = context.radar.receivers();
    ComplexGrid all = ComplexGrid::Zero(receivers, x.cols());
    for (Eigen::Index first = 0; first < x.rows(); first += receivers) all += x.middleRows(first, receivers);
    for (Eigen::Index first = 0; first < x.rows(); first += receivers) {
      x.middleRows(first, receivers) = ((1.0 - share_) * x.middleRows(first, receivers) + share_ * all).eval();
    }
  }

 private:
  std::complex<double> share_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(TransmitterCoupling)

}  // namespace mmradartwin
