#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kRadarPositionOffset = "radar_position_offset";

/// The radar stands elsewhere than its pose says, by a constant vector in the radar frame.
class RadarPositionOffset : public Mechanism, public MountingStage {
 public:
  const std::string& name() const override { return kRadarPositionOffset; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("forward_m", "m", -10, 10, 0, "true minus reported, along boresight"), 0, 0.03),
            tried(numberSpec("left_m", "m", -10, 10, 0, "true minus reported, to the left"), 0, 0.03)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    offset_ = Eigen::Vector3d(values.number("forward_m"), values.number("left_m"), 0);
  }
  Eigen::Isometry3d pose(const Eigen::Isometry3d& T_map_radar) const override {
    return T_map_radar * Eigen::Translation3d(offset_);
  }

 private:
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(RadarPositionOffset)

}  // namespace mmradartwin
