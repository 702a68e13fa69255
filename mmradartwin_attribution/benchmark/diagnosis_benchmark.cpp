// Where a diagnosis spends its time: expected channels of a pose, their likelihood and its derivatives, one moved
// actor. Each beside what bounds it in the same run.

#include <benchmark/benchmark.h>
#include <tbb/global_control.h>

#include <Eigen/Cholesky>
#include <random>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/clutter_field.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis {
namespace {

// The shipped office and radar at some poses; measured is what the twin expects, with noise.
struct Bench {
  Bench()
      : twin(loadTwin("", std::string(MMRADARTWIN_CONFIG_DIR "/office/scene.yaml"),
                      loadRadarConfig(MMRADARTWIN_CONFIG_DIR "/radar.yaml"))) {
    data.radar = twin.radar();
    const SignalChain chain(data.radar);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 1e-7);
    for (int i = 0; i < 8; ++i) {
      PoseChannels p;
      p.pose.name = std::to_string(i);
      p.pose.T_map_radar = Eigen::Translation3d(2.2 + 0.5 * i, 2.0 + 0.2 * i, 1.0) *
                           Eigen::AngleAxisd(0.8 * i, Eigen::Vector3d::UnitZ());
      p.location = i;
      p.noise_power = 1e-15;
      p.grid = twin.simulate(p.pose.T_map_radar).grid;
      for (Eigen::Index k = 0; k < p.grid.x.size(); ++k)
        p.grid.x.data()[k] += std::complex<double>(noise(random), noise(random));
      transformGrid(chain, p);
      data.locations.push_back(p.pose.name);
      poses.push_back(i);
      data.poses.push_back(std::move(p));
    }
    expectClutter(twin.scene(), data);
    mechanisms = twin.description().mechanisms;
    source = std::make_unique<ExpectedEchoes>(twin, data, PoseAccuracy());
    model = std::make_unique<ChannelLikelihood>(data, static_cast<int>(twin.scene().actors.size()), PoseAccuracy());
    source->pointBeams(data, mechanisms, model->firstBin());
    source->setBaseline(mechanisms);
    echoes = source->echoes(mechanisms);
    latents = model->start(echoes);
    model->fit(echoes, latents, 3);
    moved = defaultMechanism("actor_moved");
    moved.values.set("actor", std::string("pillar"));
  }
  std::vector<NamedParameters> withPillarAt(double dx_m) {
    std::vector<NamedParameters> all = mechanisms;
    moved.values.set("dx_m", dx_m);
    all.push_back(moved);
    return all;
  }

  Twin twin;
  ChannelData data;
  std::vector<int> poses;
  std::vector<NamedParameters> mechanisms;
  NamedParameters moved;
  std::unique_ptr<ExpectedEchoes> source;
  std::unique_ptr<ChannelLikelihood> model;
  std::vector<PoseEchoes> echoes;
  SessionLatents latents;
};

Bench& bench() {
  static Bench instance;
  return instance;
}

// Beside it: as many Cholesky factors of 8 by 8 matrices by Eigen.
void BM_LikelihoodOfAPose(benchmark::State& state) {
  Bench& b = bench();
  for (auto _ : state) benchmark::DoNotOptimize(b.model->byPose({b.echoes[0]}, b.latents, {0}));
}
BENCHMARK(BM_LikelihoodOfAPose)->Unit(benchmark::kMicrosecond);

void BM_LimitCholeskyOfItsCells(benchmark::State& state) {
  const Eigen::MatrixXcd r = Eigen::MatrixXcd::Random(8, 8), s = r * r.adjoint() + Eigen::MatrixXcd::Identity(8, 8);
  for (auto _ : state) {
    for (int cell = 0; cell < 70; ++cell) benchmark::DoNotOptimize(Eigen::LLT<Eigen::MatrixXcd>(s).matrixLLT().data());
  }
}
BENCHMARK(BM_LimitCholeskyOfItsCells)->Unit(benchmark::kMicrosecond);

void BM_DerivativesOfAPose(benchmark::State& state) {
  Bench& b = bench();
  for (auto _ : state) benchmark::DoNotOptimize(b.model->basis(b.echoes, b.latents, false));
  state.SetItemsProcessed(state.iterations() * 8);
}
BENCHMARK(BM_DerivativesOfAPose)->Unit(benchmark::kMicrosecond);

// Eight poses: an actor somewhere else, its paths traced and collected; limit: the whole traced anew.
void BM_MovedActor(benchmark::State& state) {
  Bench& b = bench();
  double dx_m = 0.1;
  for (auto _ : state) benchmark::DoNotOptimize(b.source->echoes(b.withPillarAt(dx_m += 1e-4), b.poses, {}));
  state.SetItemsProcessed(state.iterations() * 8);
}
BENCHMARK(BM_MovedActor)->Unit(benchmark::kMicrosecond);

void BM_LimitWholeTwinTraced(benchmark::State& state) {
  Bench& b = bench();
  double dx_m = 0.1;
  for (auto _ : state) {
    const Twin twin = b.twin.changed(b.withPillarAt(dx_m += 1e-4));
    for (int i : b.poses)
      benchmark::DoNotOptimize(twin.trace(b.data.poses[static_cast<std::size_t>(i)].pose.T_map_radar));
  }
  state.SetItemsProcessed(state.iterations() * 8);
}
BENCHMARK(BM_LimitWholeTwinTraced)->Unit(benchmark::kMicrosecond);

// A weight of all echoes: nothing is traced, all is collected.
void BM_WeighedEchoes(benchmark::State& state) {
  Bench& b = bench();
  NamedParameters loss = defaultMechanism("excess_attenuation");
  double db_per_m = 0.1;
  for (auto _ : state) {
    std::vector<NamedParameters> all = b.mechanisms;
    loss.values.set("db_per_m", db_per_m += 1e-4);
    all.push_back(loss);
    benchmark::DoNotOptimize(b.source->echoes(all, b.poses, {}));
  }
  state.SetItemsProcessed(state.iterations() * 8);
}
BENCHMARK(BM_WeighedEchoes)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mmradartwin::diagnosis

int main(int argc, char** argv) {
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
