#pragma once

#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/receiver/sample_convention.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_options.h"

namespace mmradartwin::diagnosis::receiver {

/// Progress of a stage for options.on_progress, which throws DiagnosisCancelled where the user has cancelled. Keeps a
/// reference to the options.
ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage);
/// Recording that was read, with the conventions of its samples that leakage and echoes show without a scene. These
/// conventions are undone in the data.
struct ReceivedSession {
  ChannelData data;
  std::vector<FrameFinding> frames, unexplained;
  std::vector<SampleConvention> conventions;
};
/// Reads a recording. by_echoes: searches for conventions. Throws InputError where no pose is left.
ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress);

}  // namespace mmradartwin::diagnosis::receiver
