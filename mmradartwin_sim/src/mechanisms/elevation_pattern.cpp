#include <cmath>

#include "builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "elevation_pattern";

/// Roll-off of the elements with elevation.
class ElevationPattern : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("cos_exponent", "1", 0, 100, "n of the one-way power cos^n"), 0, 8)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    exponent_ = values.number("cos_exponent");
  }
  void reweight(const PoseContext&, PathRecord& record) const override {
    // One-way powers of both legs make the two-way power; its root is the amplitude.
    scaleRecord(std::pow(cosine(record.departure) * cosine(record.arrival), 0.5 * exponent_), record);
  }

 private:
  static double cosine(const Eigen::Vector3d& d) { return std::hypot(d.x(), d.y()); }
  double exponent_ = 0;
};

}  // namespace

std::unique_ptr<Mechanism> makeElevationPattern() { return std::make_unique<ElevationPattern>(); }

}  // namespace mmradartwin
