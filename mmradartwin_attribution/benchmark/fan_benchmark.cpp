// What the window's thread does for each message of a range-angle map: three maps at 20 Hz are 60 of these in a second.
// And what the panel Twin does when maps and figures have come: at most 20 times a second, whatever comes.
#include <benchmark/benchmark.h>

#include <QApplication>
#include <QImage>
#include <cmath>
#include <memory>
#include <random>

#include "map_panel.h"
#include "panel/before_after.h"
#include "panel/panel_words.h"
#include "words_panel.h"

namespace mmradartwin {
namespace {

struct Map {
  std::shared_ptr<const FanGeometry> geometry;
  std::vector<float> power_db;
};

Map madeMap(int ranges, int angles) {
  std::vector<double> range, azimuth;
  for (int r = 0; r < ranges; ++r) range.push_back(0.04 * r);
  for (int a = 0; a < angles; ++a) azimuth.push_back(std::asin((2.0 * a - angles) / angles));
  std::mt19937 draws(1);
  std::normal_distribution<float> level(-50, 10);
  Map map{std::make_shared<FanGeometry>(range, azimuth), {}};
  for (int i = 0; i < ranges * angles; ++i) map.power_db.push_back(level(draws));
  return map;
}

// Levels to texels.
void BM_Shade(benchmark::State& state) {
  const Map map = madeMap(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  MapShading shading;
  shading.residual = state.range(2) != 0;
  ShadedMap shaded;
  for (auto _ : state) {
    shade(*map.geometry, map.power_db, shading, shaded);
    benchmark::DoNotOptimize(shaded.argb.data());
  }
}
BENCHMARK(BM_Shade)
    ->ArgNames({"ranges", "angles", "residual"})
    ->Args({256, 64, 0})
    ->Args({256, 64, 1})
    ->Args({256, 181, 0})
    ->Unit(benchmark::kMillisecond);

// Levels to a painted panel of the layout's size, with boxes.
void BM_ShadeAndPaint(benchmark::State& state) {
  const Map map = madeMap(256, static_cast<int>(state.range(0)));
  MapPanel panel;
  panel.resize(440, 310);
  panel.setFan(map.geometry, 8, M_PI / 3);
  std::vector<MapMark> marks;
  for (int i = 1; i <= state.range(1); ++i) marks.push_back({0.8 * i, 0.1 * (i - 4), 0.2, 0.06, kMismatchBox, i});
  panel.setMarks(marks);
  QImage window(panel.size(), QImage::Format_RGB32);
  ShadedMap shaded;
  for (auto _ : state) {
    shade(*map.geometry, map.power_db, {}, shaded);
    if (state.range(2) != 0) {  // boxes move from map to map
      for (MapMark& mark : marks) mark.azimuth_rad = -mark.azimuth_rad;
    }
    panel.setMarks(marks);
    panel.setMap(shaded, "dB of peak");
    panel.refresh();
    panel.render(&window);
  }
}
BENCHMARK(BM_ShadeAndPaint)
    ->ArgNames({"angles", "boxes", "moving"})
    ->Args({64, 0, 0})
    ->Args({64, 8, 0})
    ->Args({64, 8, 1})
    ->Args({181, 8, 0})
    ->Unit(benchmark::kMillisecond);

TwinFigures madeFigures(unsigned poses) {
  const Map map = madeMap(256, 64);
  auto levels = boost::make_shared<mmradartwin_msgs::RangeAngleMap>();
  for (int r = 0; r < 256; ++r) levels->range_m.push_back(0.04 * r);
  for (int a = 0; a < 64; ++a) levels->azimuth_rad.push_back(std::asin((2.0 * a - 64) / 64));
  levels->power_db = map.power_db;
  auto residual = boost::make_shared<mmradartwin_msgs::RangeAngleMap>(*levels);
  residual->source = kResidualSource;
  auto pose = boost::make_shared<mmradartwin_msgs::PoseFigures>();
  pose->figures.poses = poses;
  auto all = boost::make_shared<mmradartwin_msgs::Ledger>(pose->figures);
  return {"as given", pose, all, levels, residual};
}

// The window "Before and after", open, with new maps of the twin that is simulated.
void BM_BeforeAndAfter(benchmark::State& state) {
  BeforeAfter window(nullptr);
  window.show();
  const TwinFigures given = madeFigures(1), other = madeFigures(2), third = madeFigures(3);
  QImage shown(window.size(), QImage::Format_RGB32);
  int i = 0;
  for (auto _ : state) {
    window.showTwins(given, ++i % 2 == 0 ? other : third);
    window.render(&shown);
  }
}
BENCHMARK(BM_BeforeAndAfter)->Unit(benchmark::kMillisecond);

// The panel's table of figures, which change with each pair of maps.
void BM_PanelFigures(benchmark::State& state) {
  WordsPanel words("Figures");
  words.resize(340, 220);
  words.show();
  const TwinFigures before = madeFigures(1), other = madeFigures(2), third = madeFigures(3);
  QImage shown(words.size(), QImage::Format_RGB32);
  int i = 0;
  for (auto _ : state) {
    words.setWords(wordsOf(++i % 2 == 0 ? other : third, before));
    words.render(&shown);
  }
}
BENCHMARK(BM_PanelFigures)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  qputenv("QT_QPA_PLATFORM", "offscreen");
  const QApplication application(argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
