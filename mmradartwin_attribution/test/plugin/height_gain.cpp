// A cause as a user's package would add it: one mechanism and one row of the catalogue. Echoes are stronger the higher
// the radar stands.

#include <cmath>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/register_mechanism.h"

namespace user {

constexpr double kReferenceHeight_m = 1.1;

class HeightGain : public mmradartwin::Mechanism, public mmradartwin::WeightStage {
 public:
  const std::string& name() const override {
    static const std::string kName = "height_gain";
    return kName;
  }
  std::vector<mmradartwin::ParameterSpec> parameters() const override {
    mmradartwin::ParameterSpec slope;
    slope.name = "db_per_m";
    slope.unit = "dB/m";
    slope.min = -60;
    slope.max = 60;
    slope.neutral = 0;
    slope.typical = 6;
    slope.weighs = true;
    return {slope};
  }
  void configure(const mmradartwin::Parameters& values, const mmradartwin::Scene&,
                 const mmradartwin::RadarConfig&) override {
    db_per_m_ = values.number("db_per_m");
  }
  void reweight(const mmradartwin::PoseContext& context, mmradartwin::PathRecord& record) const override {
    const double height_m = context.T_map_radar.translation().z();
    mmradartwin::scaleRecord(std::pow(10.0, db_per_m_ * (height_m - kReferenceHeight_m) / 20), record);
  }

 private:
  double db_per_m_ = 0;
};

const bool kIsCatalogued = [] {
  mmradartwin::addCause({"height_gain", mmradartwin::ResidualClass::kUnsupportedAnchor, {{"db_per_m", "dB/m"}}, {}});
  return true;
}();

}  // namespace user

MMRADARTWIN_REGISTER_MECHANISM(user::HeightGain)
