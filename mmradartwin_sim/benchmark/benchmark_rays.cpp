// Each class of ray that the simulator casts beside a bare Embree loop over the same rays on the same mesh, one thread;
// a full pose with 50,000 scatter points, weighing it again, moving one actor of it, and the limit of 300,000 or
// 1,000,000 bounce rays. What a pose costs by poses, threads, patches and triangles, and the memory of it all.
// MMRADARTWIN_SCENE names another scene.yaml than the shipped office, MMRADARTWIN_MOVER the actor that moves in it.

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_sim/cell_records.h"
#include "mmradartwin_sim/moving_twin.h"
#include "mmradartwin_sim/twin.h"

using namespace mmradartwin;

namespace {

std::string sceneFile() {
  const char* given = std::getenv("MMRADARTWIN_SCENE");
  return given ? given : MMRADARTWIN_OFFICE;
}

/// Embree alone on a scene's triangles, about the same centre as the simulator's.
class BareEmbree {
 public:
  explicit BareEmbree(const Scene& scene) : device_(rtcNewDevice("threads=1")), scene_(rtcNewScene(device_)) {
    rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_MEDIUM);
    Eigen::AlignedBox3d all;
    for (const Actor& a : scene.actors) {
      for (const auto& v : a.vertices) all.extend(v);
    }
    center_ = all.center();
    for (const Actor& a : scene.actors) {
      RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      auto* v = static_cast<float*>(
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, a.vertices.size()));
      auto* t = static_cast<unsigned*>(
          rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, a.triangles.size()));
      for (std::size_t i = 0; i < a.vertices.size(); ++i) {
        for (int k = 0; k < 3; ++k) v[3 * i + k] = static_cast<float>(a.vertices[i][k] - center_[k]);
      }
      for (std::size_t i = 0; i < a.triangles.size(); ++i) {
        for (int k = 0; k < 3; ++k) t[3 * i + k] = static_cast<unsigned>(a.triangles[i][k]);
      }
      rtcCommitGeometry(g);
      rtcAttachGeometry(scene_, g);
      rtcReleaseGeometry(g);
    }
    rtcCommitScene(scene_);
  }
  ~BareEmbree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  const Eigen::Vector3d& center() const { return center_; }
  /// Ray as Embree wants it, prepared before the loop.
  RTCRay ray(const Eigen::Vector3d& from, const Eigen::Vector3d& direction, double length) const {
    RTCRay r{};
    r.org_x = static_cast<float>(from.x() - center_.x());
    r.org_y = static_cast<float>(from.y() - center_.y());
    r.org_z = static_cast<float>(from.z() - center_.z());
    r.dir_x = static_cast<float>(direction.x());
    r.dir_y = static_cast<float>(direction.y());
    r.dir_z = static_cast<float>(direction.z());
    r.tfar = static_cast<float>(length);
    r.mask = static_cast<unsigned>(-1);
    return r;
  }
  bool intersect(RTCRayHit& q) const {
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene_, &context, &q);
    return q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  bool occluded(RTCRay& r) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &r);
    return r.tfar < 0;
  }

 private:
  RTCDevice device_;
  RTCScene scene_;
  Eigen::Vector3d center_;
};

struct Setting {
  Scene scene = loadScene(sceneFile(), 77.93e9);
  RayCaster rays{scene};
  BareEmbree bare{scene};
  std::vector<Eigen::Vector3d> direction;  // a fan of 120 by 30 deg, scan order
  std::vector<Eigen::Vector3d> target;     // what it meets, shuffled: ends of occlusion rays
  std::vector<Eigen::Vector3d> scan;       // the same, in scan order
  Eigen::Vector3d radar{3.0, 2.6, 1.0};
  Setting() {
    if (std::getenv("MMRADARTWIN_SCENE")) {
      Eigen::AlignedBox3d all;
      for (const Actor& a : scene.actors) all.extend(a.bounds);
      radar = all.center();
    }
    for (int j = 0; j < 200; ++j) {
      for (int i = 0; i < 500; ++i) {
        const double az = (i / 499.0 - 0.5) * 120 * M_PI / 180, el = (j / 199.0 - 0.5) * 30 * M_PI / 180;
        direction.emplace_back(std::cos(el) * std::cos(az), std::cos(el) * std::sin(az), std::sin(el));
      }
    }
    for (const auto& d : direction) {
      if (const auto hit = rays.firstHit(radar, d, 1000)) target.push_back(hit->point);
    }
    scan = target;
    std::shuffle(target.begin(), target.end(), std::mt19937(1));
  }
};

const Setting& setting() {
  static const Setting s;
  return s;
}

void report(benchmark::State& state, std::size_t rays) {
  state.counters["rays/s"] = benchmark::Counter(static_cast<double>(rays) * static_cast<double>(state.iterations()),
                                                benchmark::Counter::kIsRate);
}

