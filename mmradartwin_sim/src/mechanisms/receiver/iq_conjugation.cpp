#include "mechanisms/base/receiver_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "iq_conjugation";

/// Q with the wrong sign: x becomes its conjugate, echoes stand at (R_max - R, -azimuth).
class IqConjugation : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override { return {}; }
  void configure(const Parameters&, const Scene&, const RadarConfig&) override {}
  int rank() const override { return 30; }  // a matter of delivery, after all analogue effects
  void receive(const PoseContext&, ComplexGrid& x) const override { x = x.conjugate().eval(); }
  bool hasReceiveStage() const override { return true; }
};

}  // namespace

std::unique_ptr<Mechanism> makeIqConjugation() { return std::make_unique<IqConjugation>(); }

}  // namespace mmradartwin
