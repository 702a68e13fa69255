#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// What the diagnosis knows of one pose: windowed range spectra of its coherent average, as complex channels.
struct PoseChannels {
  Pose pose;
  int location = 0;  ///< index of its place, for what is held out
  int frames = 0;
  ReceiveGrid grid;        ///< the average itself
  Eigen::MatrixXcd y;      ///< [M][N] range spectra over the window's sum and full scale: a tone's own amplitude
  double noise_power = 0;  ///< thermal power in a cell of y, from the scatter of the frames; 0 for a single frame
};

struct ChannelData {
  RadarConfig radar;
  std::vector<PoseChannels> poses;
  std::vector<std::string> locations;  ///< names, in order of appearance
  std::vector<PoseProblem> problems;   ///< poses left out, with the reason
};

/// Receives every frame of a pose as it is read; for a judge of raw samples.
using FrameVisitor = std::function<void(const Pose&, const AdcCube&)>;

/// Reads all captures once. Throws InputError where no pose is left.
ChannelData readChannels(const Recording& recording, const FrameVisitor& visit,
                         const std::function<void(std::size_t done, std::size_t all)>& on_progress);

/// Fills y of a pose from its grid (again, after the grid was changed).
class SignalChain;
void transformGrid(const SignalChain& chain, PoseChannels& pose);

}  // namespace mmradartwin