void firstHitBare(benchmark::State& state) {
  const Setting& s = setting();
  std::vector<RTCRay> prepared;
  for (const auto& d : s.direction) prepared.push_back(s.bare.ray(s.radar, d, 1000));
  for (auto _ : state) {
    for (const RTCRay& r : prepared) {
      RTCRayHit q;
      q.ray = r;
      benchmark::DoNotOptimize(s.bare.intersect(q));
    }
  }
  report(state, prepared.size());
}
BENCHMARK(firstHitBare)->Unit(benchmark::kMillisecond);

void firstHitOurs(benchmark::State& state) {
  const Setting& s = setting();
  for (auto _ : state) {
    for (const auto& d : s.direction) benchmark::DoNotOptimize(s.rays.firstHit(s.radar, d, 1000));
  }
  report(state, s.direction.size());
}
BENCHMARK(firstHitOurs)->Unit(benchmark::kMillisecond);

void occlusionBare(benchmark::State& state) {
  const Setting& s = setting();
  std::vector<RTCRay> prepared;
  for (const auto& t : s.target) {
    const Eigen::Vector3d way = t - s.radar, d = way.normalized();
    prepared.push_back(s.bare.ray(s.radar + 1e-3 * d, d, way.norm() - 2e-3));
  }
  for (auto _ : state) {
    for (const RTCRay& r : prepared) {
      RTCRay q = r;
      benchmark::DoNotOptimize(s.bare.occluded(q));
    }
  }
  report(state, prepared.size());
}
BENCHMARK(occlusionBare)->Unit(benchmark::kMillisecond);

void occlusionOurs(benchmark::State& state) {
  const Setting& s = setting();
  for (auto _ : state) {
    for (const auto& t : s.target) benchmark::DoNotOptimize(s.rays.visible(s.radar, t, 1e-3));
  }
  report(state, s.target.size());
}
BENCHMARK(occlusionOurs)->Unit(benchmark::kMillisecond);

/// The same rays in the order of the facets' points, as the scatterers of a pose are asked for: packets of eight.
void occlusionInOrderBare(benchmark::State& state) {
  const Setting& s = setting();
  std::vector<RTCRay> prepared;
  for (const auto& t : s.scan) {
    const Eigen::Vector3d way = t - s.radar, d = way.normalized();
    prepared.push_back(s.bare.ray(s.radar + 1e-3 * d, d, way.norm() - 2e-3));
  }
  for (auto _ : state) {
    for (const RTCRay& r : prepared) {
      RTCRay q = r;
      benchmark::DoNotOptimize(s.bare.occluded(q));
    }
  }
  report(state, prepared.size());
}
BENCHMARK(occlusionInOrderBare)->Unit(benchmark::kMillisecond);

void occlusionInOrderOurs(benchmark::State& state) {
  const Setting& s = setting();
  const std::vector<double> gap(s.scan.size(), 1e-3);
  for (auto _ : state) benchmark::DoNotOptimize(s.rays.visible(s.radar, s.scan, gap).data());
  report(state, s.scan.size());
}
BENCHMARK(occlusionInOrderOurs)->Unit(benchmark::kMillisecond);

/// Cosine-distributed bounces, six to a ray: the limit that a full pose is held against.
void bareBounceRays(benchmark::State& state) {
  const Setting& s = setting();
  const std::int64_t wanted = state.range(0);
  for (auto _ : state) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(-1, 1);
    std::int64_t rays = 0;
    while (rays < wanted) {
      RTCRayHit q{};
      Eigen::Vector3f d(unit(random), unit(random), 0.3f * unit(random));
      q.ray = s.bare.ray(s.radar, d.cast<double>().normalized(), 1000);
      for (int bounce = 0; bounce < 6 && rays < wanted; ++bounce) {
        ++rays;
        if (!s.bare.intersect(q)) break;
        d = Eigen::Vector3f(q.ray.dir_x, q.ray.dir_y, q.ray.dir_z);
        Eigen::Vector3f n = Eigen::Vector3f(q.hit.Ng_x, q.hit.Ng_y, q.hit.Ng_z).normalized();
        if (n.dot(d) > 0) n = -n;
        q.ray.org_x += q.ray.tfar * d.x() + 1e-4f * n.x();
        q.ray.org_y += q.ray.tfar * d.y() + 1e-4f * n.y();
        q.ray.org_z += q.ray.tfar * d.z() + 1e-4f * n.z();
        d = (n + 0.99f * Eigen::Vector3f(unit(random), unit(random), unit(random)).normalized()).normalized();
        q.ray.dir_x = d.x();
        q.ray.dir_y = d.y();
        q.ray.dir_z = d.z();
        q.ray.tnear = 0;
        q.ray.tfar = 1000;
      }
    }
  }
  report(state, static_cast<std::size_t>(wanted));
}
BENCHMARK(bareBounceRays)->Arg(300000)->Arg(1000000)->Unit(benchmark::kMillisecond);

