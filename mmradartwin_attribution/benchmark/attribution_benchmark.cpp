// Maps to residuals, and the whole chain from a raw frame to residuals with a 100-frame average while the radar stands.

#include <benchmark/benchmark.h>

#include <random>

#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

// The shipped office and radar, the radar standing in its middle.
struct Bench {
  Bench() : radar(loadRadarConfig(MMRADARTWIN_CONFIG_DIR "/radar.yaml")) {
    twin = std::make_unique<Twin>(loadTwin("", std::string(MMRADARTWIN_CONFIG_DIR "/office/scene.yaml"), radar));
    chain = std::make_unique<SignalChain>(radar);
    field = std::make_unique<EvaluationField>(AttributionConfig(), radar, chain->axes());
    regions = std::make_unique<RegionModel>(twin->scene(), twin->rays(), *field, radar);
    simulation = twin->simulate(T);
    simulated = chain->map(simulation.grid);
    // A measured frame: what the twin sees plus noise, in counts.
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 20);
    const double gain = 8000 / simulation.grid.x.cwiseAbs().maxCoeff();
    cube.chirps = radar.chirps_per_frame();
    cube.samples = radar.samples_per_chirp;
    cube.receivers = radar.receivers();
    cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
    for (int c = 0; c < cube.chirps; ++c) {
      for (int n = 0; n < cube.samples; ++n) {
        for (int rx = 0; rx < cube.receivers; ++rx) {
          const auto x = gain * simulation.grid.x((c % radar.slots()) * cube.receivers + rx, n);
          cube.data.push_back(static_cast<std::int16_t>(x.real() + noise(random)));
          cube.data.push_back(static_cast<std::int16_t>(x.imag() + noise(random)));
        }
      }
    }
  }

  RadarConfig radar;
  Eigen::Isometry3d T = Eigen::Translation3d(3.2, 2.0, 1.0) * Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ());
  std::unique_ptr<Twin> twin;
  std::unique_ptr<SignalChain> chain;
  std::unique_ptr<EvaluationField> field;
  std::unique_ptr<RegionModel> regions;
  Simulation simulation;
  RangeAngleMap simulated;
  AdcCube cube;
};

Bench& bench() {
  static Bench instance;
  return instance;
}

void BM_MapsToResiduals(benchmark::State& state) {
  Bench& b = bench();
  CoherentAverage average(b.radar, 100);
  average.add(b.cube);
  const RangeAngleMap measured = b.chain->map(average.grid());
  const auto regions = b.regions->regions(b.T);
  for (auto _ : state) {
    benchmark::DoNotOptimize(attributePose(*b.field, measured, b.simulated, regions, b.simulation.records));
  }
}
BENCHMARK(BM_MapsToResiduals)->Unit(benchmark::kMillisecond);

void BM_RegionsOfAPose(benchmark::State& state) {
  Bench& b = bench();
  for (auto _ : state) benchmark::DoNotOptimize(b.regions->regions(b.T));
}
BENCHMARK(BM_RegionsOfAPose)->Unit(benchmark::kMillisecond);

// One more frame of a standing radar: average, both maps (the twin's grid rebuilt from its records), residuals.
void BM_CubeToResiduals(benchmark::State& state) {
  Bench& b = bench();
  CoherentAverage average(b.radar, 100);
  for (int i = 0; i < 100; ++i) average.add(b.cube);
  const auto regions = b.regions->regions(b.T);
  ReceiveGrid grid = b.simulation.grid;
  for (auto _ : state) {
    average.add(b.cube);
    const RangeAngleMap measured = b.chain->map(average.grid());
    grid.x.setZero();
    accumulate(b.radar, b.simulation.records, grid.x);
    const RangeAngleMap simulated = b.chain->map(grid);
    benchmark::DoNotOptimize(attributePose(*b.field, measured, simulated, regions, b.simulation.records));
  }
  state.counters["frames/s"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(BM_CubeToResiduals)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mmradartwin

BENCHMARK_MAIN();
