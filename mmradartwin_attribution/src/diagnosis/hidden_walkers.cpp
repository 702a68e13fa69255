#include "diagnosis/hidden_walkers.h"

#include <Eigen/Core>
#include <algorithm>
#include <set>
#include <string>
#include <utility>

#include "mmradartwin_sim/ray_caster.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kBody_m = 0.4;                        ///< by which a walk's place may be off along the view
constexpr double kHeights_m[] = {-0.6, -0.3, 0, 0.3};  ///< of parts of a body, against the radar's

/// True where a pose sees a place, or nothing tells that it does not.
bool seesPlace(const Twin& twin, const ChannelData& data, const FindingPlace& place, const std::string& name) {
  if (!place.x_m || !place.y_m) return true;
  const auto pose =
      std::find_if(data.poses.begin(), data.poses.end(), [&](const PoseChannels& p) { return p.pose.name == name; });
  if (pose == data.poses.end()) return true;
  const Eigen::Vector3d radar = pose->pose.T_map_radar.translation();
  return std::any_of(std::begin(kHeights_m), std::end(kHeights_m), [&](double height_m) {
    const Eigen::Vector3d ray = Eigen::Vector3d(*place.x_m, *place.y_m, radar.z() + height_m) - radar;
    const double range_m = ray.norm();
    if (range_m <= kBody_m) return true;
    return twin.rays().visible(radar, radar + ray * ((range_m - kBody_m) / range_m));
  });
}

bool isHidden(const Twin& twin, const ChannelData& data, const FrameFinding& walker) {
  return !walker.where.empty() &&
         std::none_of(walker.where.begin(), walker.where.end(), [&](const FindingPlace& place) {
           const std::vector<std::string>& poses = place.poses.empty() ? walker.poses : place.poses;
           return poses.empty() || std::any_of(poses.begin(), poses.end(), [&](const std::string& pose) {
                    return seesPlace(twin, data, place, pose);
                  });
         });
}

}  // namespace

void judgeHiddenWalkers(const Twin& twin, const ChannelData& data, std::vector<FrameFinding>& frames,
                        std::vector<FrameFinding>& unexplained) {
  const auto hidden = std::stable_partition(frames.begin(), frames.end(), [&](const FrameFinding& f) {
    return f.cause != "moving_target" || !isHidden(twin, data, f);
  });
  std::set<std::string> walked;
  for (auto f = frames.begin(); f != hidden; ++f) {
    if (f->cause == "moving_target") walked.insert(f->poses.begin(), f->poses.end());
  }
  for (auto f = hidden; f != frames.end(); ++f) {
    const bool echo =
        std::all_of(f->poses.begin(), f->poses.end(), [&](const std::string& pose) { return walked.count(pose) > 0; });
    if (echo) continue;
    f->cause = "unknown";
    f->description = "frames disagree at a place that the scene hides: " + f->description +
                     "; an opening is missing in the scene, or it is an echo by way of a wall";
    f->nats_by_pose.clear();
    unexplained.push_back(std::move(*f));
  }
  frames.erase(hidden, frames.end());
}

}  // namespace mmradartwin::diagnosis
