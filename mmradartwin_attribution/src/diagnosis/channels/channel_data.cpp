#include "diagnosis/channels/channel_data.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/frames/payload_defects.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::channels {
namespace {

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

constexpr std::int64_t kRolls_ns = 500'000'000;  ///< time from either end of a stop within which a radar may still move
/// Time before or after a stop within which tf shows a moving radar elsewhere.
constexpr std::int64_t kBeside_ns = 1000'000'000;
constexpr double kFullScale = 32768;  ///< of a sample, in counts

/// True where tf has the radar away from the pose at some time between two times.
bool standsElsewhere(const std::vector<StampedTransform>& track, const Pose& pose, std::int64_t from_ns,
                     std::int64_t to_ns) {
  const auto before = [](const StampedTransform& t, std::int64_t stamp_ns) { return t.stamp_ns < stamp_ns; };
  return std::any_of(std::lower_bound(track.begin(), track.end(), from_ns, before),
                     std::lower_bound(track.begin(), track.end(), to_ns, before),
                     [&](const StampedTransform& t) { return !standsStill(t.T_map_radar, pose.T_map_radar); });
}

/// Leaves out frames at either end of a stop that differ from those in its middle. A radar counts as standing within 2
/// cm of its place of rest, which is five wavelengths.
void leaveOutMoving(const SignalChain& chain, const std::vector<StampedTransform>& track, const Pose& pose,
                    std::vector<AdcCube>& frames) {
  if (track.empty()) return;
  const std::int64_t begin_ns = frames.front().stamp_ns, end_ns = frames.back().stamp_ns;
  const bool came = standsElsewhere(track, pose, begin_ns - kBeside_ns, begin_ns);
  const bool goes = standsElsewhere(track, pose, end_ns, end_ns + kBeside_ns);
  if (!came && !goes) return;
  std::vector<ComplexGrid> spectra;
  for (const AdcCube& frame : frames) spectra.push_back(frameSpectra(chain, frame));
  const std::size_t quarter = frames.size() / 4;
  ComplexGrid middle;
  int count = 0;
  for (std::size_t i = quarter; i < frames.size() - quarter; ++i) {
    if (spectra[i].size() == 0) continue;
    middle = count == 0 ? spectra[i] : ComplexGrid(middle + spectra[i]);
    ++count;
  }
  if (count == 0) return;
  middle /= count;
  std::vector<double> change;
  for (const ComplexGrid& s : spectra) change.push_back(s.size() > 0 ? changeBetween(s, middle) : 0);
  const double least = std::max(bounds::kLeastChangeOfMovingFrame, bounds::kLeastMovingOverUsual * upperMedian(change));
  std::size_t first = 0, last = frames.size();
  while (came && first < quarter && change[first] > least && frames[first].stamp_ns < begin_ns + kRolls_ns) ++first;
  while (goes && frames.size() - last < quarter && change[last - 1] > least &&
         frames[last - 1].stamp_ns > end_ns - kRolls_ns) {
    --last;
  }
  frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(last), frames.end());
  frames.erase(frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(first));
}

/// True where packets were lost and not filled, so that a capture is too short.
bool missesPackets(const RadarConfig& radar, const std::vector<AdcCube>& frames) {
  const std::vector<int> order = payloadOrder(radar);
  Payload payload = toPayload(frames, order);
  markZeroedPackets(payload, order);
  return findSlip(payload).has_value();
}

}  // namespace

ComplexGrid frameSpectra(const SignalChain& chain, const AdcCube& frame) {
  CoherentAverage average(chain.radar(), 1);
  average.add(frame);
  return average.complete() ? chain.rangeSpectra(average.grid().x) : ComplexGrid();
}

double changeBetween(const ComplexGrid& a, const ComplexGrid& b) {
  const double power = a.squaredNorm() + b.squaredNorm();
  return power > 0 ? (a - b).squaredNorm() / power : 0;
}

void transformGrid(const SignalChain& chain, PoseChannels& pose) {
  const double window = sum(hannWindow(chain.radar().samples_per_chirp));
  pose.range_spectra = chain.rangeSpectra(pose.grid.x) / (window * pose.grid.full_scale);
}

