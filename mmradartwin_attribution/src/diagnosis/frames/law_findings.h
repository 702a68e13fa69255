#pragma once

#include <vector>

#include "diagnosis/frames/frame_finding.h"
#include "diagnosis/frames/frame_laws.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::frames {

/// Laws of one pose's frames.
struct PoseLaws {
  const Pose* pose = nullptr;
  const std::vector<FrameLaw>* laws = nullptr;
};

/// One `unknown` for each kind of law, with the poses that show it and the place of an echo that has it alone.
/// level_told: the common level of frames is another finding already.
std::vector<FrameFinding> lawFindings(const std::vector<PoseLaws>& poses, bool level_told);

}  // namespace mmradartwin::diagnosis::frames
