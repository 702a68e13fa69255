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

/// Change between two frames that follow each other.
struct FrameChange {
  double at_s = 0;    ///< time in the middle between the two
  double change = 0;  ///< changeBetween() of their spectra
};

/// Stretch of time in which the radar is reported to move, from rest to rest.
struct MovingStretch {
  double from_s = 0, to_s = 0;
};

/// Lag by which reported poses begin and end to move later than the radar itself.
struct PoseTimeLag {
  double lag_s = 0, standard_error_s = 0;
  std::vector<double> by_motion_s;  ///< lags of single motions, where these have one
  std::vector<double> nats;         ///< over no lag, by each of these motions; misfits follow Laplace's law
  double false_alarm_rate = 1;      ///< chance of so large a lag, by Student's law of the motions' scatter
};

/// Reported motions of at least 5 cm, in seconds since `zero_ns`. `track` is in order of time.
std::vector<MovingStretch> motionsOf(const std::vector<StampedTransform>& track, std::int64_t zero_ns);
/// Finds the lag from frames' changes about each motion. Nothing with fewer than three motions that tell it, and where
/// frames change no more on the way than while the radar stands.
std::optional<PoseTimeLag> findPoseTimeLag(const std::vector<StampedTransform>& track, std::int64_t zero_ns,
                                           const std::vector<MovingStretch>& motions,
                                           const std::vector<std::vector<FrameChange>>& changes, double period_s);

/// Recording whose poses are where the radar was at each frame, rather than where it was reported to be then.
struct TimedRecording {
  Recording recording;
  std::optional<FrameFinding> finding;  ///< pose_time_lag
};
/// Reads the frames about the motions of a recording and corrects its poses for a lag. A recording without a track or
/// without a lag stays as it is. A lag that the twin states is taken off first.
TimedRecording inTime(const Recording& recording, const std::vector<NamedParameters>& stated,
                      const ReadingProgress& on_progress);

}  // namespace mmradartwin::diagnosis::channels
