#include "diagnosis/frames/law_findings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

constexpr double kAroundEcho_m = 0.3, kAroundEcho_deg = 8;  ///< about an echo, in a finding's place

/// Rms over frames with its interval: chi-squared of the frames, and the spread over poses.
struct Rms {
  double value = 0, low = 0, high = 0;
};

Rms rmsOf(const std::vector<const FrameLaw*>& laws) {
  std::vector<double> values;
  double frames = 0;
  for (const FrameLaw* law : laws) {
    values.push_back(law->rms);
    frames += law->frames - 1;
  }
  const double middle = quantile(values, 0.5);
  const double half = 1.96 * middle / std::sqrt(2 * frames);
  return {middle, std::min(middle - half, quantile(values, 0.025)), std::max(middle + half, quantile(values, 0.975))};
}

const char* unitOf(FrameLawKind kind) {
  switch (kind) {
    case FrameLawKind::kPhase:
      return "rad";
    case FrameLawKind::kPhaseRange:
      return "rad/m";
    default:
      return "dB";
  }
}

const char* nameOf(FrameLawKind kind) {
  switch (kind) {
    case FrameLawKind::kPhase:
      return "phase_rms_rad";
    case FrameLawKind::kPhaseRange:
      return "phase_rms_rad_per_m";
    default:
      return "level_rms_db";
  }
}

std::string lawOf(FrameLawKind kind, bool common) {
  switch (kind) {
    case FrameLawKind::kPhase:
      return common ? "phase_over_frames_of_all_echoes" : "phase_over_frames_of_one_echo";
    case FrameLawKind::kPhaseRange:
      return "phase_over_frames_growing_with_range";
    default:
      return common ? "level_over_frames_of_all_echoes" : "level_over_frames_of_one_echo";
  }
}

std::string lawInWords(FrameLawKind kind, bool common, const Rms& rms) {
  std::ostringstream text;
  const std::string who = common ? "all echoes" : "one echo";
  const std::string verb = common ? "" : "s";
  if (kind == FrameLawKind::kLevel) {
    text << "the level of " << who << " change" << (common ? "s alike" : "s") << " from frame to frame by " << rms.value
         << " dB rms and the phase does not";
  } else if (kind == FrameLawKind::kPhaseRange) {
    text << "all echoes turn from frame to frame by an angle that grows with range, " << rms.value
         << " rad/m rms: the samples' time jitters against the ramp";
  } else {
    text << who << " turn" << verb << (common ? " alike" : "") << " from frame to frame by " << rms.value << " rad rms"
         << (common ? ", at every range by the same angle" : ", while others stand: it vibrates");
  }
  return text.str();
}

}  // namespace

std::vector<FrameFinding> lawFindings(const std::vector<PoseLaws>& poses, bool level_told) {
  std::vector<FrameFinding> findings;
  for (const bool common : {true, false}) {
    for (const FrameLawKind kind : {FrameLawKind::kPhase, FrameLawKind::kPhaseRange, FrameLawKind::kLevel}) {
      if (kind == FrameLawKind::kLevel && level_told) continue;
      FrameFinding finding;
      std::vector<const FrameLaw*> laws;
      std::ostringstream places;
      for (const PoseLaws& p : poses) {
        bool shows = false;
        for (const FrameLaw& law : *p.laws) {
          if (law.common != common || law.kind != kind) continue;
          laws.push_back(&law);
          finding.log_likelihood_gain += law.nats;
          shows = true;
          if (common) continue;
          const double azimuth_deg = law.azimuth_rad * 180 / M_PI;
          const Eigen::Vector3d at = p.pose->T_map_radar * Eigen::Vector3d(law.range_m * std::cos(law.azimuth_rad),
                                                                           law.range_m * std::sin(law.azimuth_rad), 0);
          FindingPlace place;
          place.range_m = {std::max(0.0, law.range_m - kAroundEcho_m), law.range_m + kAroundEcho_m};
          place.azimuth_deg = {azimuth_deg - kAroundEcho_deg, azimuth_deg + kAroundEcho_deg};
          place.poses = {p.pose->name};
          place.x_m = at.x();
          place.y_m = at.y();
          finding.where.push_back(place);
          if (laws.size() == 1) {
            places << "; at " << law.range_m << " m and " << azimuth_deg << " deg of pose " << p.pose->name << ", ("
                   << at.x() << ", " << at.y() << ") m in the map";
          }
        }
        if (shows) finding.poses.push_back(p.pose->name);
      }
      if (laws.empty()) continue;
      const Rms rms = rmsOf(laws);
      finding.cause = "unknown";
      finding.false_alarm_rate = bounds::kFramesFalseAlarmRate;
      finding.parameters = {{"law", "", lawOf(kind, common), {}},
                            {nameOf(kind), unitOf(kind), rms.value, {{rms.low, rms.high}}}};
      finding.description = lawInWords(kind, common, rms) + places.str() + "; at " +
                            std::to_string(finding.poses.size()) + " of " + std::to_string(poses.size()) + " poses";
      findings.push_back(std::move(finding));
    }
  }
  return findings;
}

}  // namespace mmradartwin::diagnosis::frames
