#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "diagnosis/channels/echo_beam.h"
#include "diagnosis/frames/frame_examiner.h"
#include "diagnosis/numbers/bin_covariance.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin::diagnosis::channels {

/// What the diagnosis knows of one pose: windowed range spectra of its coherent average, as complex channels.
struct PoseChannels {
  Pose pose;
  int location = 0;  ///< index of its place, for what is held out
  ReceiveGrid grid;  ///< the average itself, of what is whole
  /// The average of all frames as they came, which other programs show; empty where a slot has none.
  ReceiveGrid plain;
  Eigen::MatrixXcd y;  ///< [M][N] range spectra over the window's sum and full scale: a tone's own amplitude
  int shots = 1;       ///< frames times loops behind the average
  std::vector<EchoBeam> beams;
  BinCovariance clutter;   ///< of all bins: see clutter_field.h
  double noise_power = 0;  ///< thermal power in a cell of y, from the scatter of the frames
  /// [N] factor of it in bins where frames scatter by more, as what moves leaves some of itself in their average; empty
  /// where nothing moves.
  std::vector<double> unsteadiness;
  std::vector<MovingCell> moving;
};

struct ChannelData {
  RadarConfig radar;
  std::vector<PoseChannels> poses;
  std::vector<std::string> locations;  ///< names, in order of appearance
  std::vector<PoseProblem> problems;   ///< poses left out, with the reason
};

/// Reads all captures once, frames through the examiner, whose repaired averages are taken. Throws InputError where no
/// pose is left.
using ReadingProgress = std::function<void(std::size_t done, std::size_t all)>;
/// `repair`: of each frame before anything looks at it.
ChannelData readChannels(const Recording& recording, FrameExaminer& examiner, const ReadingProgress& on_progress,
                         const std::function<void(AdcCube&)>& repair = {});

/// Numbers the places of the poses that there are, in order of appearance, and keeps the names of these alone.
void numberLocations(ChannelData& data);

/// Windowed range spectra [M][N] of one frame's average over its loops, in ADC counts; empty where a slot has no valid
/// chirp. Throws InputError where it has not the radar's shape.
ComplexGrid frameSpectra(const SignalChain& chain, const AdcCube& frame);
/// How much two of a radar's spectra differ: |a - b|^2 / (|a|^2 + |b|^2), 0 where they are the same, about 1 where they
/// have nothing in common.
double changeBetween(const ComplexGrid& a, const ComplexGrid& b);
/// The middle one of the values, of an even number the greater of the two; at least one.
double upperMedian(std::vector<double> values);
/// Fills y of a pose from its grid (again, after the grid was changed).
void transformGrid(const SignalChain& chain, PoseChannels& pose);

}  // namespace mmradartwin::diagnosis::channels
