#include "diagnosis/receiver/receiver_noise.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::receiver {

std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated) {
  // The noise of a sample follows from that of a cell of the average by the sums of Hann's window over N samples, N/2
  // and 3N/8.
  std::vector<double> levels_db;
  for (const PoseChannels& p : data.poses) {
    if (!(p.shot_noise_power > 0)) continue;
    levels_db.push_back(10 * std::log10(p.shot_noise_power * 2.0 / 3 * data.radar.samples_per_chirp));
  }
  if (levels_db.size() < 2) return std::nullopt;
  const double stated_db = stated.values.number("level_dbfs") + stated.values.number("delta_db");
  const double delta_db = quantile(levels_db, 0.5) - stated_db;
  const double scatter = (quantile(levels_db, 0.84) - quantile(levels_db, 0.16)) / 2;
  const double error = std::max(bounds::kNoiseError_db, scatter / std::sqrt(static_cast<double>(levels_db.size())));
  if (std::abs(delta_db) < std::max(bounds::kLeastNoiseChange_db, bounds::kLeastNoiseChange_errors * error))
    return std::nullopt;
  Finding finding;
  finding.cause = "noise_floor";
  finding.mechanism = stated;
  finding.mechanism->values.set("delta_db", stated.values.number("delta_db") + delta_db);
  finding.parameters = {{"delta_db", "dB", delta_db, {{delta_db - 1.96 * error, delta_db + 1.96 * error}}}};
  finding.candidates = {{finding.cause, 1.0}};
  finding.evidence.log_likelihood_gain = 0.5 * delta_db * delta_db / (error * error);
  finding.evidence.false_alarm_rate = std::min(1.0, std::exp(-finding.evidence.log_likelihood_gain));
  return finding;
}

}  // namespace mmradartwin::diagnosis::receiver
