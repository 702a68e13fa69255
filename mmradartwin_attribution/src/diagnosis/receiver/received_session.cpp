#include "diagnosis/receiver/received_session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "diagnosis/catalogue/bounds.h"

namespace mmradartwin::diagnosis::receiver {

ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage) {
  return [&options, stage](std::size_t done, std::size_t all) {
    if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options.on_progress) options.on_progress({stage, static_cast<double>(done) / static_cast<double>(all)});
  };
}

namespace {

/// Captures that begin within a frame, which were read from their first whole chirp on.
std::vector<FrameFinding> misalignedCaptures(const Recording& recording) {
  std::vector<FrameFinding> all;
  if (!recording.begins_within || recording.aligned_by_user) return all;
  for (const auto& [pose, bytes] : *recording.begins_within) {
    FrameFinding finding;
    finding.cause = "packet_misalignment";
    finding.poses = {pose};
    finding.false_alarm_rate = bounds::kFramesFalseAlarmRate;
    finding.log_likelihood_gain = -std::log(finding.false_alarm_rate);  // at least: the capture was recognised by it
    finding.nats_by_pose = {{pose, finding.log_likelihood_gain}};
    finding.parameters = {{"pose", "", pose, {}}};
    finding.description = "the capture begins " + std::to_string(bytes) +
                          " bytes into a frame; all else is judged from its first whole chirp on, as --align reads it";
    all.push_back(std::move(finding));
  }
  return all;
}

}  // namespace

ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress) {
  ReceivedSession session;
  FrameExaminer examiner(recording.radar);
  session.data = readChannels(recording, examiner, on_progress);
  session.frames = misalignedCaptures(recording);
  for (FrameFinding& finding : examiner.findings()) session.frames.push_back(std::move(finding));
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
