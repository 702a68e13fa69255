#include <map>
#include <optional>
#include <string>
#include <utility>

#include "diagnosis/channels/pose_time_lag.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/receiver/received_session.h"
#include "diagnosis/receiver/receiver_findings.h"
#include "diagnosis/survey_plan.h"
#include "diagnosis/unexplained_frames.h"
#include "mmradartwin_attribution/diagnosis.h"

namespace mmradartwin {

using namespace diagnosis;

Diagnosis diagnoseReceiver(const Recording& recording, const DiagnosisOptions& options) {
  const TimedRecording timed = inTime(recording, {}, readingProgress(options, "frames on the way"));
  ReceivedSession session = receiveSession(timed.recording, true, readingProgress(options, "reading captures"));
  ChannelData& data = session.data;
  Diagnosis result;
  const auto add = [&](Finding finding, const std::map<std::string, double>& nats_by_pose = {}) {
    addGainInNats(data, nats_by_pose, finding);
    result.extended.mechanisms.push_back(*finding.mechanism);
    result.findings.findings.push_back(std::move(finding));
  };
  if (timed.finding) add(findingOf(*timed.finding));
  for (const FrameFinding& frame : session.frames) add(findingOf(frame), frame.nats_by_pose);
  for (const SampleConvention& convention : session.conventions) add(findingOf(convention, data.radar));
  if (const BodyFixedTone tone = findBodyFixedTone(data); isUnambiguous(tone)) {
    subtractTone(tone, data);
    add(findingOf(tone, data));
  }
  if (const std::optional<ChannelErrors> errors = findChannelErrors(data)) add(findingOf(*errors));
  addUnexplained(session.unexplained, data, {}, result.findings, result.extended.mechanisms);
  result.findings.poses = static_cast<int>(data.poses.size());
  result.findings.locations = static_cast<int>(data.locations.size());
  result.findings.held_out = "nothing: without a scene only frames and channels are judged";
  result.has_twin = false;
  result.extended.radar = recording.radar;
  result.problems = data.problems;
  result.plan = surveyPlan(nullptr, timed.recording.poses);
  return result;
}

}  // namespace mmradartwin
