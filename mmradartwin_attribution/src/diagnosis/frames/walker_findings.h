#pragma once

#include <vector>

#include "diagnosis/frames/frame_finding.h"
#include "diagnosis/frames/walk_tracker.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// Tracks of one pose.
struct PoseTracks {
  const Pose* pose = nullptr;
  const std::vector<WalkTrack>* tracks = nullptr;
};

/// One finding for each person: tracks that one person can have walked, from one pose to the next too, are one
/// person's. Strongest first.
std::vector<FrameFinding> walkerFindings(const RadarConfig& radar, const std::vector<PoseTracks>& poses);

}  // namespace mmradartwin::diagnosis::frames
