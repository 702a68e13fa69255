#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

namespace mmradartwin {

/// Watches the radar's announced pose: the age of the latest one, gaps, and jumps that no trolley makes.
class PoseWatch {
 public:
  struct Options {
    double age_limit_s = 1.0;  ///< an older pose, or a longer interval between poses, is a gap
    double speed_limit_m_per_s = 3.0, turn_limit_rad_per_s = 6.3;
    double jump_m = 0.1, jump_rad = 0.09;  ///< smaller jumps are noise of the pose source
    double remember_s = 10.0;              ///< time for which a gap or a jump is reported
  };
  enum class Level { kFine, kWarning, kError };
  struct Report {
    Level level = Level::kError;
    std::string text;             ///< one line, with the next thing to do where there is a problem
    std::optional<double> age_s;  ///< nothing before the first pose, and for a pose without a stamp
    std::uint64_t gaps = 0, jumps = 0;
  };

  PoseWatch() = default;
  explicit PoseWatch(const Options& options) : options_(options) {}

  /// Latest known pose and its stamp (0: static). Older and repeated stamps are ignored.
  void observe(std::int64_t stamp_ns, const Eigen::Isometry3d& T_map_radar);
  Report report(std::int64_t now_ns) const;

 private:
  Options options_;
  std::optional<std::int64_t> stamp_ns_;
  Eigen::Isometry3d T_map_radar_ = Eigen::Isometry3d::Identity();
  std::uint64_t gaps_ = 0, jumps_ = 0;
  struct Event {
    std::string text;
    std::int64_t stamp_ns = 0;  ///< of the first pose after it
  };
  Event gap_, jump_;  ///< the latest of each kind
};

}  // namespace mmradartwin
