#include "diagnosis/receiver/received_session.h"

#include <algorithm>
#include <utility>

namespace mmradartwin::diagnosis::receiver {

ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage) {
  return [&options, stage](std::size_t done, std::size_t all) {
    if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options.on_progress) options.on_progress({stage, static_cast<double>(done) / static_cast<double>(all)});
  };
}

ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress) {
  ReceivedSession session;
  FrameExaminer examiner(recording.radar);
  session.data = readChannels(recording, examiner, on_progress);
  session.frames = examiner.findings();
  session.unexplained = examiner.unexplained();
  if (by_echoes) session.conventions = findSampleConventionByEchoes(session.data);
  if (session.conventions.empty()) return session;
  // Bytes are judged as delivered, moving echoes at their true places.
  FrameExaminer repaired(recording.radar);
  session.data = readChannels(recording, repaired, on_progress, [&](AdcCube& frame) {
    for (const SampleConvention& c : session.conventions) undoSampleConvention(c, recording.radar, frame);
  });
  const auto moves = [](const FrameFinding& f) { return f.cause == "moving_target"; };
  std::vector<FrameFinding>& frames = session.frames;
  frames.erase(std::remove_if(frames.begin(), frames.end(), moves), frames.end());
  for (FrameFinding& f : repaired.findings()) {
    if (moves(f)) frames.push_back(std::move(f));
  }
  return session;
}

}  // namespace mmradartwin::diagnosis::receiver
