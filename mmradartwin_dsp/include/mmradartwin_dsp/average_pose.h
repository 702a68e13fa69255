#pragma once

#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// Coherent average over all frames of a pose, corrected by the recording's `channels` where it has any, with the pose
/// in it. Throws InputError naming the pose where its capture is missing or damaged, or where a TDM slot has no valid
/// chirp. The one way from a recording to a measured grid for every offline program that looks at averages alone.
ReceiveGrid averagePose(const Recording& recording, const Pose& pose);

}  // namespace mmradartwin
