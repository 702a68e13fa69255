#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin::diagnosis::frames {

/// Range spectra of the shots of one pose about their mean over all shots, in units of the noise.
struct ShotSpectra {
  int channels = 0, bins = 0, loops = 0, frames = 0;
  std::vector<int> shot;                                 ///< indices of the shots: frame x loops + loop
  const std::vector<std::complex<float>>* values = {};   ///< [shot][bin][channel]
  const std::vector<std::complex<float>>* average = {};  ///< [bin][channel] what stands
  bool has_laws = false;                                 ///< frames' laws were taken out, up to a remainder
};

/// Number with its 95 % interval.
struct Bounded {
  double value = 0, low = 0, high = 0;
};

/// Straight walk through successive frames of one pose, in the radar's frame.
struct WalkTrack {
  int first_frame = 0, last_frame = 0;
  double middle_s = 0;                  ///< time of range_m and azimuth_rad, from the start of the pose's first frame
  double range_m = 0, azimuth_rad = 0;  ///< at middle_s
  double across_m_per_s = 0;            ///< to the left of the line of sight, at middle_s
  double across_error_m_per_s = 0;      ///< standard error of it
  double radial_m_per_s = 0;            ///< away from the radar, the likeliest, at middle_s
  std::optional<Bounded> radial;        ///< empty where the recording tells no speed from others
  std::vector<double> other_m_per_s;    ///< speeds that are as likely
  double nats = 0;                      ///< over a pose where this does not move
  std::vector<double> snr;              ///< [frame from first to last] power over noise after all transforms
  /// Range and azimuth at a time from the start of the pose's first frame.
  Eigen::Vector2d at(double time_s) const;
};

/// True where frames have enough loops, and are enough, to show how a walker moves.
bool canTrackWalkers(const RadarConfig& radar, int frames);
/// True where frames are enough to show a walk through range bins, whatever their loops.
bool canTrackLongWays(int frames);
/// Walkers that cross the frames of one pose, strongest first. Where
/// canTrackWalkers() is false only those whose way through range bins is long.
std::vector<WalkTrack> trackWalkers(const RadarConfig& radar, const ShotSpectra& spectra);

}  // namespace mmradartwin::diagnosis::frames
