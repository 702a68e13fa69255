#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "diagnosis/frames/payload_defects.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"

namespace mmradartwin::diagnosis::frames {

/// Samples of one pose in ADC counts, [shot][channel][sample]; a shot is one loop of one frame. Unusable values are
/// zero and do not count.
struct FrameStack {
  /// order: payloadOrder() of the radar.
  FrameStack(const RadarConfig& radar, const Payload& payload, const std::vector<int>& order);

  int frames = 0, loops = 0, slots = 0, receivers = 0, samples = 0;
  std::vector<std::complex<float>> x;
  std::vector<std::uint8_t> use;  ///< 0 for an unusable value

  int shots() const { return frames * loops; }
  int channels() const { return slots * receivers; }
  std::size_t values() const { return static_cast<std::size_t>(channels()) * static_cast<std::size_t>(samples); }
  std::size_t at(int shot, int channel, int sample) const {
    return static_cast<std::size_t>(shot) * values() + static_cast<std::size_t>(channel) * samples + sample;
  }
};

/// Counts of I and Q values at one end of the codes of a pose. The same sample of all shots counts as one.
struct RailCounts {
  int code = 0;           ///< outermost code that occurred
  double at_code = 0;     ///< values with that code
  double next_codes = 0;  ///< values per code among up to 16 codes next to it; infinite where the codes are too few
};
/// Both ends of the codes.
struct Rails {
  RailCounts high, low;
  double samples = 0;  ///< I and Q values counted
};
Rails countRails(const FrameStack& stack);
/// Nats by which values accumulate at the outermost code beyond a sine of that amplitude (2.4 times the density next to
/// it). The code clips where it is positive.
double pileUp(const RailCounts& counts);

/// Median over shots of I and of Q per channel and sample, [M][N] channel-major: an average that single shots do not
/// affect.
std::vector<std::complex<float>> medianShot(const FrameStack& stack);
/// Mean over shots per channel and sample, [M][N] channel-major.
std::vector<std::complex<float>> meanShot(const FrameStack& stack);
/// Complex gain of every shot that fits it best to the average; 1 where the average does not exceed the noise.
/// noise_variance: of a complex sample.
std::vector<std::complex<float>> commonGains(const FrameStack& stack, const std::vector<std::complex<float>>& average,
                                             double noise_variance);
/// Noise variance of a complex sample from differences of successive shots: the median over range bins, which moving
/// echoes do not affect, then over shots and channels; at least that of rounding.
double differenceVariance(const FrameStack& stack);

/// Rotates the phase of frame f by f times an angle.
void turnFrames(double rad_per_frame, FrameStack& stack);

/// Chirps with interference.
struct Bursts {
  int frames = 0;      ///< with usable values
  int hit_frames = 0;  ///< with a burst
  double log_likelihood_gain = 0;
  std::vector<std::uint8_t> hit;  ///< [shot][slot] 1 for discarded chirps
};
/// Finds and discards chirps with energy in a part of the chirp that is one wave at all receivers and wider than the
/// few range bins of an echo.
Bursts dropBursts(const std::vector<std::complex<float>>& average, double noise_variance, FrameStack& stack);

/// Values at an outermost code that clips.
struct ClippedValues {
  std::vector<std::pair<std::size_t, std::uint8_t>> at;  ///< index in the stack, and how many of I and Q
  double limit = 0;                                      ///< magnitude of the nearer one of both codes
};
ClippedValues clippedValues(const Rails& rails, const FrameStack& stack);
/// Mean of the clipped values at each index of a shot, as delivered.
std::map<std::size_t, std::complex<float>> clippedMeans(const ClippedValues& clipped, const FrameStack& stack);
/// Discards clipped values where the average is close to the limit, too.
void dropStandingClipped(const ClippedValues& clipped, const std::vector<std::complex<float>>& average,
                         FrameStack& stack);
/// Number of clipped I and Q values per shot, and of all that were judged.
struct ClippedCount {
  double clipped = 0, counted = 0;
};
/// Discards the remaining clipped values and counts those that no burst drove beyond the limit.
ClippedCount countClipped(const ClippedValues& clipped, const Bursts& bursts, FrameStack& stack);

}  // namespace mmradartwin::diagnosis::frames
