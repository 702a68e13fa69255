#pragma once

#include <Eigen/Core>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin::diagnosis::channels {

/// A direction at which a strong echo is expected: the channels formed into one beam, over as many range bins as there
/// are channels. Bins one by one show where an echo comes from; a beam's bins together show how far it went, as the
/// tones of one echo hold one phase there.
struct EchoBeam {
  int first_bin = 0;
  Eigen::VectorXcd weights;  ///< [M] of unit norm; the beam is weights^H y
  Eigen::VectorXcd y;        ///< [M] of the bins from first_bin on, at the window's middle
  double clutter = 0;        ///< power in the beam that PoseChannels::clutter has in its middle bin
};

/// Its bin in the middle; a beam has as many bins as there are channels.
inline int middleBin(const EchoBeam& beam, int channels) { return beam.first_bin + channels / 2; }

/// A beam of range spectra [M][N], at its bins and at the window's middle.
Eigen::VectorXcd formBeam(const EchoBeam& beam, const Eigen::MatrixXcd& y);

/// Beams at the strongest of the paths that a pose is expected to receive, none beside another, from `first_bin` on. y
/// is left empty. None for radars of fewer than four channels.
std::vector<EchoBeam> chooseBeams(const RadarConfig& radar, const std::vector<PathRecord>& expected, int first_bin);

}  // namespace mmradartwin::diagnosis::channels
