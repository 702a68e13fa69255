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

/// All samples of one pose in ADC counts, [shot][channel][sample]; a shot is one loop of one frame. Values that are not
/// to be used count nowhere.
struct FrameStack {
  FrameStack(const RadarConfig& radar, const Payload& payload, const std::vector<int>& order);

  int frames = 0, loops = 0, slots = 0, receivers = 0, samples = 0;
  std::vector<std::complex<float>> x;
  std::vector<std::uint8_t> use;

  int shots() const { return frames * loops; }
  int channels() const { return slots * receivers; }
  std::size_t values() const { return static_cast<std::size_t>(channels()) * static_cast<std::size_t>(samples); }
  std::size_t at(int shot, int channel, int sample) const {
    return static_cast<std::size_t>(shot) * values() + static_cast<std::size_t>(channel) * samples + sample;
  }
};

/// How often the outermost codes of a pose's I and Q values come, in frames of samples (the same sample of all frames
/// counts as one).
struct RailCounts {
  int code = 0;           ///< outermost that was seen
  double at_code = 0;     ///< samples with it
  double next_codes = 0;  ///< samples per code among up to 16 codes inside of it
};
struct Rails {
  RailCounts high, low;
  double samples = 0;  ///< I and Q values counted
};
Rails countRails(const FrameStack& stack);
/// More often at its outermost code than a sine of that amplitude is (2.4 times the density inside), and by what
/// log-likelihood: the code clips.
double pileUp(const RailCounts& counts);

/// Robust average over shots per channel and sample: the median of I and of Q, [M][N] channel-major.
std::vector<std::complex<float>> medianShot(const FrameStack& stack);
std::vector<std::complex<float>> meanShot(const FrameStack& stack);
/// Fits every shot's common complex gain to the template, as far as the template stands out of the noise (variance of a
/// complex sample). 1 where it does not.
std::vector<std::complex<float>> commonGains(const FrameStack& stack, const std::vector<std::complex<float>>& average,
                                             double noise_variance);
/// Variance of a complex sample by differences of successive shots: the median over range bins, which what moves does
/// not reach, shots and slots, never below what rounding leaves.
double differenceVariance(const FrameStack& stack);

/// Turns every frame by so much more than the one before.
void turnFrames(double rad_per_frame, FrameStack& stack);

struct Bursts {
  int frames = 0;      ///< with samples to look at
  int hit_frames = 0;  ///< with a burst
  double log_likelihood_gain = 0;
  std::vector<std::uint8_t> hit;  ///< [shot][slot] chirps taken out of use
};
/// Finds energy that is confined to a part of one chirp, the same wave at all receivers and no echo's few range bins,
/// and takes the chirp out of use.
Bursts dropBursts(const std::vector<std::complex<float>>& average, double noise_variance, FrameStack& stack);

/// Values that stand at a code beyond which there is none, where that code comes far more often than its neighbours.
struct ClippedValues {
  std::vector<std::pair<std::size_t, std::uint8_t>> at;  ///< place in the stack, and how many of I and Q
  double limit = 0;                                      ///< the nearer of both codes, as a size
};
ClippedValues clippedValues(const Rails& rails, const FrameStack& stack);
/// By place in a shot: mean over the shots in which it is clipped, as it was delivered.
std::map<std::size_t, std::complex<float>> clippedMeans(const ClippedValues& clipped, const FrameStack& stack);
/// Takes clipped values out of use where the average comes to the limit too.
void dropStandingClipped(const ClippedValues& clipped, const std::vector<std::complex<float>>& average,
                         FrameStack& stack);
/// Takes the others out of use and counts those that no burst drove beyond the limit: I and Q values per shot, and how
/// many were looked at.
void countClipped(const ClippedValues& clipped, const Bursts& bursts, FrameStack& stack, double& values, double& of);

}  // namespace mmradartwin::diagnosis::frames
