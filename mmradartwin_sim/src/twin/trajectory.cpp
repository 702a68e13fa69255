#include "mmradartwin_sim/trajectory.h"

#include <algorithm>
#include <utility>

namespace mmradartwin {
namespace {

constexpr double kFollows_s = 0.2;  // poses further apart say nothing about the time between them

}  // namespace

Trajectory trajectoryOf(std::vector<Pose> poses) {
  std::sort(poses.begin(), poses.end(), [](const Pose& a, const Pose& b) { return a.stamp_ns < b.stamp_ns; });
  return [poses = std::move(poses)](std::int64_t stamp_ns) -> std::optional<Eigen::Isometry3d> {
    if (poses.empty()) return std::nullopt;
    const auto after = std::upper_bound(poses.begin(), poses.end(), stamp_ns,
                                        [](std::int64_t stamp, const Pose& p) { return stamp < p.stamp_ns; });
    if (after == poses.begin()) return poses.front().T_map_radar;
    const Pose& before = *std::prev(after);
    if (after == poses.end()) return before.T_map_radar;
    const double gap_s = static_cast<double>(after->stamp_ns - before.stamp_ns) * 1e-9;
    if (gap_s > kFollows_s) return before.T_map_radar;
    const double share = static_cast<double>(stamp_ns - before.stamp_ns) * 1e-9 / gap_s;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = Eigen::Quaterniond(before.T_map_radar.linear())
                     .slerp(share, Eigen::Quaterniond(after->T_map_radar.linear()))
                     .toRotationMatrix();
    T.translation() = (1 - share) * before.T_map_radar.translation() + share * after->T_map_radar.translation();
    return T;
  };
}

}  // namespace mmradartwin
