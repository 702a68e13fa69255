// Each kind of change to a twin by hand, at one pose of the shipped office: from the change to the grid, and to the
// compared maps. MMRADARTWIN_SCENE names another scene.yaml, whose middle is the pose then; MMRADARTWIN_MOVER the actor
// of it that is moved, hidden and made of other materials.

#include <benchmark/benchmark.h>

#include <cstdlib>
#include <functional>
#include <string>

#include "mmradartwin_attribution/what_if_comparison.h"
#include "mmradartwin_dsp/paper_radar.h"

using namespace mmradartwin;

namespace {

using Change = std::function<void(WhatIf&, int)>;

std::string office() {
  const char* given = std::getenv("MMRADARTWIN_SCENE");
  return given ? given : std::string(MMRADARTWIN_CONFIG_DIR) + "/office/scene.yaml";
}

std::string mover(const char* of_office) {
  const char* given = std::getenv("MMRADARTWIN_MOVER");
  return given ? given : of_office;
}

Eigen::Isometry3d pose(const Scene& scene) {
  Eigen::Vector3d at_m(2.5, 2.2, 1);
  if (std::getenv("MMRADARTWIN_SCENE")) {
    Eigen::AlignedBox3d all;
    for (const Actor& actor : scene.actors) all.extend(actor.bounds);
    at_m = all.center();
  }
  return Eigen::Translation3d(at_m) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
}

WhatIf whatIf() {
  TwinDescription description = loadTwin("", office(), paperRadar());
  WhatIf what_if(description);
  what_if.switchMechanism("element_pattern", 0, true);
  return what_if;
}

void addCounters(benchmark::State& state, WhatIf& what_if) {
  state.counters["records"] = static_cast<double>(what_if.simulate(pose(what_if.given().scene())).records.size());
  state.counters["traced"] = what_if.work().traced;
  state.counters["updated"] = what_if.work().updated;
  state.counters["reflected"] = what_if.work().reflected;
}

/// From the change to the grid.
void toGrid(benchmark::State& state, const Change& change) {
  WhatIf what_if = whatIf();
  const Eigen::Isometry3d T_map_radar = pose(what_if.given().scene());
  what_if.simulate(T_map_radar);
  int i = 0;
  for (auto _ : state) {
    change(what_if, i++);
    benchmark::DoNotOptimize(what_if.simulate(T_map_radar).grid.x.data());
  }
  addCounters(state, what_if);
}

/// From the change to all that is shown: map, regions, residuals and numbers.
void toMaps(benchmark::State& state, const Change& change) {
  WhatIf what_if = whatIf();
  WhatIfComparison comparison(what_if, AttributionConfig());
  const Eigen::Isometry3d T_map_radar = pose(what_if.given().scene());
  RangeAngleMap measured = SignalChain(paperRadar()).map(what_if.given().simulate(T_map_radar).grid);
  measured.pose_valid = true;
  measured.T_map_radar = T_map_radar;
  comparison.setMeasured(measured);
  comparison.given();
  comparison.now();
  int i = 0;
  for (auto _ : state) {
    change(what_if, i++);
    benchmark::DoNotOptimize(comparison.now().numbers.explained_power);
  }
  addCounters(state, what_if);
}

const std::pair<const char*, Change> kChanges[] = {
    {"material of an actor",
     [](WhatIf& w, int i) { w.setMaterial(mover("cabinet_north"), i % 2 == 0 ? "Wood" : "Glass"); }},
    {"value of a material",
     [](WhatIf& w, int i) { w.setMaterialValue("Concrete", "relative_permittivity", 4 + 0.01 * (i % 100)); }},
    {"parameter of a pattern",
     [](WhatIf& w, int i) { w.setParameter("element_pattern", 0, "cos_exponent", 1 + 0.01 * (i % 100)); }},
    {"receiver's filter on and off", [](WhatIf& w, int i) { w.switchMechanism("if_highpass", 0, i % 2 == 0); }},
    {"actor moved",
     [](WhatIf& w, int i) {
       w.moveActor(mover("sofa"), {0.01 * (i % 50), 0, 0}, i % 30);
     }},
    {"actor hidden and shown", [](WhatIf& w, int i) { w.hideActor(mover("sofa"), i % 2 == 0); }},
    {"edge diffraction on and off", [](WhatIf& w, int i) { w.switchMechanism("edge_diffraction", 0, i % 2 == 0); }},
    {"radar turned", [](WhatIf& w, int i) { w.placeRadar(0, 0, 0.1 * (i % 50 + 1), 0); }}};

}  // namespace

int main(int argc, char** argv) {
  for (const auto& [name, change] : kChanges) {
    benchmark::RegisterBenchmark((std::string(name) + ", to the grid").c_str(), toGrid, change)
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark((std::string(name) + ", to the maps").c_str(), toMaps, change)
        ->Unit(benchmark::kMillisecond);
  }
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
