#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin::diagnosis::channels {

/// Beam at a strong expected echo: the channels summed towards its direction, over as many range bins as there are
/// channels. Single bins show the direction of an echo. The bins of a beam together show its range, as the tones of one
/// echo share one phase there.
struct EchoBeam {
  int first_bin = 0;
  Eigen::VectorXcd weights;  ///< [M] of unit norm; the beam is weights^H times the channels
  Eigen::VectorXcd y;        ///< [M] the beam in the bins from first_bin on, with phases at the window's middle
  double clutter = 0;        ///< power of PoseChannels::clutter in the beam, at its middle bin
};

/// Range bin in the middle of a beam.
inline int middleBin(const EchoBeam& beam, int channels) { return beam.first_bin + channels / 2; }

/// Forms a beam of range spectra [M][N]: its bins, with phases at the window's middle.
Eigen::VectorXcd formBeam(const EchoBeam& beam, const Eigen::MatrixXcd& range_spectra);

/// Beams at the strongest paths that a pose is expected to receive, from `first_bin` on, without neighbours of one
/// direction. EchoBeam::y is left empty. A radar with fewer than four channels has no beams.
std::vector<EchoBeam> chooseBeams(const RadarConfig& radar, const std::vector<PathRecord>& expected, int first_bin);

}  // namespace mmradartwin::diagnosis::channels
