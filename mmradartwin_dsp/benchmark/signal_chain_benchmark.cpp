// What one frame costs: cube -> sliding average -> map, with the bare transforms and a memcpy beside it as the floor.

#include <benchmark/benchmark.h>

#include <cstring>
#include <random>
#include <unsupported/Eigen/FFT>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

/// The paper's radar with a number of loops: 1 is its frame of 2 kB, 128 one of 256 kB.
RadarConfig radarWithLoops(int loops) {
  RadarConfig radar = parseRadarConfig(
      "{device: awr2243, carrier_hz: 77.0e+9, slope_hz_per_s: 75.0e+12, samples_per_chirp: 64, sample_rate_hz: 5.0e+6, "
      "adc_start_s: 6.0e-6, loops_per_frame: 1, frame_period_s: 0.05, tx_position_m: [[0, 0, 0], [0, 0.0077867, 0]], "
      "rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]}",
      "radar.yaml");
  radar.loops_per_frame = loops;
  return radar;
}

AdcCube randomCube(const RadarConfig& radar) {
  AdcCube cube;
  cube.chirps = radar.chirps_per_frame();
  cube.samples = radar.samples_per_chirp;
  cube.receivers = radar.receivers();
  std::mt19937 random(1);
  cube.data.resize(static_cast<std::size_t>(cube.chirps * cube.samples * cube.receivers * 2));
  for (std::int16_t& sample : cube.data) sample = static_cast<std::int16_t>(random());
  cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
  return cube;
}

void CubeToMap(benchmark::State& state) {
  const RadarConfig radar = radarWithLoops(static_cast<int>(state.range(0)));
  const AdcCube cube = randomCube(radar);
  const SignalChain chain(radar);
  CoherentAverage average(radar, 100);
  for (auto _ : state) {
    average.add(cube);
    benchmark::DoNotOptimize(chain.map(average.grid()));
  }
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(CubeToMap)->Arg(1)->Arg(128)->Unit(benchmark::kMicrosecond);

void SlidingAverage(benchmark::State& state) {
  const RadarConfig radar = radarWithLoops(1);
  const AdcCube cube = randomCube(radar);
  CoherentAverage average(radar, static_cast<int>(state.range(0)));
  for (auto _ : state) average.add(cube);
}
BENCHMARK(SlidingAverage)->Arg(10)->Arg(100)->Arg(1000)->Unit(benchmark::kMicrosecond);

void GridToMap(benchmark::State& state) {
  const RadarConfig radar = radarWithLoops(1);
  CoherentAverage average(radar, 1);
  average.add(randomCube(radar));
  const ReceiveGrid grid = average.grid();
  const SignalChain chain(radar);
  for (auto _ : state) benchmark::DoNotOptimize(chain.map(grid));
}
BENCHMARK(GridToMap)->Unit(benchmark::kMicrosecond);

/// The 8 + 64 transforms of length 64 that a map needs, and nothing else.
void BareTransforms(benchmark::State& state) {
  Eigen::FFT<double> fft(Eigen::FFT<double>::impl_type(), Eigen::FFT<double>::Unscaled);
  std::vector<std::complex<double>> in(64, 1.0), out(64);
  for (auto _ : state) {
    for (int i = 0; i < 8; ++i) fft.fwd(out.data(), in.data(), 64);
    for (int i = 0; i < 64; ++i) fft.inv(out.data(), in.data(), 64);
    benchmark::DoNotOptimize(out.data());
  }
}
BENCHMARK(BareTransforms)->Unit(benchmark::kMicrosecond);

void Decode(benchmark::State& state) {
  RadarConfig radar = radarWithLoops(128);
  radar.layout = state.range(0) == 2 ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  const std::vector<std::uint8_t> bytes = encodeFrame(radar, randomCube(radar).data);
  std::vector<std::int16_t> samples;
  for (auto _ : state) {
    decodeFrame(radar, bytes.data(), samples);
    benchmark::DoNotOptimize(samples.data());
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
}
BENCHMARK(Decode)->Arg(4)->Arg(2)->Unit(benchmark::kMicrosecond);

void Memcpy(benchmark::State& state) {
  std::vector<std::uint8_t> from(radarWithLoops(128).bytes_per_frame(), 1), to(from.size());
  for (auto _ : state) {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(from.size()));
}
BENCHMARK(Memcpy)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mmradartwin

BENCHMARK_MAIN();
