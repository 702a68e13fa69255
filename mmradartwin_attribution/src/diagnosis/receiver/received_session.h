#pragma once

#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/receiver/sample_convention.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"

namespace mmradartwin::diagnosis::receiver {

/// Tells options.on_progress of a stage as long as options are there; throws DiagnosisCancelled where they say so.
ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage);
/// A recording that was read, and how it was delivered as far as leakage and echoes tell that without a scene: then
/// data are as they ought to have been.
struct ReceivedSession {
  ChannelData data;
  std::vector<FrameFinding> frames, unexplained;
  std::vector<SampleConvention> conventions;
};
/// `by_echoes`: looks how it was delivered. Throws InputError where no pose is left.
ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress);

}  // namespace mmradartwin::diagnosis::receiver
