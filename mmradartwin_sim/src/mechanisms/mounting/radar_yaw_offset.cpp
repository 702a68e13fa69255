#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kRadarYawOffset = "radar_yaw_offset";

/// The radar looks yaw_deg further to the left than its pose says.
class RadarYawOffset : public Mechanism, public MountingStage {
 public:
  const std::string& name() const override { return kRadarYawOffset; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("yaw_deg", "deg", -180, 180, "true heading minus reported, positive to the left"), 0, 0.5)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    yaw_rad_ = values.number("yaw_deg") * M_PI / 180;
  }
  int rank() const override { return 1; }  // after the position, which is in the reported radar frame
  Eigen::Isometry3d pose(const Eigen::Isometry3d& T_map_radar) const override {
    return T_map_radar * Eigen::AngleAxisd(yaw_rad_, Eigen::Vector3d::UnitZ());
  }

 private:
  double yaw_rad_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(RadarYawOffset)

}  // namespace mmradartwin
