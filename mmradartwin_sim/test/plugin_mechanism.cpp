// A mechanism as a user's package would add it: an echo weaker by a factor, nothing of the product's own sources.

#include <cmath>

#include "mmradartwin_sim/register_mechanism.h"

namespace user {

class PaperCurtain : public mmradartwin::Mechanism, public mmradartwin::WeightStage {
 public:
  const std::string& name() const override {
    static const std::string kName = "paper_curtain";
    return kName;
  }
  std::vector<mmradartwin::ParameterSpec> parameters() const override {
    mmradartwin::ParameterSpec loss;
    loss.name = "loss_db";
    loss.unit = "dB";
    loss.min = 0;
    loss.max = 40;
    return {loss};
  }
  void configure(const mmradartwin::Parameters& values, const mmradartwin::Scene&,
                 const mmradartwin::RadarConfig&) override {
    factor_ = std::pow(10.0, -values.number("loss_db") / 20);
  }
  void reweight(const mmradartwin::PoseContext&, mmradartwin::PathRecord& record) const override {
    mmradartwin::scaleRecord(factor_, record);
  }

 private:
  double factor_ = 1;
};

}  // namespace user

MMRADARTWIN_REGISTER_MECHANISM(user::PaperCurtain)
