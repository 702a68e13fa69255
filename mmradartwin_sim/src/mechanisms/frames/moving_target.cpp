#include <cmath>

#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/point_echo.h"
#include "mmradartwin_dsp/input_error.h"
#include "stages/random_draw.h"

namespace mmradartwin {
namespace {

const std::string kMovingTarget = "moving_target";

/// Someone who walks to and fro along a line about (x_m, y_m) for all of the session. Every chirp meets him where he
/// is at the centre of its window, so that Doppler and the phase between TDM slots, 4 pi v T / lambda, follow from
/// delays alone; what he moves within a chirp (a hundredth of a range bin at 10 m/s) is left out.
class MovingTarget : public Mechanism, public ChirpPathStage {
 public:
  const std::string& name() const override { return kMovingTarget; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("x_m", "m", -1e4, 1e4, "map, middle of the walk"),
            numberSpec("y_m", "m", -1e4, 1e4, "map, middle of the walk"),
            numberSpec("speed_m_per_s", "m/s", 0, 100, "along the walk"),
            numberSpec("height_m", "m", -100, 100, 1.1, "of the echo's centre, map"),
            numberSpec("heading_deg", "deg", -360, 360, 0, "of the walk in map, from x to y"),
            numberSpec("reach_m", "m", 1e-6, 1000, 0.3, "of the walk to either side of its middle"),
            numberSpec("rcs_dbsm", "dBsm", -100, 60, -3, "radar cross section"),
            numberSpec("fading_m", "m", 0, 1000, 0,
                       "way after which the echo is that of another surface; 0: a steady echo")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    middle_ = {values.number("x_m"), values.number("y_m"), values.number("height_m")};
    const double heading_rad = values.number("heading_deg") * M_PI / 180;
    direction_ = {std::cos(heading_rad), std::sin(heading_rad), 0};
    speed_m_per_s_ = values.number("speed_m_per_s");
    reach_m_ = values.number("reach_m");
    fading_m_ = values.number("fading_m");
    cross_section_m2_ = std::pow(10.0, values.number("rcs_dbsm") / 10);
  }
  void addChirpPaths(const ChirpContext& now, std::vector<PathRecord>& records) const override {
    const PoseContext& context = now.pose;
    // The walk's period in whole nanoseconds takes the stamp's many digits away before they meet a double.
    double walked_m = 0;
    if (speed_m_per_s_ > 0) {
      const double period_ns = 4 * reach_m_ / speed_m_per_s_ * 1e9;
      const double start_ns = period_ns < 9e18 ? static_cast<double>(std::fmod(static_cast<long double>(now.stamp_ns),
                                                                               static_cast<long double>(period_ns)))
                                               : static_cast<double>(now.stamp_ns);
      walked_m = speed_m_per_s_ * (start_ns * 1e-9 + now.time_s);
    }
    const Eigen::Vector3d place = middle_ + along(walked_m) * direction_;
    std::optional<PointEcho> echo = pointEcho(context, place, cross_section_m2_);
    if (!echo) return;
    echo->record.event = &kMovingTarget;
    setContribution(context.radar, echo->amplitude * fading(now, walked_m), echo->record);
    records.push_back(std::move(echo->record));
  }

 private:
  /// Triangle wave of +-reach, from 0 upwards.
  double along(double walked_m) const {
    const double turn = std::fmod(walked_m / (4 * reach_m_) + 0.25, 1.0);
    return reach_m_ * (1 - 4 * std::abs(turn - 0.5));
  }
  /// Interpolates between independent draws, one for every fading_m of the way; unit power on average.
  std::complex<double> fading(const ChirpContext& now, double walked_m) const {
    if (!(fading_m_ > 0)) return 1.0;
    const double way = walked_m / fading_m_;
    const double surface = std::floor(way);
    const std::uint64_t key = drawKey(drawKey(now.pose.seed, 0x77616C6B6572), static_cast<std::uint64_t>(now.stamp_ns));
    const std::complex<double> here = drawNormal(drawKey(key, static_cast<std::uint64_t>(surface)));
    const std::complex<double> next = drawNormal(drawKey(key, static_cast<std::uint64_t>(surface) + 1));
    const double angle = 0.5 * M_PI * (way - surface);
    return std::cos(angle) * here + std::sin(angle) * next;
  }

  Eigen::Vector3d middle_, direction_;
  double speed_m_per_s_ = 0, reach_m_ = 1, fading_m_ = 0, cross_section_m2_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(MovingTarget)

}  // namespace mmradartwin
