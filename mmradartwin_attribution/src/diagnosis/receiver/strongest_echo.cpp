#include "diagnosis/receiver/strongest_echo.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>
#include <vector>

#include "mmradartwin_dsp/units.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr double kLevelError_db = 0.3;  ///< standard error for an echo alone in its cell
/// Standard error for an echo that shares its cell, as relative phases are random.
constexpr double kSharedError_db = 3;
constexpr double kCellReach_bins = 2.5;  ///< distance within which echoes share a cell
constexpr double kLobeOverTone = 1.5;    ///< power summed over Hann's main lobe, over that of the tone

/// Mean power over the channels, by range bin.
Eigen::VectorXd measuredPower(const PoseChannels& pose) {
  return pose.range_spectra.colwise().squaredNorm().transpose() / static_cast<double>(pose.range_spectra.rows());
}

/// Power of a tone about a bin, at any position between the bins.
double tonePower(const Eigen::VectorXd& power, Eigen::Index bin) {
  return power.segment(bin - 2, 5).sum() / kLobeOverTone;
}

/// Changes a finding's level by by_db and adds an error. Does nothing to a finding without a level.
void changeLevel(Finding& finding, double by_db, double error_db) {
  const auto level = std::find_if(finding.parameters.begin(), finding.parameters.end(),
                                  [](const FindingParameter& p) { return p.name == "level_db"; });
  if (level == finding.parameters.end()) return;
  const double was_db = std::get<double>(level->value), half_db = level->ci95[0][1] - was_db;
  const double level_db = was_db + by_db, both_db = std::hypot(half_db, 1.96 * error_db);
  level->value = level_db;
  level->ci95 = {{level_db - both_db, level_db + both_db}};
  finding.mechanism->values.set("level_db", level_db);
}

/// Strongest measured echo of a session at the twin's echoes, and the twin's share of the power there. An echo that
/// only the twin has is weak in the data.
struct MeasuredEcho {
  double amplitude = 0, share = 1;
};

MeasuredEcho strongestMeasured(const Twin& twin, const ChannelData& data) {
  double strongest = 0;
  MeasuredEcho echo;
  for (const PoseChannels& p : data.poses) {
    const Eigen::Isometry3d& T = p.pose.T_map_radar;
    const Eigen::VectorXd measured = measuredPower(p);
    std::vector<std::pair<double, double>> expected;  // bin and power
    for (const PathRecord& r : twin.receivedPaths(T, twin.trace(T), p.pose.stamp_ns)) {
      double power = 0;
      for (const std::complex<double>& c : r.c) power += std::norm(c);
      expected.emplace_back(0.5 * r.length_m[0] / data.radar.range_bin_m(), power);
    }
    for (const auto& [place, power] : expected) {
      const Eigen::Index bin = std::lround(place);
      if (bin < 2 || bin + 2 >= measured.size()) continue;
      const double lobe = tonePower(measured, bin);
      if (lobe <= strongest) continue;
      double all = 0;
      for (const auto& [other, other_power] : expected)
        all += std::abs(other - place) < kCellReach_bins ? other_power : 0;
      const double own = lobe * power / all;
      if (own <= strongest) continue;
      strongest = own;
      echo = {std::sqrt(own), power / all};
    }
  }
  return echo;
}

/// Standard error of the strongest echo's level.
double errorOf_db(const MeasuredEcho& echo) { return kLevelError_db + kSharedError_db * (1 - echo.share); }

}  // namespace

double strongestMeasured(const ChannelData& data) {
  double strongest = 0;
  for (const PoseChannels& p : data.poses) {
    const Eigen::VectorXd power = measuredPower(p);
    for (Eigen::Index r = 2; r + 2 < power.size(); ++r) {
      if (power[r] >= power[r - 1] && power[r] >= power[r + 1]) strongest = std::max(strongest, tonePower(power, r));
    }
  }
  return std::sqrt(strongest);
}

void referToStrongestEcho(const Twin& twin, const ChannelData& data, Finding& f) {
  const MeasuredEcho echo = strongestMeasured(twin, data);
  if (!(echo.amplitude > 0)) return;
  changeLevel(f, kNeperOfAmplitude_db * std::log(strongestMeasured(data) / echo.amplitude), errorOf_db(echo));
}

void referToStrongestHost(const Twin& twin, const ChannelData& data, double log_gain, double amplitude, Finding& f) {
  const MeasuredEcho echo = strongestMeasured(twin, data);
  if (!(echo.amplitude > 0)) return;
  changeLevel(f, kNeperOfAmplitude_db * (std::log(echo.amplitude / amplitude) - 0.5 * log_gain), errorOf_db(echo));
}

}  // namespace mmradartwin::diagnosis::receiver
