#include "diagnosis/gain/changed_records.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin::diagnosis::gain {
namespace {

constexpr std::size_t kMostPerPose = 20, kMostPoses = 10;  ///< limits of a list that a person reads
/// Changes below these are not listed.
constexpr double kSameLevel_db = 0.05, kSameRange_m = 5e-4, kSameAzimuth_deg = 0.02;

/// Paths of one mechanism over the same facets and actors: their power, and range and azimuth summed with power as
/// weight.
struct Bundle {
  double power = 0, range_m = 0, azimuth_rad = 0;
  void add(const PathRecord& path) {
    const double path_power = path.amplitude * path.amplitude;
    power += path_power;
    range_m += path_power * 0.5 * meanLength_m(path);
    azimuth_rad += path_power * std::atan2(path.arrival.y(), path.arrival.x());
  }
  RecordState state() const { return {10 * std::log10(power), range_m / power, azimuth_rad / power * 180 / M_PI}; }
};

/// Mechanism, facets and actors.
using Key = std::tuple<std::string, std::vector<int>, std::vector<int>>;
using Bundles = std::map<Key, Bundle>;

/// Paths that a twin receives at a pose, bundled.
Bundles bundles(const Twin& twin, const Pose& pose) {
  Bundles bundled;
  const std::vector<PathRecord> traced = twin.trace(pose.T_map_radar, pose.stamp_ns);
  for (const PathRecord& path : twin.receivedPaths(pose.T_map_radar, traced, pose.stamp_ns)) {
    if (!(path.amplitude > 0)) continue;
    bundled[{*path.event, {path.facets.begin(), path.facets.end()}, {path.actors.begin(), path.actors.end()}}].add(
        path);
  }
  return bundled;
}

bool differs(const ChangedRecord& record) {
  if (!record.before || !record.after) return true;
  return std::abs(record.after->amplitude_db - record.before->amplitude_db) > kSameLevel_db ||
         std::abs(record.after->range_m - record.before->range_m) > kSameRange_m ||
         std::abs(record.after->azimuth_deg - record.before->azimuth_deg) > kSameAzimuth_deg;
}

std::vector<ChangedRecord> changedAt(const Twin& before, const Twin& after, const Pose& pose) {
  std::map<Key, ChangedRecord> records;
  for (const auto& [key, bundle] : bundles(before, pose)) records[key].before = bundle.state();
  for (const auto& [key, bundle] : bundles(after, pose)) records[key].after = bundle.state();
  std::vector<ChangedRecord> changed;
  for (auto& [key, record] : records) {
    if (!differs(record)) continue;
    record.pose = pose.name;
    record.event = std::get<0>(key);
    for (int actor : std::get<2>(key)) record.actors.push_back(before.scene().actorOf(actor).name);
    changed.push_back(std::move(record));
  }
  std::stable_sort(changed.begin(), changed.end(),
                   [](const ChangedRecord& x, const ChangedRecord& y) { return x.strongest_db() > y.strongest_db(); });
  if (changed.size() > kMostPerPose) changed.resize(kMostPerPose);
  return changed;
}

}  // namespace

std::vector<ChangedRecord> changedRecords(const Twin& twin, const ChannelData& data,
                                          const std::vector<std::string>& poses,
                                          const std::vector<NamedParameters>& before,
                                          const std::vector<NamedParameters>& after) {
  std::vector<const Pose*> shown;
  for (const PoseChannels& p : data.poses) {
    const bool named = poses.empty() || std::find(poses.begin(), poses.end(), p.pose.name) != poses.end();
    if (named && shown.size() < kMostPoses) shown.push_back(&p.pose);
  }
  const Twin without = twin.changed(before), with = twin.changed(after);
  std::vector<std::vector<ChangedRecord>> by_pose(shown.size());
  tbb::parallel_for(std::size_t{0}, shown.size(), [&](std::size_t i) {
    try {
      by_pose[i] = changedAt(without, with, *shown[i]);
    } catch (const InputError&) {  // one of the twins has an actor at the radar's position
    }
  });
  std::vector<ChangedRecord> all;
  for (const auto& records : by_pose) all.insert(all.end(), records.begin(), records.end());
  return all;
}

}  // namespace mmradartwin::diagnosis::gain
