#include "diagnosis/scene_match.h"

#include <Eigen/Geometry>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/numbers/number_text.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin::diagnosis {
namespace {

/// A pose that stands this far away, or looks this far aside, sees other echoes.
constexpr double kElsewhere_m = 0.3, kElsewhere_rad = 20 * M_PI / 180;

}  // namespace

std::optional<double> explainedByChance(const ChannelData& data, const std::vector<PoseEchoes>& echoes) {
  const std::size_t n = echoes.size();
  std::vector<PoseEchoes> elsewhere(n);
  for (std::size_t i = 0; i < n; ++i) {
    const auto differs = [&](std::size_t j) {
      const Eigen::Isometry3d by = data.poses[i].pose.T_map_radar.inverse() * data.poses[j].pose.T_map_radar;
      return by.translation().norm() > kElsewhere_m || Eigen::AngleAxisd(by.linear()).angle() > kElsewhere_rad;
    };
    std::size_t k = 0;
    while (k < n && !differs((i + n / 2 + k) % n)) ++k;
    if (k == n) return std::nullopt;
    elsewhere[i] = echoes[(i + n / 2 + k) % n];
  }
  return explainedPower(cellPowers(data, elsewhere));
}

void requireSameGrid(const Twin& twin, const RadarConfig& recorded) {
  const RadarConfig& simulated = twin.radar();
  if (simulated.channels() == recorded.channels() && simulated.samples_per_chirp == recorded.samples_per_chirp) return;
  const auto grid = [](const RadarConfig& radar) {
    return std::to_string(radar.channels()) + " virtual channels of " + std::to_string(radar.samples_per_chirp) +
           " samples";
  };
  const TwinDescription& description = twin.description();
  throw InputError((description.radar_file.empty() ? description.file : description.radar_file) + ": has " +
                   grid(simulated) + ", the recording has " + grid(recorded) +
                   "; give the twin the radar that was recorded");
}

std::optional<Finding> nothingMatches(const ChannelData& data, const std::vector<PoseEchoes>& echoes,
                                      double explained_power) {
  const std::optional<double> by_chance = explainedByChance(data, echoes);
  if (!by_chance || explained_power - *by_chance >= bounds::kLeastExplainedBeyondChance) return std::nullopt;
  Finding finding;
  finding.cause = "unknown";
  finding.candidates = {{"unknown", 1.0}};
  finding.description = "nothing matches: the twin explains " + number(explained_power) +
                        " of the measured power, and " + number(*by_chance) +
                        " with its poses exchanged; check that scene, poses and captures belong together";
  return finding;
}

}  // namespace mmradartwin::diagnosis
