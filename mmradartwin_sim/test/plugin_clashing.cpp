// A plug-in whose mechanism bears a name that is taken.

#include "mmradartwin_sim/register_mechanism.h"

namespace user {

class Specular : public mmradartwin::Mechanism {
 public:
  const std::string& name() const override {
    static const std::string kName = "specular";
    return kName;
  }
  std::vector<mmradartwin::ParameterSpec> parameters() const override { return {}; }
  void configure(const mmradartwin::Parameters&, const mmradartwin::Scene&, const mmradartwin::RadarConfig&) override {}
};

}  // namespace user

MMRADARTWIN_REGISTER_MECHANISM(user::Specular)