namespace {

/// Frames of a pose, repaired and without those of a moving radar. Reports a capture that lacks packets. Throws
/// InputError where no frame can be used.
std::vector<AdcCube> readFrames(const Recording& recording, const SignalChain& chain, const Pose& pose,
                                const std::function<void(AdcCube&)>& repair, std::vector<PoseProblem>& problems) {
  std::vector<AdcCube> frames;
  try {
    recording.forEachFrame(pose, [&](const AdcCube& cube) {
      frames.push_back(cube);
      if (repair) repair(frames.back());
    });
  } catch (const TruncatedCapture& error) {
    if (frames.empty() || !missesPackets(recording.radar, frames)) throw;
    problems.push_back({pose.name, std::string(error.what()) + "; packets are missing in it, the rest was used"});
  }
  if (frames.empty()) throw InputError("its capture holds no frame; record it again");
  leaveOutMoving(chain, recording.track, pose, frames);
  const bool silent = std::all_of(frames.begin(), frames.end(), [](const AdcCube& cube) {
    return std::all_of(cube.data.begin(), cube.data.end(), [](std::int16_t v) { return v == 0; });
  });
  if (silent) throw InputError("all its samples are zero; check the capture");
  return frames;
}

/// Noise power in a cell of range_spectra over the noise variance of a sample in counts^2.
double cellNoiseOverSample(const RadarConfig& radar) {
  const std::vector<double> window = hannWindow(radar.samples_per_chirp);
  double window2 = 0;
  for (double w : window) window2 += w * w;
  return window2 / (sum(window) * sum(window) * kFullScale * kFullScale);
}

/// Variance of an average over `shots` alike samples, counts^2. variance: of a complex sample, the converter's rounding
/// within it. Rounding averages out as far as noise dithers it: Gaussian noise of deviation s (counts, in I and in Q)
/// leaves sum over k of exp(-4 pi^2 k^2 s^2) / (2 pi^2 k^2) of the 1/12 in each (Gray and Stockham, Dithered
/// quantizers, 1993, characteristic function of the rounding error).
double varianceOfAverage(double variance, int shots) {
  constexpr double kRounding = 1.0 / 12;
  const double dither = std::max(0.0, variance / 2 - kRounding);
  double left = 0;
  for (int k = 1; k <= 100; ++k) {
    left += std::exp(-4 * M_PI * M_PI * k * k * dither) / (2 * M_PI * M_PI * k * k);
  }
  return (variance - 2 * left) / shots + 2 * left;
}

/// Channels of a pose from its frames and the examiner's result.
PoseChannels channelsOf(const Recording& recording, const SignalChain& chain, const Pose& pose,
                        const std::vector<AdcCube>& frames, const PoseFrames& examined) {
  CoherentAverage uncorrected(recording.radar, 0);
  for (const AdcCube& cube : frames) uncorrected.add(cube);
  PoseChannels channels;
  channels.pose = pose;
  channels.grid = examined.mean;
  channels.moving = examined.moving;
  if (uncorrected.complete()) channels.uncorrected_average = uncorrected.grid();
  channels.shots = std::max(1, examined.shots);
  std::vector<double> of_shot = examined.noise_variance, noise;
  for (const double variance : of_shot) noise.push_back(varianceOfAverage(variance, channels.shots));
  if (recording.channels) {
    correctChannels(*recording.channels, channels.grid.x);
    if (uncorrected.complete()) correctChannels(*recording.channels, channels.uncorrected_average.x);
    for (std::size_t k = 0; k < noise.size(); ++k) {
      noise[k] /= std::norm(recording.channels->error(k));
      of_shot[k] /= std::norm(recording.channels->error(k));
      for (MovingCell& cell : channels.moving) {
        cell.channels[static_cast<Eigen::Index>(k)] /= recording.channels->error(k);
      }
    }
  }
  const double per_cell = cellNoiseOverSample(recording.radar) / static_cast<double>(noise.size());
  channels.noise_power = per_cell * sum(noise);
  channels.shot_noise_power = per_cell * sum(of_shot);
  channels.unsteadiness = examined.unsteadiness;
  transformGrid(chain, channels);
  return channels;
}

}  // namespace

ChannelData readChannels(const Recording& recording, FrameExaminer& examiner, const ReadingProgress& on_progress,
                         const std::function<void(AdcCube&)>& repair) {
  ChannelData data;
  data.radar = recording.radar;
  data.problems = recording.problems;
  const SignalChain chain(recording.radar);
  std::size_t done = 0;
  for (const Pose& pose : recording.poses) {
    try {
      const std::vector<AdcCube> frames = readFrames(recording, chain, pose, repair, data.problems);
      examiner.addPose(pose, frames);
      data.poses.push_back(channelsOf(recording, chain, pose, frames, examiner.poses().back()));
    } catch (const InputError& error) {
      const std::string message = error.what();
      const bool named = message.rfind("pose '" + pose.name, 0) == 0 || message.rfind("pose " + pose.name, 0) == 0;
      data.problems.push_back({pose.name, named ? message : "pose '" + pose.name + "': " + message});
    }
    if (on_progress) on_progress(++done, recording.poses.size());
  }
  if (data.poses.empty()) {
    throw InputError(recording.source + ": no pose can be used" +
                     (data.problems.empty() ? "" : "; the first problem: " + data.problems.front().message));
  }
  numberLocations(data);
  return data;
}

void numberLocations(ChannelData& data) {
  data.locations.clear();
  for (PoseChannels& p : data.poses) {
    const auto known = std::find(data.locations.begin(), data.locations.end(), p.pose.location);
    p.location = static_cast<int>(known - data.locations.begin());
    if (known == data.locations.end()) data.locations.push_back(p.pose.location);
  }
}

}  // namespace mmradartwin::diagnosis::channels
