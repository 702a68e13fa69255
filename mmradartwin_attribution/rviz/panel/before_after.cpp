#include "before_after.h"

#include <QGridLayout>
#include <QLabel>
#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "../map_panel.h"
#include "panel_words.h"

namespace mmradartwin {
namespace {

constexpr double kFront_rad = 60 * M_PI / 180;
constexpr double kPeakBeyond_m = 0.16;  ///< nearer cells hold what leaks from transmitters to receivers
constexpr double kShown_db = 30;        ///< maps reach as far as levels so much below their peak
constexpr double kSamePlace_m = 0.01, kSameHeading_rad = 0.01;

MapShading shadingOf(bool residual) {
  MapShading shading;
  shading.residual = residual;
  shading.peak_beyond_m = kPeakBeyond_m;
  shading.peak_azimuth_rad = kFront_rad;
  shading.mask_azimuth_rad = kFront_rad;
  return shading;
}

/// True where the radar stood elsewhere, or looked elsewhere.
bool moved(const mmradartwin_msgs::RangeAngleMap& a, const mmradartwin_msgs::RangeAngleMap& b) {
  if (!a.pose_valid || !b.pose_valid) return false;
  const auto &p = a.T_map_radar.position, &q = b.T_map_radar.position;
  const auto &u = a.T_map_radar.orientation, &v = b.T_map_radar.orientation;
  const double cosine = std::min(1.0, std::abs(u.x * v.x + u.y * v.y + u.z * v.z + u.w * v.w));
  return std::hypot(p.x - q.x, p.y - q.y, p.z - q.z) > kSamePlace_m || 2 * std::acos(cosine) > kSameHeading_rad;
}

}  // namespace

BeforeAfter::BeforeAfter(QWidget* parent) : QWidget(parent, Qt::Window) {
  setObjectName("before_after_window");
  setWindowTitle("Before and after");
  auto* grid = new QGridLayout(this);
  words_ = new QLabel;
  words_->setObjectName("before_after_words");
  words_->setWordWrap(true);
  grid->addWidget(words_, 0, 0, 1, 2);
  const char* const kNames[2][2] = {{"simulated_given", "simulated_corrected"},
                                    {"residual_given", "residual_corrected"}};
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 2; ++column) {
      auto* panel = new MapPanel;
      panel->setObjectName(kNames[row][column]);
      grid->addWidget(panel, row + 1, column);
      grid->setRowStretch(row + 1, 1);
      maps_[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)].panel = panel;
    }
  }
  resize(1000, 760);
}

void BeforeAfter::take(Map& map, const mmradartwin_msgs::RangeAngleMap::ConstPtr& msg, bool residual) {
  if (msg == map.shown) return;
  const mmradartwin_msgs::RangeAngleMap::ConstPtr before = std::exchange(map.shown, nullptr);
  if (!msg) return;
  try {
    // Axes follow from the radar.
    const bool known = before && before->radar_hash == msg->radar_hash && before->range_m == msg->range_m;
    if (!known) map.geometry = std::make_shared<FanGeometry>(msg->range_m, msg->azimuth_rad);
    shade(*map.geometry, msg->power_db, shadingOf(residual), map.shaded);
    map.shown = msg;
  } catch (const std::exception& error) {
    words_->setText(error.what());
  }
}

void BeforeAfter::draw(Map& map, double up_to_m, const QString& title, const QString& note) {
  map.panel->setWords(title, map.shown ? note : QString("no map has come yet"));
  if (map.shown) {
    map.panel->setFan(map.geometry, std::min(up_to_m, map.geometry->farthest_m()), kFront_rad);
    map.panel->setMap(map.shaded, map.shown->source == kResidualSource ? QString::fromUtf8("twin − meas., dB")
                                                                       : QString("dB of peak"));
  }
  map.panel->refresh();
}

void BeforeAfter::showTwins(const TwinFigures& given, const TwinFigures& corrected) {
  const std::array<const TwinFigures*, 2> twins = {&given, &corrected};
  const std::array<const char*, 2> labels = {"as given", "with findings"};
  words_->setText("The twin as given at the left, and with what the diagnosis has found at the right.");
  double up_to_m = 1;
  for (std::size_t i = 0; i < 2; ++i) {
    take(maps_[0][i], twins[i]->simulated, false);
    take(maps_[1][i], twins[i]->residual, true);
    const Map& levels = maps_[0][i];
    if (!levels.shown) continue;
    up_to_m = std::max(up_to_m, farthestOver_m(*levels.geometry, levels.shown->power_db, levels.shaded, kShown_db));
  }
  if (given.simulated && corrected.simulated && moved(*given.simulated, *corrected.simulated)) {
    words_->setText(
        "The radar has moved since: the maps at the left and at the right are of two places, and differ by that, too.");
  }
  up_to_m = std::ceil(1.05 * up_to_m);
  for (std::size_t i = 0; i < 2; ++i) {
    draw(maps_[0][i], up_to_m, QString("Simulated, ") + labels[i], QString());
    draw(maps_[1][i], up_to_m, QString("Residual, ") + labels[i], shortWordsOf(*twins[i]));
  }
}

}  // namespace mmradartwin
