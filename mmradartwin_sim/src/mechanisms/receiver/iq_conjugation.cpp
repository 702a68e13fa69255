#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kIqConjugation = "iq_conjugation";

/// Q with the wrong sign: x becomes its conjugate, echoes stand at (R_max - R, -azimuth).
class IqConjugation : public Mechanism, public ReceiveStage {
 public:
  const std::string& name() const override { return kIqConjugation; }
  std::vector<ParameterSpec> parameters() const override { return {}; }
  void configure(const Parameters&, const Scene&, const RadarConfig&) override {}
  int rank() const override { return 30; }  // a matter of delivery, after all analogue effects
  void receive(const PoseContext&, ComplexGrid& x) const override { x = x.conjugate().eval(); }
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(IqConjugation)

}  // namespace mmradartwin
