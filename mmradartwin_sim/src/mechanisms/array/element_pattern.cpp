#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/pattern_curve.h"

namespace mmradartwin {
namespace {

const std::string kElementPattern = "element_pattern";

/// Directivity of the elements: roll-off with azimuth as a cosine or a measured curve, and with elevation as a curve.
class ElementPattern : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kElementPattern; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("cos_exponent", "1", 0, 100, 0, "n of the one-way power cos^n of the azimuth"), 0, 1.5),
            optionalNumbersSpec("angles_deg", "deg", -180, 180,
                                "azimuths of a measured curve, rising, positive to the left"),
            optionalNumbersSpec("gain_db", "dB", -200, 60, "one-way power at angles_deg"),
            optionalNumbersSpec("elevation_angles_deg", "deg", -90, 90, "elevations of a measured curve, rising"),
            optionalNumbersSpec("elevation_gain_db", "dB", -200, 60, "one-way power at elevation_angles_deg")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    exponent_ = values.number("cos_exponent");
    azimuth_ = {values.numbers("angles_deg"), values.numbers("gain_db"), kElementPattern, "angles_deg", "gain_db"};
    elevation_ = {values.numbers("elevation_angles_deg"), values.numbers("elevation_gain_db"), kElementPattern,
                  "elevation_angles_deg", "elevation_gain_db"};
  }
  void reweight(const PoseContext&, PathRecord& record) const override {
    // One-way powers of both legs make the two-way power; its root is the amplitude.
    double factor = std::pow(cosine(record.departure) * cosine(record.arrival), 0.5 * exponent_);
    if (azimuth_.given() || elevation_.given()) {
      factor *= std::pow(10.0, (curve_db(record.departure) + curve_db(record.arrival)) / 20);
    }
    scaleRecord(factor, record);
  }

 private:
  static double cosine(const Eigen::Vector3d& d) {
    const double horizontal = std::hypot(d.x(), d.y());
    return horizontal > 0 ? std::max(0.0, d.x() / horizontal) : 1.0;
  }
  double curve_db(const Eigen::Vector3d& d) const {
    return azimuth_.gain_db(std::atan2(d.y(), d.x())) + elevation_.gain_db(std::atan2(d.z(), std::hypot(d.x(), d.y())));
  }
  double exponent_ = 0;
  PatternCurve azimuth_, elevation_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ElementPattern)

}  // namespace mmradartwin
