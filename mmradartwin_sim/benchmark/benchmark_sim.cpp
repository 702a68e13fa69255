// One pose of an office beside bare Embree rays on the same mesh, grids from records, and re-use of records.

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <random>

#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/twin.h"

using namespace mmradartwin;

namespace {

std::string office() {
  const char* given = std::getenv("MMRADARTWIN_SCENE");
  return given ? given : MMRADARTWIN_OFFICE;
}

const Twin& twin() {
  static const Twin t = [] {
    Twin made(loadTwin("", office(), paperRadar()));
    for (const std::string& note : made.notes()) std::cerr << "note: " << note << "\n";
    return made;
  }();
  return t;
}

Eigen::Isometry3d pose(int i) {
  return Eigen::Translation3d(2.0 + 0.13 * (i % 20), 2.4 + 0.05 * (i % 7), 1.0) *
         Eigen::AngleAxisd(0.9 * i, Eigen::Vector3d::UnitZ());
}

void pose8Channels(benchmark::State& state) {
  int i = 0;
  std::size_t records = 0;
  for (auto _ : state) records += twin().simulate(pose(i++)).records.size();
  state.counters["records"] =
      benchmark::Counter(static_cast<double>(records) / static_cast<double>(state.iterations()));
}
BENCHMARK(pose8Channels)->Unit(benchmark::kMillisecond);

void pose8ChannelsWithKnifeEdges(benchmark::State& state) {
  TwinDescription description = loadTwin("", office(), paperRadar());
  for (NamedParameters& m : description.mechanisms) {
    if (m.values.has("knife_edges")) m.values.set("knife_edges", 1.0);
  }
  const Twin grazed(description);
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(grazed.simulate(pose(i++)).records.size());
}
BENCHMARK(pose8ChannelsWithKnifeEdges)->Unit(benchmark::kMillisecond);

void recordsToGrid(benchmark::State& state) {
  const Simulation s = twin().simulate(pose(0));
  ComplexGrid x;
  for (auto _ : state) {
    x.setZero();
    accumulate(twin().radar(), s.records, x);
    benchmark::DoNotOptimize(x.data());
  }
  state.counters["records/s"] = benchmark::Counter(
      static_cast<double>(s.records.size()) * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}
BENCHMARK(recordsToGrid)->Unit(benchmark::kMillisecond);

void weighAgain(benchmark::State& state) {
  const auto traced = twin().trace(pose(0));
  for (auto _ : state) benchmark::DoNotOptimize(twin().weigh(pose(0), traced).grid.x.data());
}
BENCHMARK(weighAgain)->Unit(benchmark::kMillisecond);

void loadScene(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(mmradartwin::loadScene(office(), 77.93e9).facets.size());
}
BENCHMARK(loadScene)->Unit(benchmark::kMillisecond);

/// Bare Embree on the same triangles: rays from a radar pose and their cosine-distributed bounces.
void bareEmbreeBounces(benchmark::State& state) {
  const Scene& scene = twin().scene();
  RTCDevice device = rtcNewDevice("threads=1");
  RTCScene embree = rtcNewScene(device);
  for (const Actor& a : scene.actors) {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* v = static_cast<float*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, a.vertices.size()));
    auto* t = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, a.triangles.size()));
    for (std::size_t i = 0; i < a.vertices.size(); ++i) {
      for (int k = 0; k < 3; ++k) v[3 * i + k] = static_cast<float>(a.vertices[i][k]);
    }
    for (std::size_t i = 0; i < a.triangles.size(); ++i) {
      for (int k = 0; k < 3; ++k) t[3 * i + k] = static_cast<unsigned>(a.triangles[i][k]);
    }
    rtcCommitGeometry(g);
    rtcAttachGeometry(embree, g);
    rtcReleaseGeometry(g);
  }
  rtcCommitScene(embree);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::size_t rays = 0;
  for (auto _ : state) {
    RTCRayHit q{};
    const Eigen::Isometry3d T = pose(static_cast<int>(rays % 97));
    q.ray.org_x = static_cast<float>(T.translation().x());
    q.ray.org_y = static_cast<float>(T.translation().y());
    q.ray.org_z = static_cast<float>(T.translation().z());
    Eigen::Vector3f d(unit(random), unit(random), 0.3f * unit(random));
    for (int bounce = 0; bounce < 6; ++bounce) {
      d.normalize();
      q.ray.dir_x = d.x();
      q.ray.dir_y = d.y();
      q.ray.dir_z = d.z();
      q.ray.tnear = 0;
      q.ray.tfar = 100;
      q.ray.mask = static_cast<unsigned>(-1);
      q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      RTCIntersectContext context;
      rtcInitIntersectContext(&context);
      rtcIntersect1(embree, &context, &q);
      ++rays;
      if (q.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
      Eigen::Vector3f n = Eigen::Vector3f(q.hit.Ng_x, q.hit.Ng_y, q.hit.Ng_z).normalized();
      if (n.dot(d) > 0) n = -n;
      q.ray.org_x += q.ray.tfar * d.x() + 1e-4f * n.x();
      q.ray.org_y += q.ray.tfar * d.y() + 1e-4f * n.y();
      q.ray.org_z += q.ray.tfar * d.z() + 1e-4f * n.z();
      d = n + 0.99f * Eigen::Vector3f(unit(random), unit(random), unit(random)).normalized();
    }
  }
  state.counters["rays/s"] = benchmark::Counter(static_cast<double>(rays), benchmark::Counter::kIsRate);
  rtcReleaseScene(embree);
  rtcReleaseDevice(device);
}
BENCHMARK(bareEmbreeBounces);

}  // namespace

BENCHMARK_MAIN();
