#include "mmradartwin_dsp/range_doppler.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <numeric>
#include <unsupported/Eigen/FFT>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// Level of a cell without any signal, as in range-angle maps.
constexpr double kEmpty_db = -400;

void requireShape(const RadarConfig& radar, const AdcCube& cube) {
  const std::size_t values = static_cast<std::size_t>(radar.chirps_per_frame()) *
                             static_cast<std::size_t>(radar.samples_per_chirp) *
                             static_cast<std::size_t>(radar.receivers()) * 2;
  if (cube.chirps == radar.chirps_per_frame() && cube.samples == radar.samples_per_chirp &&
      cube.receivers == radar.receivers() && cube.data.size() == values &&
      cube.chirp_valid.size() == static_cast<std::size_t>(cube.chirps)) {
    return;
  }
  throw InputError("frame " + std::to_string(cube.sequence) + " has " + std::to_string(cube.chirps) + " chirps x " +
                   std::to_string(cube.samples) + " samples x " + std::to_string(cube.receivers) +
                   " receivers, the radar's frames have another shape");
}

/// Loops of a slot whose chirp arrived.
std::vector<int> arrivedLoops(const AdcCube& cube, int slot, int slots) {
  std::vector<int> loops;
  for (int chirp = slot; chirp < cube.chirps; chirp += slots) {
    if (cube.chirp_valid[static_cast<std::size_t>(chirp)]) loops.push_back(chirp / slots);
  }
  if (loops.empty()) {
    throw InputError("frame " + std::to_string(cube.sequence) + " has no valid chirp of slot " + std::to_string(slot));
  }
  return loops;
}

}  // namespace

std::string whyNoSpeeds(const RadarConfig& radar) {
  if (radar.loops_per_frame < kLeastDopplerLoops) {
    return "frames have " + std::to_string(radar.loops_per_frame) + (radar.loops_per_frame == 1 ? " loop" : " loops") +
           ", and speeds need " + std::to_string(kLeastDopplerLoops) + " or more (loops_per_frame)";
  }
  if (!std::isfinite(radar.chirp_period_s())) {
    return "the period of chirps is not known: state idle_s and ramp_end_s in radar.yaml";
  }
  return "";
}

int DopplerGrids::binsFromStill(std::size_t bin) const {
  return std::abs(static_cast<int>(bin) - static_cast<int>(grids.size()) / 2);
}

DopplerGrids dopplerGrids(const RadarConfig& radar, const AdcCube& cube, const ChannelCorrection* correction) {
  if (const std::string why = whyNoSpeeds(radar); !why.empty()) throw InputError("no speeds: " + why);
  requireShape(radar, cube);
  const int loops = radar.loops_per_frame, slots = radar.slots(), receivers = radar.receivers();
  const int samples = radar.samples_per_chirp, first = -(loops / 2);
  std::vector<double> window = hannWindow(loops);
  const double sum = std::accumulate(window.begin(), window.end(), 0.0);
  for (double& w : window) w /= sum;
  DopplerGrids frame;
  const double bin_m_per_s = radar.wavelength_m() / (2 * loops * slots * radar.chirp_period_s());
  frame.grids.resize(static_cast<std::size_t>(loops));
  for (int d = first; d < first + loops; ++d) frame.radial_speed_m_per_s.push_back(d * bin_m_per_s);
  for (ReceiveGrid& grid : frame.grids) {
    grid.stamp_ns = cube.stamp_ns;
    grid.frames = 1;
    grid.x.resize(radar.channels(), samples);
  }
  Eigen::FFT<double> fft(Eigen::FFT<double>::impl_type(), Eigen::FFT<double>::Unscaled);
  std::vector<std::complex<double>> in(static_cast<std::size_t>(loops)), out(in);
  for (int slot = 0; slot < slots; ++slot) {
    const std::vector<int> arrived = arrivedLoops(cube, slot, slots);
    std::vector<std::complex<double>> turn;  // by bin of the transform
    for (int d = 0; d < loops; ++d) {
      const int signed_bin = d < loops + first ? d : d - loops;
      turn.push_back(std::polar(1.0, -2 * M_PI * signed_bin * slot / (static_cast<double>(loops) * slots)));
    }
    for (int rx = 0; rx < receivers; ++rx) {
      for (int n = 0; n < samples; ++n) {
        const auto value = [&](int loop) {
          const auto i = static_cast<std::size_t>(((loop * slots + slot) * samples + n) * receivers + rx) * 2;
          return std::complex<double>(cube.data[i], cube.data[i + 1]);
        };
        std::complex<double> mean = 0;
        for (int loop : arrived) mean += value(loop);
        mean /= static_cast<double>(arrived.size());
        std::transform(window.begin(), window.end(), in.begin(), [&](double w) { return w * mean; });
        for (int loop : arrived)
          in[static_cast<std::size_t>(loop)] = window[static_cast<std::size_t>(loop)] * value(loop);
        fft.fwd(out.data(), in.data(), loops);
        for (int d = 0; d < loops; ++d) {
          const int place = (d < loops + first ? d : d - loops) - first;
          frame.grids[static_cast<std::size_t>(place)].x(slot * receivers + rx, n) =
              out[static_cast<std::size_t>(d)] * turn[static_cast<std::size_t>(d)];
        }
      }
    }
  }
  if (correction) {
    for (ReceiveGrid& grid : frame.grids) correctChannels(*correction, grid.x);
  }
  return frame;
}

RangeDopplerMap rangeDopplerMap(const SignalChain& chain, const DopplerGrids& frame) {
  RangeDopplerMap map;
  map.range_m = chain.axes().range_m;
  map.radial_speed_m_per_s = frame.radial_speed_m_per_s;
  map.power_db.resize(static_cast<Eigen::Index>(map.range_m.size()), static_cast<Eigen::Index>(frame.grids.size()));
  const std::vector<double> window = hannWindow(chain.radar().samples_per_chirp);
  const double window_sum = std::accumulate(window.begin(), window.end(), 0.0);
  for (std::size_t d = 0; d < frame.grids.size(); ++d) {
    const ReceiveGrid& grid = frame.grids[d];
    map.stamp_ns = grid.stamp_ns;
    const double full_scale = window_sum * grid.full_scale;
    map.power_db.col(static_cast<Eigen::Index>(d)) =
        (10 * (chain.rangeSpectra(grid.x).cwiseAbs2().colwise().mean().array() / (full_scale * full_scale)).log10())
            .max(kEmpty_db)
            .transpose();
  }
  return map;
}

}  // namespace mmradartwin
