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

/// Data of one pose that the diagnosis judges: windowed range spectra of its coherent average, as complex channels.
struct PoseChannels {
  Pose pose;
  int location = 0;  ///< index of its location in ChannelData::locations; locations are held out as a whole
  ReceiveGrid grid;  ///< average of the frames without damaged samples
  /// Average of all frames as delivered, which other programs show; empty where a slot has no valid chirp.
  ReceiveGrid uncorrected_average;
  /// Range spectra [M][N] over the window's sum and full scale: a tone has its own amplitude there.
  Eigen::MatrixXcd range_spectra;
  int shots = 1;  ///< frames times loops of the average
  std::vector<EchoBeam> beams;
  BinCovariance clutter;   ///< covariance of clutter in all bins, see clutter_field.h
  double noise_power = 0;  ///< in a cell of range_spectra, from the scatter of the frames and the converter's rounding
  double shot_noise_power = 0;  ///< the same in a spectrum of one shot
  /// Factor [N] on the noise power in bins whose frames scatter more, since moving echoes partly remain in the average.
  /// Empty where nothing moves.
  std::vector<double> unsteadiness;
  std::vector<MovingCell> moving;
};

/// Data of a session.
struct ChannelData {
  RadarConfig radar;
  std::vector<PoseChannels> poses;
  std::vector<std::string> locations;  ///< names, in order of appearance
  std::vector<PoseProblem> problems;   ///< poses left out, with the reason
};

/// Called after each pose, with the number of poses done and of all.
using ReadingProgress = std::function<void(std::size_t done, std::size_t all)>;
/// Reads all captures once and passes frames through the examiner, whose averages are used. repair: changes each frame
/// before any other step. Throws InputError where no pose is left.
ChannelData readChannels(const Recording& recording, FrameExaminer& examiner, const ReadingProgress& on_progress,
                         const std::function<void(AdcCube&)>& repair = {});

/// Numbers the locations of the poses in order of appearance and removes locations without a pose.
void numberLocations(ChannelData& data);

/// Windowed range spectra [M][N] of a frame's average over its loops, in ADC counts; empty where a slot has no valid
/// chirp. Throws InputError where the frame does not have the radar's shape.
ComplexGrid frameSpectra(const SignalChain& chain, const AdcCube& frame);
/// Difference |a - b|^2 / (|a|^2 + |b|^2) of two spectra of a radar: 0 for equal spectra, about 1 for uncorrelated
/// ones.
double changeBetween(const ComplexGrid& a, const ComplexGrid& b);
/// Fills the range spectra of a pose from its grid; to be called again after a change of the grid.
void transformGrid(const SignalChain& chain, PoseChannels& pose);

}  // namespace mmradartwin::diagnosis::channels
