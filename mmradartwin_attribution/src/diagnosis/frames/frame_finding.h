#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::frames {

/// Finding from raw samples and frames, which averages do not show.
struct FrameFinding {
  /// adc_saturation, packet_loss, packet_misalignment, interference, moving_target or phase_drift; "unknown" for
  /// FrameExaminer::unexplained().
  std::string cause;
  std::vector<FindingParameter> parameters;  ///< with the names of the cause's parameters
  double log_likelihood_gain = 0;            ///< nats of the frame data
  double false_alarm_rate = 1;               ///< upper bound for the whole session
  std::vector<std::string> poses;            ///< names of those that carry it
  std::vector<FindingPlace> where;
  std::string description;  ///< in words and numbers
  /// Mechanism of the twin for an unexplained() finding, where there is one. level_db is relative to one ADC count.
  std::optional<NamedParameters> mechanism;
  /// Nats that it explains at each pose, by the pose's name; empty where it is not measured by pose. Nats of an
  /// unexplained() finding are held out: their numbers come from poses of other locations.
  std::map<std::string, double> nats_by_pose;
};

}  // namespace mmradartwin::diagnosis::frames
