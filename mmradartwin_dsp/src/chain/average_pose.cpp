#include "mmradartwin_dsp/average_pose.h"

#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

ReceiveGrid averagePose(const Recording& recording, const Pose& pose) {
  CoherentAverage average(recording.radar, 0);
  recording.forEachFrame(pose, [&average](const AdcCube& cube) { average.add(cube); });
  ReceiveGrid grid;
  try {
    grid = average.grid();
  } catch (const InputError& error) {
    throw InputError(recording.source + ": pose '" + pose.name + "': " + error.what());
  }
  if (recording.channels) correctChannels(*recording.channels, grid.x);
  grid.pose_valid = true;
  grid.T_map_radar = pose.T_map_radar;
  return grid;
}

}  // namespace mmradartwin