Twin makeTwin(const std::string& scene, const std::string& mechanisms) {
  const std::string file = (std::filesystem::temp_directory_path() / "mmradartwin_benchmark_twin.yaml").string();
  std::ofstream(file) << "mechanisms:\n" << mechanisms;
  Twin made(loadTwin(file, scene, paperRadar()));
  std::filesystem::remove(file);
  return made;
}

/// Spacing of about so many scatter points in the room.
std::string diffuse(double points) {
  const Setting& s = setting();
  double rough_m2 = 0;
  for (const Facet& f : s.scene.facets) {
    if (f.reflects && backscatterAmplitude(s.scene.actors[f.actor].material, 1, 1, 77.93e9) > 0) rough_m2 += f.area_m2;
  }
  return "  diffuse: {spacing_m: " + std::to_string(std::max(0.005, std::sqrt(rough_m2 / points))) + "}\n";
}

/// specular to order 3, corners, edges and about 50,000 scatter points in the room.
const Twin& fullTwin() {
  static const Twin twin =
      makeTwin(sceneFile(), "  specular: {}\n  corner: {}\n  edge_diffraction: {level: 1}\n" + diffuse(50000));
  return twin;
}

Eigen::Isometry3d pose(int i) {
  return Eigen::Translation3d(setting().radar) * Eigen::AngleAxisd(0.9 * i, Eigen::Vector3d::UnitZ());
}

void fullPose(benchmark::State& state) {
  const Twin& twin = fullTwin();
  int i = 0;
  std::size_t records = 0;
  for (auto _ : state) records += twin.simulate(pose(i++)).records.size();
  state.counters["records"] = static_cast<double>(records) / static_cast<double>(state.iterations());
}
BENCHMARK(fullPose)->Unit(benchmark::kMillisecond);

void fullPoseTrace(benchmark::State& state) {
  const Twin& twin = fullTwin();
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(twin.trace(pose(i++)).size());
}
BENCHMARK(fullPoseTrace)->Unit(benchmark::kMillisecond);

void fullPoseWeighAgain(benchmark::State& state) {
  const Twin& twin = fullTwin();
  const auto traced = twin.trace(pose(0));
  for (auto _ : state) benchmark::DoNotOptimize(twin.weigh(pose(0), traced).grid.x.data());
}
BENCHMARK(fullPoseWeighAgain)->Unit(benchmark::kMillisecond);

/// Records as they are exported, summed per cell of a facet.
void fullPoseCells(benchmark::State& state) {
  const Twin& twin = fullTwin();
  const auto traced = twin.trace(pose(0));
  std::size_t cells = 0;
  for (auto _ : state) cells = sumPerCell(twin.radar(), traced).size();
  state.counters["points"] = static_cast<double>(traced.size());
  state.counters["cells"] = static_cast<double>(cells);
}
BENCHMARK(fullPoseCells)->Unit(benchmark::kMillisecond);

/// One actor of the full pose goes to and fro by 5 cm while the radar stands.
void fullPoseOneActorMoved(benchmark::State& state) {
  const Twin& twin = fullTwin();
  const char* given = std::getenv("MMRADARTWIN_MOVER");
  const std::string actor = given ? given : "bin";
  if (twin.scene().actorIndex(actor) < 0) {
    state.SkipWithError(("the scene has no actor " + actor + "; set MMRADARTWIN_MOVER").c_str());
    return;
  }
  MovingTwin moving(twin, {actor});
  const Eigen::Isometry3d rest =
      twin.scene().actors[static_cast<std::size_t>(twin.scene().actorIndex(actor))].T_map_mesh;
  moving.simulate(pose(0));
  int i = 0;
  std::size_t found = 0;
  for (auto _ : state) {
    moving.place(actor, Eigen::Translation3d(0.05 * (++i % 2), 0, 0) * rest);
    benchmark::DoNotOptimize(moving.simulate(pose(0)).grid.x.data());
    found += moving.found();
  }
  state.counters["records"] = static_cast<double>(moving.simulate(pose(0)).records.size());
  state.counters["found again"] = static_cast<double>(found) / static_cast<double>(state.iterations());
}
BENCHMARK(fullPoseOneActorMoved)->Unit(benchmark::kMillisecond);
/// The same pose in full, for the comparison.
void fullPoseSamePose(benchmark::State& state) {
  const Twin& twin = fullTwin();
  for (auto _ : state) benchmark::DoNotOptimize(twin.simulate(pose(0)).grid.x.data());
}
BENCHMARK(fullPoseSamePose)->Unit(benchmark::kMillisecond);

