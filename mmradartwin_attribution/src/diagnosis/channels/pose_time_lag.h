#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin::diagnosis::channels {

/// Of two frames that follow each other.
struct FrameChange {
  double at_s = 0;    ///< in the middle between the two
  double change = 0;  ///< changeBetween() their spectra
};

/// A stretch in which the radar is reported to move, from standing to standing.
struct MovingStretch {
  double from_s = 0, to_s = 0;
};

/// By how much later than the radar itself the reported poses begin and end to move.
struct PoseTimeLag {
  double lag_s = 0, standard_error_s = 0;
  std::vector<double> by_motion_s;  ///< each on its own, where it has an answer
  std::vector<double> nats;         ///< of each of those, over none; Laplace's law of what is left
  double false_alarm_rate = 1;      ///< of a lag that far from none, by Student's law of the motions' scatter
};

/// Reported motions by at least 5 cm, seconds since `zero_ns`. `track` in order of time.
std::vector<MovingStretch> motionsOf(const std::vector<StampedTransform>& track, std::int64_t zero_ns);
/// From frames' changes about each motion. Nothing with fewer than three motions that tell, or where frames change no
/// more on the way than while the radar stands.
std::optional<PoseTimeLag> findPoseTimeLag(const std::vector<StampedTransform>& track, std::int64_t zero_ns,
                                           const std::vector<MovingStretch>& motions,
                                           const std::vector<std::vector<FrameChange>>& changes, double period_s);

/// A recording as it is to be read: its poses where the radar was at a frame, not where it was reported to be then.
struct TimedRecording {
  Recording recording;
  std::optional<FrameFinding> finding;  ///< pose_time_lag
};
/// Reads the frames about the motions of a recording that has a track; else, and without a lag, gives it as it is. What
/// the twin states of a lag is taken off first.
TimedRecording inTime(const Recording& recording, const std::vector<NamedParameters>& stated,
                      const ReadingProgress& on_progress);

}  // namespace mmradartwin::diagnosis::channels
