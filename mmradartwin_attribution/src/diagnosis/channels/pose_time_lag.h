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

/// Change between two successive frames.
struct FrameChange {
  double at_s = 0;    ///< time in the middle between the two frames
  double change = 0;  ///< changeBetween() of their spectra
};

/// Interval in which the radar is reported to move, from rest to rest.
struct MovingStretch {
  double from_s = 0, to_s = 0;
};

/// Delay of reported poses behind the radar's motion.
struct PoseTimeLag {
  double lag_s = 0, standard_error_s = 0;
  std::vector<double> by_motion_s;  ///< delays of single motions, where these determine one
  std::vector<double> nats;  ///< nats over no delay, by each of these motions; misfits follow Laplace's distribution
  double false_alarm_rate =
      1;  ///< probability of so large a delay by chance, by Student's t of the scatter over motions
};

/// Reported motions of at least 5 cm, in seconds since `zero_ns`. track: in order of time.
std::vector<MovingStretch> motionsOf(const std::vector<StampedTransform>& track, std::int64_t zero_ns);
/// Finds the delay from the changes of frames about each motion. Nothing with fewer than three motions that determine
/// it, and where frames change no more during motion than at rest.
std::optional<PoseTimeLag> findPoseTimeLag(const std::vector<StampedTransform>& track, std::int64_t zero_ns,
                                           const std::vector<MovingStretch>& motions,
                                           const std::vector<std::vector<FrameChange>>& changes, double period_s);

/// Recording whose poses are the radar's positions at the frames' times, rather than those reported at these times.
struct TimedRecording {
  Recording recording;
  std::optional<FrameFinding> finding;  ///< pose_time_lag
};
/// Reads the frames about the motions of a recording and corrects its poses for a delay. A recording without a track or
/// a delay is unchanged. A delay that the twin states is subtracted first.
TimedRecording inTime(const Recording& recording, const std::vector<NamedParameters>& stated,
                      const ReadingProgress& on_progress);

}  // namespace mmradartwin::diagnosis::channels
