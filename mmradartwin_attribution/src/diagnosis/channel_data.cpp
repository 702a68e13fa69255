#include "channel_data.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

/// Variance of one sample from frame to frame, by differences of neighbouring frames: what moves slowly does not count.
class FrameScatter {
 public:
  void add(const AdcCube& cube) {
    if (!last_.empty() && last_.size() == cube.data.size()) {
      double total = 0;
      for (std::size_t i = 0; i < last_.size(); ++i) {
        const double d = static_cast<double>(cube.data[i]) - last_[i];
        total += d * d;
      }
      differences_.push_back(total / static_cast<double>(last_.size()));  // of I and of Q: half a complex sample each
    }
    last_ = cube.data;
  }
  /// Of a complex sample, ADC counts^2: the median over frames, so that bursts do not count.
  double variance() {
    if (differences_.empty()) return 0;
    const auto middle = differences_.begin() + static_cast<std::ptrdiff_t>(differences_.size() / 2);
    std::nth_element(differences_.begin(), middle, differences_.end());
    return *middle;
  }

 private:
  std::vector<std::int16_t> last_;
  std::vector<double> differences_;
};

}  // namespace

void transformGrid(const SignalChain& chain, PoseChannels& pose) {
  const double window = sum(hannWindow(chain.radar().samples_per_chirp));
  pose.y = chain.rangeSpectra(pose.grid.x) / (window * pose.grid.full_scale);
}

ChannelData readChannels(const Recording& recording, const FrameVisitor& visit,
                         const std::function<void(std::size_t done, std::size_t all)>& on_progress) {
  ChannelData data;
  data.radar = recording.radar;
  data.problems = recording.problems;
  const SignalChain chain(recording.radar);
  const std::vector<double> window = hannWindow(recording.radar.samples_per_chirp);
  double window2 = 0;
  for (double w : window) window2 += w * w;
  const double per_sample = window2 / (sum(window) * sum(window) * 32768.0 * 32768.0);
  std::size_t done = 0;
  for (const Pose& pose : recording.poses) {
    try {
      CoherentAverage average(recording.radar, 0);
      FrameScatter scatter;
      recording.forEachFrame(pose, [&](const AdcCube& cube) {
        average.add(cube);
        scatter.add(cube);
        if (visit) visit(pose, cube);
      });
      if (!average.complete()) {
        throw InputError("its capture holds no valid chirp for some TDM slot; record it again");
      }
      PoseChannels channels;
      channels.pose = pose;
      channels.frames = average.frames();
      channels.grid = average.grid();
      const double chirps = static_cast<double>(channels.frames) * recording.radar.loops_per_frame;
      channels.noise_power = scatter.variance() * per_sample / chirps;
      transformGrid(chain, channels);
      if (!(channels.y.squaredNorm() > 0)) throw InputError("all its samples are zero; check the capture");
      const auto at = std::find(data.locations.begin(), data.locations.end(), pose.location);
      channels.location = static_cast<int>(at - data.locations.begin());
      if (at == data.locations.end()) data.locations.push_back(pose.location);
      data.poses.push_back(std::move(channels));
    } catch (const InputError& error) {
      const std::string prefix = "pose '" + pose.name + "': ", message = error.what();
      data.problems.push_back({pose.name, message.rfind(prefix, 0) == 0 ? message : prefix + message});
    }
    if (on_progress) on_progress(++done, recording.poses.size());
  }
  if (data.poses.empty()) {
    throw InputError(recording.source + ": no pose can be used" +
                     (data.problems.empty() ? "" : "; the first problem: " + data.problems.front().message));
  }
  return data;
}

}  // namespace mmradartwin
