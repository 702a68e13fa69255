#include "diagnosis/prepared_session.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/clutter_field.h"
#include "diagnosis/pose_convention.h"
#include "diagnosis/scene_match.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/pose_placement.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr std::size_t kFewestForLaws = 3;  ///< poses

/// Leaves poses out at which the twin cannot be traced. Returns the twin's strongest amplitude at the others.
double keepUsablePoses(const Twin& twin, ChannelData& data) {
  double strongest_amplitude = 0;
  std::vector<PoseChannels> usable;
  for (PoseChannels& p : data.poses) {
    try {
      for (const PathRecord& record : twin.trace(p.pose.T_map_radar)) {
        strongest_amplitude = std::max(strongest_amplitude, record.amplitude);
      }
      usable.push_back(std::move(p));
    } catch (const InputError& error) {
      data.problems.push_back({p.pose.name, "pose '" + p.pose.name + "': " + error.what()});
    }
  }
  data.poses = std::move(usable);
  return strongest_amplitude;
}

/// requirePlaced(), whose error also names the convention of poses under which the recording matches.
void requireInScene(const Recording& recording, const Twin& twin, const ChannelData& data, bool few) {
  try {
    requirePlaced(twin, recording.poses, recording.source);
  } catch (const InputError& error) {
    const std::optional<std::string> reading = few ? std::nullopt : matchingPoseReading(twin, data);
    if (!reading) throw;
    throw InputError(std::string(error.what()) + "; " + *reading);
  }
}

}  // namespace

PreparedSession prepareSession(const Recording& recording, Twin& twin, const DiagnosisOptions& options) {
  PreparedSession session;
  session.few = recording.poses.size() < kFewestForLaws;
  session.received = receiveSession(recording, session.few, readingProgress(options, "reading captures"));
  ChannelData& data = session.received.data;
  twin.setSession(recording.poses);
  if (data.radar.channels() > kMaxChannels) {
    throw InputError(recording.radar_file + ": has " + std::to_string(data.radar.channels()) +
                     " virtual channels; a diagnosis takes up to " + std::to_string(kMaxChannels) +
                     ", record with fewer transmitters or receivers");
  }
  requireSameGrid(twin, data.radar);
  requireInScene(recording, twin, data, session.few);
  session.strongest_amplitude = keepUsablePoses(twin, data);
  if (data.poses.empty()) throw InputError(recording.source + ": " + data.problems.back().message);
  numberLocations(data);
  session.few = session.few || data.poses.size() < kFewestForLaws;
  if (session.strongest_amplitude == 0) {
    throw InputError(recording.source + ": the twin has no echo at any pose; check that poses.csv and scene " +
                     twin.description().scene_file + " share one map, in metres");
  }
  twin.setStrongestAmplitude(session.strongest_amplitude);
  expectClutter(twin.scene(), data);
  return session;
}

}  // namespace mmradartwin::diagnosis
