#pragma once

#include "diagnosis/receiver/received_session.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

/// A session whose channels are ready to be judged against a twin.
struct PreparedSession {
  ReceivedSession received;
  /// True where there are too few poses for laws over poses: then only frames and channels are judged.
  bool few = false;
  double strongest_amplitude = 0;  ///< of the twin's paths at the session's poses
};

/// Reads a recording and leaves out poses that stand inside something. Tells the twin of the session and of its
/// strongest amplitude, to which some levels refer. Throws InputError where twin and recording cannot belong together.
PreparedSession prepareSession(const Recording& recording, Twin& twin, const DiagnosisOptions& options);

}  // namespace mmradartwin::diagnosis
