#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/frames/frame_finding.h"
#include "diagnosis/frames/shot_examiner.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// Motion at one pose, as its frames show it.
struct PoseMotion {
  Pose pose;
  int frames = 0;
  Eigen::ArrayXXf evidence;  ///< [range][azimuth] nats by which a cell varies more than noise
  std::vector<MovingEcho> echoes;
  double noise_variance =
      1.0 / 6;  ///< of one complex sample of one shot, mean over channels, counts^2; rounding by default
  std::vector<WalkTrack> tracks;
};

/// Motion of a session: walkers with their places in the map, and tones of the radar.
struct LocatedMotion {
  std::vector<FrameFinding> walkers;      ///< moving_target
  std::vector<FrameFinding> unexplained;  ///< one cell of range and angle at every pose: a tone of the radar
};

/// Locates motion in the map: many poses see a person at one place, and a tone of the radar in one cell.
LocatedMotion locateMotion(const RadarConfig& radar, std::vector<PoseMotion> poses);

}  // namespace mmradartwin::diagnosis::frames
