#pragma once

#include <string>
#include <vector>

#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/frames/shot_examiner.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// What moved at one pose.
struct PoseMotion {
  Pose pose;
  int frames = 0;
  Eigen::ArrayXXf evidence;  ///< [range][azimuth] nats
  std::vector<MovingEcho> echoes;
  double noise_variance = 1.0 / 6;  ///< of one complex sample of one shot, mean over channels, counts^2
};

struct LocatedMotion {
  std::vector<FrameFinding> walkers;      ///< moving_target
  std::vector<FrameFinding> unexplained;  ///< the same cell at every pose: nothing in the room
};

/// Puts what moved into the map: a person is seen from many poses at one place, what is fixed to the radar in one cell.
LocatedMotion locateMotion(const RadarConfig& radar, std::vector<PoseMotion> poses);

}  // namespace mmradartwin::diagnosis::frames
