#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/pattern_curve.h"

namespace mmradartwin {
namespace {

const std::string kElevationPattern = "elevation_pattern";

/// Roll-off of the elements with elevation, as a cosine or a measured curve.
class ElevationPattern : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kElevationPattern; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("cos_exponent", "1", 0, 100, 0, "n of the one-way power cos^n"), 0, 8),
        optionalNumbersSpec("angles_deg", "deg", -90, 90, "elevations of a measured curve, rising, positive upwards"),
        optionalNumbersSpec("gain_db", "dB", -200, 60, "one-way power at angles_deg")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    exponent_ = values.number("cos_exponent");
    curve_ = {values.numbers("angles_deg"), values.numbers("gain_db"), kElevationPattern, "angles_deg", "gain_db"};
  }
  void reweight(const PoseContext&, PathRecord& record) const override {
    // One-way powers of both legs make the two-way power; its root is the amplitude.
    double factor = std::pow(cosine(record.departure) * cosine(record.arrival), 0.5 * exponent_);
    if (curve_.given()) factor *= std::pow(10.0, (curve_db(record.departure) + curve_db(record.arrival)) / 20);
    scaleRecord(factor, record);
  }

 private:
  static double cosine(const Eigen::Vector3d& d) { return std::hypot(d.x(), d.y()); }
  double curve_db(const Eigen::Vector3d& d) const { return curve_.gain_db(std::atan2(d.z(), cosine(d))); }
  double exponent_ = 0;
  PatternCurve curve_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ElevationPattern)

}  // namespace mmradartwin