/// Poses in parallel on so many threads.
void fullPoses(benchmark::State& state) {
  const Twin& twin = fullTwin();
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(state.range(1)));
  const int poses = static_cast<int>(state.range(0));
  for (auto _ : state) {
    tbb::parallel_for(0, poses, [&](int i) { benchmark::DoNotOptimize(twin.simulate(pose(i)).grid.x.data()); });
  }
  state.counters["poses/s"] = benchmark::Counter(static_cast<double>(poses) * static_cast<double>(state.iterations()),
                                                 benchmark::Counter::kIsRate);
}
BENCHMARK(fullPoses)
    ->ArgNames({"poses", "threads"})
    ->Args({77, 1})
    ->Args({154, 1})
    ->Args({154, 2})
    ->UseRealTime()
    ->MeasureProcessCPUTime()
    ->Unit(benchmark::kMillisecond);

void poseByPatches(benchmark::State& state) {
  const Twin twin = makeTwin(sceneFile(), diffuse(static_cast<double>(state.range(0))));
  int i = 0;
  for (auto _ : state) benchmark::DoNotOptimize(twin.simulate(pose(i++)).grid.x.data());
}
BENCHMARK(poseByPatches)->Arg(12500)->Arg(25000)->Arg(50000)->Arg(100000)->Unit(benchmark::kMillisecond);

/// A room of 6 x 5 m with a box in it, each of its seven faces in 2 n^2 triangles.
void poseByTriangles(benchmark::State& state) {
  const int n = static_cast<int>(state.range(0));
  std::string folder = (std::filesystem::temp_directory_path() / "mmradartwin_benchmark_XXXXXX").string();
  if (!mkdtemp(folder.data())) {
    state.SkipWithError("no temporary folder can be made");
    return;
  }
  {
    std::ofstream obj(folder + "/room.obj");
    int first = 1, faces = 0;
    const auto face = [&](const Eigen::Vector3d& corner, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
      obj << "o face" << faces++ << "\nusemtl Wall\n";
      for (int i = 0; i <= n; ++i) {
        for (int j = 0; j <= n; ++j) obj << "v " << (corner + a * i / n + b * j / n).transpose() << "\n";
      }
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          const int v = first + i * (n + 1) + j;
          obj << "f " << v << " " << v + n + 1 << " " << v + n + 2 << "\nf " << v << " " << v + n + 2 << " " << v + 1
              << "\n";
        }
      }
      first += (n + 1) * (n + 1);
    };
    using V = Eigen::Vector3d;
    face(V(0, 0, 0), V(6, 0, 0), V(0, 0, 3));
    face(V(0, 5, 0), V(6, 0, 0), V(0, 0, 3));
    face(V(0, 0, 0), V(0, 5, 0), V(0, 0, 3));
    face(V(6, 0, 0), V(0, 5, 0), V(0, 0, 3));
    face(V(0, 0, 0), V(6, 0, 0), V(0, 5, 0));
    face(V(4, 3, 0), V(1, 0, 0), V(0, 0, 1.5));
    face(V(4, 3, 0), V(0, 1, 0), V(0, 0, 1.5));
  }
  std::ofstream(folder + "/materials.yaml")
      << "materials: {Wall: {model: dielectric, relative_permittivity: 5.24, scattering_coefficient: 0.3}}\n";
  std::ofstream(folder + "/scene.yaml") << "meshes: [{file: room.obj}]\nmaterials: materials.yaml\n";
  const Twin twin = makeTwin(folder + "/scene.yaml",
                             "  specular: {}\n  corner: {}\n  edge_diffraction: {level: 1}\n"
                             "  diffuse: {spacing_m: 0.1}\n");
  std::filesystem::remove_all(folder);
  int i = 0;
  for (auto _ : state) {
    const Eigen::Isometry3d at =
        Eigen::Translation3d(2, 2.2, 1) * Eigen::AngleAxisd(0.9 * i++, Eigen::Vector3d::UnitZ());
    benchmark::DoNotOptimize(twin.simulate(at).grid.x.data());
  }
  state.counters["triangles"] = 7.0 * 2 * n * n;
}
BENCHMARK(poseByTriangles)->Arg(1)->Arg(10)->Arg(100)->Unit(benchmark::kMillisecond);

/// The last row: the most memory that the process ever held.
void peakMemory(benchmark::State& state) {
  rusage used{};
  for (auto _ : state) getrusage(RUSAGE_SELF, &used);
  state.counters["MB"] = static_cast<double>(used.ru_maxrss) / 1e3;
}
BENCHMARK(peakMemory)->Iterations(1);

}  // namespace

BENCHMARK_MAIN();
