#include "mechanisms/base/receiver_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "channel_conjugation";

/// The channel vector of every range bin conjugated: echoes at -azimuth, at their range. Conjugate and reversal of time
/// (n to N - n, which leaves the periodic Hann window as it is) conjugate the range spectrum and nothing else.
class ChannelConjugation : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override { return {}; }
  void configure(const Parameters&, const Scene&, const RadarConfig&) override {}
  int rank() const override { return 31; }
  void receive(const PoseContext&, ComplexGrid& x) const override {
    ComplexGrid y(x.rows(), x.cols());
    for (Eigen::Index n = 0; n < x.cols(); ++n) y.col(n) = x.col((x.cols() - n) % x.cols()).conjugate();
    x = y;
  }
  bool hasReceiveStage() const override { return true; }
};

}  // namespace

std::unique_ptr<Mechanism> makeChannelConjugation() { return std::make_unique<ChannelConjugation>(); }

}  // namespace mmradartwin
