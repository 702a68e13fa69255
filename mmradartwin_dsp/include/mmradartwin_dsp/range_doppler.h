#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/channel_correction.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin {

/// With fewer loops an echo that stands still fills most bins of speed, through the window.
constexpr int kLeastDopplerLoops = 8;
/// Bins of speed to either side of 0 into which Hann's window spreads what stands still, and one more for its flicker.
constexpr int kStillBins = 2;

/// Why frames of this radar tell no speeds, for its user; "" where they do: it takes kLeastDopplerLoops loops and the
/// period of chirps (idle_s and ramp_end_s).
std::string whyNoSpeeds(const RadarConfig& radar);

/// The samples of one frame by radial speed.
struct DopplerGrids {
  std::vector<double> radial_speed_m_per_s;  ///< centres of the bins, ascending; positive: the range grows
  /// One grid per bin, in ADC counts: the mean over loops under Hann's window, turned so that an echo of that speed
  /// adds up with its own amplitude. Its maps are range-angle maps of what moves at that speed.
  std::vector<ReceiveGrid> grids;
  /// How many bins lie between a bin and speed 0.
  int binsFromStill(std::size_t bin) const;
};

/// Doppler transform of one frame: x_d[k, n] = sum_l h[l]/sum(h) x[l, k, n] exp(-j 2 pi d (l + s/S)/L) with loop l of
/// L, slot s of S of channel k and bin d from -L/2 on; its speed is d lambda_c/(2 L S T), T the period of chirps. The
/// transmitters take turns (TDM), so the phase that an echo gains from slot to slot is taken out by the term s/S: the
/// virtual array stays whole, and speeds are unambiguous up to lambda_c/(4 S T). A lost chirp is taken to be the mean
/// of its slot's others, which keeps what stands still at speed 0. Richards, Fundamentals of Radar Signal Processing,
/// ch. 5. Throws InputError where whyNoSpeeds() says why, where the cube's shape is not the radar's, and where all
/// chirps of a slot are lost. correction: null for none.
DopplerGrids dopplerGrids(const RadarConfig& radar, const AdcCube& cube, const ChannelCorrection* correction);

struct RangeDopplerMap {
  std::int64_t stamp_ns = 0;
  std::vector<double> range_m;               ///< [N]
  std::vector<double> radial_speed_m_per_s;  ///< [L]
  RealGrid power_db;                         ///< [N][L] dBFS, not normalised; -400 where nothing is
};
/// 10 log10 of the mean over channels of |X_k|^2/(sum(w) full_scale)^2: an echo has the level that it has in a
/// range-angle map, noise that of one channel.
RangeDopplerMap rangeDopplerMap(const SignalChain& chain, const DopplerGrids& frame);

}  // namespace mmradartwin
