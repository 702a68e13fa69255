#pragma once

#include <complex>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin::diagnosis::frames {

/// Way in which what stands changes from frame to frame.
enum class FrameLawKind {
  kPhase,       ///< all echoes, or one, turn by the same angle
  kPhaseRange,  ///< all echoes turn by an angle that grows with their range: a trigger or a clock that jitters
  kLevel,       ///< the level changes, the phase does not
};

/// Law of the frames of one pose.
struct FrameLaw {
  FrameLawKind kind = FrameLawKind::kPhase;
  bool common = true;  ///< of all echoes; else of the echo at range_m
  double rms = 0;      ///< over frames: rad, rad per metre of range, or dB
  double slope = 0;    ///< rad per frame by which all echoes drift besides, of a common phase
  double nats = 0;
  int frames = 0;
  double range_m = 0, azimuth_rad = 0;  ///< of the one echo
};

/// Range spectra of the shots of one pose, before they are in units of the noise.
struct StandingSpectra {
  int channels = 0, bins = 0, loops = 0, frames = 0;
  std::vector<int> shot;                                 ///< indices: frame x loops + loop
  std::vector<std::complex<double>>* gain = nullptr;     ///< [shot] common factor that residuals were taken with
  std::vector<std::complex<float>>* average = nullptr;   ///< [bin][channel]
  std::vector<std::complex<float>>* residual = nullptr;  ///< [shot][bin][channel] shot - gain average
};

/// Laws of a pose's frames.
struct FrameLaws {
  std::vector<FrameLaw> laws;
  std::vector<double> level_db;  ///< [frame that has shots] common level; empty where it does not change
};

/// Finds the laws of what stands, and takes them out of average and residuals.
FrameLaws takeFrameLaws(const RadarConfig& radar, const StandingSpectra& spectra);

}  // namespace mmradartwin::diagnosis::frames
