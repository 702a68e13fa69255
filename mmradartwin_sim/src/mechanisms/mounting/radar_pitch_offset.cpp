#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kRadarPitchOffset = "radar_pitch_offset";

/// The radar looks pitch_deg further down than its pose says.
class RadarPitchOffset : public Mechanism, public MountingStage {
 public:
  const std::string& name() const override { return kRadarPitchOffset; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("pitch_deg", "deg", -90, 90, "true minus reported, about y, nose down positive"), 0, 5)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    pitch_rad_ = values.number("pitch_deg") * M_PI / 180;
  }
  int rank() const override { return 2; }  // after yaw: about the y axis of the turned radar
  Eigen::Isometry3d pose(const Eigen::Isometry3d& T_map_radar) const override {
    return T_map_radar * Eigen::AngleAxisd(pitch_rad_, Eigen::Vector3d::UnitY());
  }

 private:
  double pitch_rad_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(RadarPitchOffset)

}  // namespace mmradartwin
