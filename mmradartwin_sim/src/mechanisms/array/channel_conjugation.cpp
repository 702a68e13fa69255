#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kChannelConjugation = "channel_conjugation";

/// The channel vector of every range bin conjugated: echoes at -azimuth, at their range. Conjugate and reversal of time
/// (n to N - n, which leaves the periodic Hann window as it is) conjugate the range spectrum and nothing else.
class ChannelConjugation : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kChannelConjugation; }
  std::vector<ParameterSpec> parameters() const override { return {}; }
  void configure(const Parameters&, const Scene&, const RadarConfig&) override {}
  int rank() const override { return 31; }
  void receive(const PoseContext&, ComplexGrid& x) const override {
    ComplexGrid y(x.rows(), x.cols());
    for (Eigen::Index n = 0; n < x.cols(); ++n) y.col(n) = x.col((x.cols() - n) % x.cols()).conjugate();
    x = y;
  }
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ChannelConjugation)

}  // namespace mmradartwin
