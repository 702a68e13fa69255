#include "mmradartwin_dsp/coherent_average.h"

#include <algorithm>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

CoherentAverage::CoherentAverage(const RadarConfig& radar, int max_frames)
    : radar_(radar),
      max_frames_(max_frames),
      sum_(static_cast<std::size_t>(radar.channels()) * static_cast<std::size_t>(radar.samples_per_chirp) * 2),
      weight_(static_cast<std::size_t>(radar.slots())) {}

void CoherentAverage::sumOverLoops(const AdcCube& cube, Frame& frame) const {
  const int slots = radar_.slots();
  const auto receivers = static_cast<std::size_t>(radar_.receivers());
  const auto samples = static_cast<std::size_t>(radar_.samples_per_chirp);
  frame.stamp_ns = cube.stamp_ns;
  frame.sum.assign(sum_.size(), 0);
  frame.weight.assign(weight_.size(), 0);
  // Loops are summed as the samples lie, [slot][sample][rx], and brought to [slot][rx][sample] once at the end.
  const std::size_t per_chirp = samples * receivers * 2;
  std::vector<std::int32_t> sum(per_chirp);
  for (int slot = 0; slot < slots; ++slot) {
    std::fill(sum.begin(), sum.end(), 0);
    for (int chirp = slot; chirp < cube.chirps; chirp += slots) {
      if (!cube.chirp_valid[static_cast<std::size_t>(chirp)]) continue;
      ++frame.weight[static_cast<std::size_t>(slot)];
      const std::int16_t* in = cube.data.data() + static_cast<std::size_t>(chirp) * per_chirp;
      for (std::size_t i = 0; i < per_chirp; ++i) sum[i] += in[i];
    }
    std::int32_t* out = frame.sum.data() + static_cast<std::size_t>(slot) * per_chirp;
    for (std::size_t n = 0; n < samples; ++n) {
      for (std::size_t rx = 0; rx < receivers; ++rx) {
        out[2 * (rx * samples + n)] = sum[2 * (n * receivers + rx)];
        out[2 * (rx * samples + n) + 1] = sum[2 * (n * receivers + rx) + 1];
      }
    }
  }
}

void CoherentAverage::add(const AdcCube& cube) {
  if (cube.chirps != radar_.chirps_per_frame() || cube.samples != radar_.samples_per_chirp ||
      cube.receivers != radar_.receivers() ||
      cube.data.size() != sum_.size() * static_cast<std::size_t>(radar_.loops_per_frame) ||
      cube.chirp_valid.size() != static_cast<std::size_t>(cube.chirps)) {
    throw InputError("frame " + std::to_string(cube.sequence) + " has " + std::to_string(cube.chirps) + " chirps x " +
                     std::to_string(cube.samples) + " samples x " + std::to_string(cube.receivers) +
                     " receivers; the radar's frames have " + std::to_string(radar_.chirps_per_frame()) + " x " +
                     std::to_string(radar_.samples_per_chirp) + " x " + std::to_string(radar_.receivers()) +
                     ": give the radar.yaml that it was recorded with");
  }
  Frame frame;
  if (max_frames_ > 0 && frames_ == max_frames_) {
    frame = std::move(window_.front());  // its memory serves again
    window_.pop_front();
    for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] -= frame.sum[i];
    for (std::size_t slot = 0; slot < weight_.size(); ++slot) weight_[slot] -= frame.weight[slot];
    --frames_;
  }
  sumOverLoops(cube, frame);
  for (std::size_t i = 0; i < sum_.size(); ++i) sum_[i] += frame.sum[i];
  for (std::size_t slot = 0; slot < weight_.size(); ++slot) weight_[slot] += frame.weight[slot];
  stamp_ns_ = cube.stamp_ns;
  ++frames_;
  if (max_frames_ > 0) window_.push_back(std::move(frame));
}

void CoherentAverage::reset() {
  window_.clear();
  std::fill(sum_.begin(), sum_.end(), 0);
  std::fill(weight_.begin(), weight_.end(), 0);
  frames_ = 0;
}

int CoherentAverage::frames() const { return frames_; }

bool CoherentAverage::complete() const {
  return std::all_of(weight_.begin(), weight_.end(), [](std::int64_t weight) { return weight > 0; });
}

ReceiveGrid CoherentAverage::grid() const {
  const auto receivers = static_cast<std::size_t>(radar_.receivers());
  const auto samples = static_cast<std::size_t>(radar_.samples_per_chirp);
  ReceiveGrid grid;
  grid.stamp_ns = stamp_ns_;
  grid.source = Branch::kMeasured;
  grid.full_scale = 32768.0;
  grid.frames = frames_;
  grid.x.resize(radar_.channels(), radar_.samples_per_chirp);
  std::complex<double>* out = grid.x.data();
  const std::int64_t* in = sum_.data();
  for (std::size_t slot = 0; slot < weight_.size(); ++slot) {
    if (weight_[slot] == 0) {
      throw InputError("no valid chirp of slot " + std::to_string(slot) + " in " + std::to_string(frames_) +
                       " frame(s): all were lost or none came; record again or average more frames");
    }
    // Divided, not multiplied by a reciprocal: an average of equal samples is then that sample exactly.
    const auto weight = static_cast<double>(weight_[slot]);
    for (std::size_t i = 0; i < receivers * samples; ++i, in += 2) {
      *out++ = {static_cast<double>(in[0]) / weight, static_cast<double>(in[1]) / weight};
    }
  }
  return grid;
}

}  // namespace mmradartwin
